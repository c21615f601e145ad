"""The attacks: a line on what each tries, the command that a victim would type, and the files."""

from __future__ import annotations

import gzip
import io
import json
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.lib.format as npy

from tests.specimens import SPECIMENS
from tests.specimens.images import png_bytes
from tests.specimens.networks import safetensors_bytes
from tests.specimens.tables import npz_bytes

HUGE = 2**31 - 1
DEEP = 20_000
ZEROS = 80 << 20
"""Bytes that a bomb unpacks to."""


@dataclass(frozen=True)
class Attack:
    """One of them.

    Parameters
    ----------
    tries
        What it would do to a reader that trusts it.
    files
        Content by name; the first is given to the command.
    says
        Words of the refusal.
    command
        What comes before the file, and after it.
    """

    tries: str
    files: Callable[[], dict[str, bytes]]
    says: str
    command: tuple[tuple[str, ...], tuple[str, ...]] = (("info",), ())

    def write(self, folder: Path) -> Path:
        """Put the files into a folder; the path for the command."""
        contents = self.files()
        for name, content in contents.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return folder / next(iter(contents)).partition("/")[0]


def _one(name: str, content: bytes) -> Callable[[], dict[str, bytes]]:
    return lambda: {name: content}


class _Payload:
    """What a pickle would run."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return print, ("PICKLE WAS RUN",)


def _pickled() -> bytes:
    array = np.empty((1, 1, 1, 3), object)
    array[...] = _Payload()
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _claimed_npy(shape: tuple[int, ...]) -> bytes:
    stream = io.BytesIO()
    npy.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue() + bytes(64)


@cache
def _bomb(method: int) -> bytes:
    """An archive of one array of zeros, of which each byte stands for many."""
    return npz_bytes(_claimed_npy((90, 90, 180, 3)) + bytes(ZEROS), method=method)


def _lying_zip() -> bytes:
    """Its list says that an array is small, its stream goes on without end."""
    data = bytearray(_bomb(zipfile.ZIP_DEFLATED))
    for signature, place in ((b"PK\1\2", 24), (b"PK\3\4", 22)):
        start = data.index(signature) + place
        data[start : start + 4] = struct.pack("<I", 400)
    return bytes(data)


def _tensors(header: object, data: bytes = b"") -> bytes:
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def _rgl(fields: int = 1, rank: int = 1, offset: int = 0, size: int = HUGE) -> bytes:
    entry = struct.pack("<H", 3) + b"rgb" + struct.pack("<HBQ", rank, 10, offset)
    return b"tensor_file\0" + struct.pack("<2BI", 1, 0, fields) + entry + struct.pack("<Q", size)


_LAUGHS = "".join(f'<!ENTITY l{n + 1} "{f"&l{n};" * 10}">' for n in range(9))
_BILLION = f'<!DOCTYPE x [<!ENTITY l0 "lol">{_LAUGHS}]>'
_OUTSIDE = '<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
_END = b"</scene>"
_SCENE_DEEP = (
    b'<scene version="3.0.0">' + b'<bsdf type="a">' * (DEEP // 2) + b"</bsdf>" * (DEEP // 2) + _END
)
_MATERIAL = '<materialx version="1.39"><a b="{}"/></materialx>'


def _png_of_one_color(edge: int) -> bytes:
    """A whole picture of many pixels in few bytes."""
    rows = zlib.compress(bytes(1 + 3 * 4), 9)
    data = png_bytes(np.zeros((4, 4, 3), np.uint8), edge, edge)
    return data[: data.index(b"IDAT")] + b"IDAT" + rows + data[-12:]


def _glb(text: bytes, length: int | None = None) -> bytes:
    chunk = struct.pack("<II", len(text) if length is None else length, 0x4E4F534A) + text
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk


def _list(name: str) -> Callable[[], dict[str, bytes]]:
    """A folder of photographs whose list names one elsewhere."""
    rows = f"file,theta_l,phi_l,theta_v,phi_v\n{name},0,0,0,0\n"
    picture = png_bytes(np.zeros((4, 4, 3), np.uint8), 4, 4)
    return lambda: {"cloth/directions.csv": rows.encode(), "secret.png": picture}


def _codec_elsewhere() -> dict[str, bytes]:
    header = {
        "version": 1,
        "name": "a",
        "codec": {"file": "../secret", "sha256": "0" * 64},
        "metadata": {},
    }
    directions = np.array([[0.0, 0.0, 1.0]], "<f4")
    tensors = {"codes": np.zeros((1, 1, 2), "<f4"), "lights": directions, "views": directions}
    return {"a.safetensors": safetensors_bytes(tensors, header, None, "nacre latent map")}


def _claimed_end() -> dict[str, bytes]:
    data = SPECIMENS["NBRDF network (Keras)"].files()[0]
    return {"a.h5": data[:40] + struct.pack("<Q", 2**62) + data[48:200]}


def _outside_weights() -> dict[str, bytes]:
    """Weights that HDF5 would take from another file, which is there."""
    import h5py

    other, stream = io.BytesIO(), io.BytesIO()
    with h5py.File(other, "w") as file:
        file["w"] = np.zeros((6, 3), "<f4")
    with h5py.File(stream, "w") as file:
        file.attrs["layer_names"] = np.array(["a"], "S")
        group = file.create_group("a")
        group.attrs["weight_names"] = np.array(["w", "b"], "S")
        group["w"] = h5py.ExternalLink("h5-outside/other.h5", "/w")
        group["b"] = np.zeros(3, "<f4")
    return {"a.h5": stream.getvalue(), "other.h5": other.getvalue()}


def _packed_weights() -> dict[str, bytes]:
    """Weights of a terabyte of zeros, none of which is in the file."""
    import h5py

    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file.attrs["layer_names"] = np.array(["a"], "S")
        group = file.create_group("a")
        group.attrs["weight_names"] = np.array(["w", "b"], "S")
        group.create_dataset("w", (1 << 19, 1 << 19), "<f4", chunks=(64, 64), compression="gzip")
        group["b"] = np.zeros(3, "<f4")
    return {"a.h5": stream.getvalue()}


def _strings(offset: int, value: bytes) -> dict[str, bytes]:
    """Weights with names of variable length, and some bytes beside their heap overwritten."""
    import h5py

    stream, kind = io.BytesIO(), h5py.string_dtype()
    with h5py.File(stream, "w") as file:
        file.attrs.create("layer_names", np.array(["a"], object), dtype=kind)
        file.create_group("a").attrs.create("weight_names", np.array([], object), dtype=kind)
    data = bytearray(stream.getvalue())
    heap = data.index(b"GCOL")
    start = heap + 16 if offset > 0 else data.index(struct.pack("<Q", heap))
    data[start + offset : start + offset + len(value)] = value
    return {"a.h5": bytes(data)}


_HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"
_PACKED_ROW = b"\2\2\0\x08" + b"\x88\x80" * 4
_SCENE = ("render",), ("-o", "out.exr", "--spp", "1")
_LIT = ("view", "paint.json", "--environment"), ("-o", "out.html")

ATTACKS = {
    "merl-sizes": Attack(
        "claims three billion values in a header of three numbers",
        _one("a.binary", struct.pack("<3i", 1024, 1024, 1024) + bytes(64)),
        "a.binary",
    ),
    "merl-negative": Attack(
        "claims sizes whose product is positive by two minus signs",
        _one("a.binary", struct.pack("<3i", -90, -90, 180) + bytes(64)),
        "a.binary",
    ),
    "merl-overflow": Attack(
        "claims 2^32 values, which is 0 in 32 bits",
        _one("a.binary", struct.pack("<3i", 1 << 16, 1 << 16, 1)),
        "a.binary",
    ),
    "rgl-fields": Attack(
        "claims four billion fields",
        _one("a.bsdf", _rgl(fields=2**32 - 1)),
        "fields, expected",
    ),
    "rgl-size": Attack(
        "claims a field larger than any memory",
        _one("a.bsdf", _rgl(size=2**62)),
        "reach past the end",
    ),
    "rgl-offset": Attack(
        "points to data before the file by an offset that wraps around",
        _one("a.bsdf", _rgl(offset=2**64 - 8, size=1)),
        "reach past the end",
    ),
    "rgl-rank": Attack(
        "claims an array of 65,535 dimensions",
        _one("a.bsdf", _rgl(rank=65535)),
        "dimensions",
    ),
    "mbsdf-grid": Attack(
        "claims a grid of 2^96 directions",
        _one(
            "a.mbsdf",
            b"NVIDIA ARC MBSDF V1\nMBSDF_DATA_REFLECTION=\n"
            + struct.pack("<3I", 1, *[2**32 - 1] * 2),
        ),
        "header gives",
    ),
    "mbsdf-escape": Attack(
        "writes to the terminal by a line of text",
        _one("a.mbsdf", b"NVIDIA ARC MBSDF V1\n\x1b]0;owned\x07\n"),
        "not printable ASCII",
    ),
    "safetensors-header": Attack(
        "claims a header of 2^63 bytes",
        _one("a.safetensors", struct.pack("<Q", 2**63) + b'{"__metadata__":{"nacre":"{}"}}'),
        "safetensors",
    ),
    "safetensors-deep": Attack(
        "nests its header until a parser's stack ends",
        _one("a.safetensors", _tensors({"__metadata__": {"nacre": "[" * DEEP + "]" * DEEP}})),
        "safetensors file, but not",
    ),
    "safetensors-overlap": Attack(
        "claims a thousand times its bytes by tensors that lie on one another",
        _one(
            "a.safetensors",
            _tensors(
                {"__metadata__": {"nacre": "{}"}}
                | {
                    f"t{n}": {"dtype": "F32", "shape": [64], "data_offsets": [0, 256]}
                    for n in range(200)
                },
                bytes(256),
            ),
        ),
        "safetensors file",
    ),
    "codec-elsewhere": Attack(
        "has a file outside of its folder read as a codec",
        _codec_elsewhere,
        "is no name of a file",
    ),
    "npz-pickle": Attack(
        "runs a function from a pickled array",
        lambda: {"a.npz": npz_bytes(_pickled())},
        "header is damaged|of type object",
    ),
    "npy-pickle": Attack(
        "the same, in an array of its own",
        lambda: {"a.npy": _pickled()},
        "header is damaged|of type object|expected a name like",
    ),
    "pickle-by-name": Attack(
        "is a pickle under the name of a network",
        _one("a.safetensors", pickle.dumps(_Payload())),
        "no known format",
    ),
    "npz-deflated": Attack(
        "unpacks to a thousand times its bytes",
        lambda: {"a.npz": _bomb(zipfile.ZIP_DEFLATED)},
        "larger than any table",
    ),
    "npz-bzip2": Attack(
        "unpacks to many thousand times its bytes, by another method",
        lambda: {"a.npz": _bomb(zipfile.ZIP_BZIP2)},
        "larger than any table|packed in an unusual way",
    ),
    "npz-lying": Attack(
        "says in its list that it is small",
        lambda: {"a.npz": _lying_zip()},
        "another length|damaged",
    ),
    "npy-shape": Attack(
        "claims an array larger than any memory",
        lambda: {"a.npz": npz_bytes(_claimed_npy((2**31, 2**31, 2, 3)))},
        "bytes follow",
    ),
    "npy-code": Attack(
        "has a header that is an expression to evaluate",
        lambda: {
            "a.npz": npz_bytes(
                b"\x93NUMPY\1\0\x30\0__import__('os').system('echo owned')".ljust(99)
            )
        },
        "header is damaged",
    ),
    "h5-outside": Attack(
        "has weights in a file elsewhere on the disk", _outside_weights, "not a whole Keras"
    ),
    "h5-packed": Attack(
        "claims a terabyte of packed weights", _packed_weights, "not stored whole and plain"
    ),
    "h5-end": Attack(
        "claims that the file ends beyond its end",
        _claimed_end,
        "not a whole Keras",
    ),
    "h5-endless": Attack(
        "has a name of no length, in whose heap HDF5 never comes to an end",
        lambda: _strings(8, struct.pack("<Q", 2**64 - 16)),
        "heap of strings is damaged",
    ),
    "h5-names": Attack(
        "claims a name of four gigabytes, which HDF5 takes before it looks for it",
        lambda: _strings(-4, struct.pack("<I", 2**32 - 1)),
        "heap of strings is damaged",
    ),
    "exr-window": Attack(
        "claims 10^18 pixels in the table of an image",
        lambda: {
            "a.exr": SPECIMENS["UTIA image (.exr)"]
            .files()[0]
            .replace(
                struct.pack("<4i", 0, 0, 287, 287), struct.pack("<4i", 0, 0, HUGE - 1, HUGE - 1)
            )[:4096]
        },
        "a.exr",
    ),
    "exr-left": Attack(
        "begins left of its frame, where Mitsuba writes before its pixels, with blocks elsewhere",
        lambda: {
            "a.exr": SPECIMENS["UTIA image (.exr)"]
            .files()[0]
            .replace(struct.pack("<4i", 0, 0, 287, 287), struct.pack("<4i", -9, -1, 278, 286))[
                :4096
            ]
        },
        "begins left of or above its frame",
        _LIT,
    ),
    "png-size": Attack(
        "claims 3.6 billion pixels of light",
        lambda: {"a.png": _png_of_one_color(60_000)},
        "more than 67,108,864 pixels",
        _LIT,
    ),
    "hdr-size": Attack(
        "claims 3.6 billion pixels of light behind a line that claims few",
        _one("a.hdr", _HDR + b"# -Y 4 +X 4\n\n-Y 60000 +X 60000\n" + bytes(64)),
        "more than 67,108,864 pixels",
        _LIT,
    ),
    "hdr-decoy": Attack(
        "claims 3.6 billion pixels in the line that Mitsuba reads, and few in the next",
        _one("a.hdr", _HDR + b"\n -Y 60000 +X 60000\n-Y 4 +X 8\n" + bytes(128)),
        "is not an OpenEXR, Radiance",
        _LIT,
    ),
    "hdr-rows": Attack(
        "has plain rows after packed ones, which Mitsuba writes beyond the end of its pixels",
        _one("a.hdr", _HDR + b"\n-Y 4 +X 8\n" + _PACKED_ROW + bytes(128)),
        "some of its rows are packed",
        _LIT,
    ),
    "csv-name": Attack(
        "writes to the terminal by the name of a column",
        _one(
            "a.csv",
            b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b,\x1b[2J\n0,0,0,0,1,1,1,1\n",
        ),
        "column",
    ),
    "csv-line": Attack(
        "has one line of a hundred thousand cells",
        _one("a.csv", b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b\n" + b"0," * 100_000),
        "longer than 65536",
    ),
    "csv-numbers": Attack(
        "has numbers that are read as infinite",
        _one("a.csv", b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1e999,1,1\n"),
        "line 3",
    ),
    "cornell-bands": Attack(
        "claims a billion wavelengths",
        _one("a.brdf", b"# paint\n1000000000\n400 500 600\n"),
        "number of bands",
    ),
    "scene-laughs": Attack(
        "expands entities to three billion letters in a scene",
        _one("a.xml", f'{_BILLION}<scene version="3.0.0">&l9;</scene>'.encode()),
        "DOCTYPE",
        _SCENE,
    ),
    "scene-outside": Attack(
        "has a file of the system read as a part of a scene",
        _one("a.xml", f'{_OUTSIDE}<scene version="3.0.0">&f;</scene>'.encode()),
        "DOCTYPE",
        _SCENE,
    ),
    "scene-deep": Attack(
        "nests elements until the stack of Mitsuba's parser ends",
        _one("a.xml", _SCENE_DEEP),
        "lies within 64 others",
        _SCENE,
    ),
    "scene-deep-elsewhere": Attack(
        "has another file do the same",
        lambda: {
            "a.xml": b'<scene version="3.0.0"><include filename="b.xml"/>' + _END,
            "b.xml": _SCENE_DEEP,
        },
        "lies within 64 others",
        _SCENE,
    ),
    "scene-includes": Attack(
        "makes 10 to the power of 14 elements of fourteen files, each in the one before ten times",
        lambda: (
            {
                f"{name}.xml": b'<scene version="3.0.0">'
                + f'<include filename="{other}.xml"/>'.encode() * 10
                + _END
                for name, other in pairwise("abcdefghijklmno")
            }
            | {"o.xml": b'<scene version="3.0.0"><bsdf type="diffuse"/>' + _END}
        ),
        "more than 1,000,000 elements",
        _SCENE,
    ),
    "materialx-laughs": Attack(
        "expands entities to three billion letters in a material",
        _one("a.mtlx", (_BILLION + _MATERIAL.format("&l9;")).encode()),
        "DOCTYPE",
    ),
    "materialx-outside": Attack(
        "has a file of the system read as a value",
        _one("a.mtlx", (_OUTSIDE + _MATERIAL.format("&f;")).encode()),
        "DOCTYPE",
    ),
    "radiance-laughs": Attack(
        "expands entities in a table of tensor trees",
        _one("a.xml", f"{_BILLION}<WindowElement>&l9;</WindowElement>".encode()),
        "document type",
    ),
    "gltf-deep": Attack(
        "nests JSON until a parser's stack ends",
        _one("a.glb", _glb(b'{"asset":{"version":"2.0"},"materials":' + b"[" * DEEP)),
        "not whole JSON",
    ),
    "gltf-length": Attack(
        "claims a chunk of four gigabytes",
        _one("a.glb", _glb(b'{"asset":{"version":"2.0"}}', 2**32 - 4)),
        "a.glb",
    ),
    "json-deep": Attack(
        "nests the parameters of a model until a parser's stack ends",
        _one("a.json", b'{"model":"ggx","parameters":' + b"[" * DEEP),
        "not whole JSON",
    ),
    "json-digits": Attack(
        "has a number of ten thousand digits, which takes quadratic time to read",
        _one("a.json", b'{"model":"ggx","parameters":{"roughness":' + b"9" * 10_000 + b"}}"),
        "not whole JSON",
    ),
    "bsdf-digits": Attack(
        "describes a BSDF with a number of ten thousand digits",
        _one("a.json", b'{"type":"plastic","int_ior":' + b"9" * 10_000 + b"}"),
        "cannot be read",
        (("measure", "bsdf"), ("-o", "out.binary")),
    ),
    "code-name": Attack(
        "writes to the terminal by the name of a model",
        _one("a.json", json.dumps({"model": "\x1b[2Jx\n", "parameters": {}}).encode()),
        "is not one of",
    ),
    "list-outside": Attack(
        "lists a photograph outside of its folder",
        _list("../secret.png"),
        "no path within the folder",
    ),
    "list-absolute": Attack(
        "lists a photograph by an absolute path",
        _list("/etc/passwd"),
        "no path within the folder",
    ),
    "archive-gzip": Attack(
        "is packed as a whole, so that looking at it unpacks it",
        lambda: {"a.binary": gzip.compress(bytes(ZEROS))},
        "a.binary",
    ),
}
"""Every attack by name."""
