"""The attacks: a line on what each tries, the command that a victim would type, and the files."""

from __future__ import annotations

import bz2
import gzip
import json
import pickle
import struct
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from tests.attacks.contents import (
    BILLION,
    DEEP,
    END,
    HDR,
    HUGE,
    MATERIAL,
    OUTSIDE,
    PACKED_ROW,
    SCENE_DEEP,
    TOWER,
    ZEROS,
    Payload,
    bomb,
    claimed_end,
    claimed_npy,
    codec_elsewhere,
    glb,
    lying_zip,
    one,
    outside_weights,
    packed_weights,
    photograph_list,
    pickled,
    png_of_one_color,
    rgl,
    strings,
    tensors,
    xz_of_all_memory,
    zeros,
)
from tests.packing import zipped
from tests.specimens import SPECIMENS
from tests.specimens.tables import npz_bytes


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


_SCENE = ("render",), ("-o", "out.exr", "--spp", "1")
_LIT = ("view", "paint.json", "--environment"), ("-o", "out.html")

ATTACKS = {
    "merl-sizes": Attack(
        "claims three billion values in a header of three numbers",
        one("a.binary", struct.pack("<3i", 1024, 1024, 1024) + bytes(64)),
        "a.binary",
    ),
    "merl-negative": Attack(
        "claims sizes whose product is positive by two minus signs",
        one("a.binary", struct.pack("<3i", -90, -90, 180) + bytes(64)),
        "a.binary",
    ),
    "merl-overflow": Attack(
        "claims 2^32 values, which is 0 in 32 bits",
        one("a.binary", struct.pack("<3i", 1 << 16, 1 << 16, 1)),
        "a.binary",
    ),
    "rgl-fields": Attack(
        "claims four billion fields",
        one("a.bsdf", rgl(fields=2**32 - 1)),
        "fields, expected",
    ),
    "rgl-size": Attack(
        "claims a field larger than any memory",
        one("a.bsdf", rgl(size=2**62)),
        "reach past the end",
    ),
    "rgl-offset": Attack(
        "points to data before the file by an offset that wraps around",
        one("a.bsdf", rgl(offset=2**64 - 8, size=1)),
        "reach past the end",
    ),
    "rgl-rank": Attack(
        "claims an array of 65,535 dimensions",
        one("a.bsdf", rgl(rank=65535)),
        "dimensions",
    ),
    "mbsdf-grid": Attack(
        "claims a grid of 2^96 directions",
        one(
            "a.mbsdf",
            b"NVIDIA ARC MBSDF V1\nMBSDF_DATA_REFLECTION=\n"
            + struct.pack("<3I", 1, *[2**32 - 1] * 2),
        ),
        "header gives",
    ),
    "mbsdf-escape": Attack(
        "writes to the terminal by a line of text",
        one("a.mbsdf", b"NVIDIA ARC MBSDF V1\n\x1b]0;owned\x07\n"),
        "not printable ASCII",
    ),
    "safetensors-header": Attack(
        "claims a header of 2^63 bytes",
        one("a.safetensors", struct.pack("<Q", 2**63) + b'{"__metadata__":{"nacre":"{}"}}'),
        "safetensors",
    ),
    "safetensors-deep": Attack(
        "nests its header until a parser's stack ends",
        one("a.safetensors", tensors({"__metadata__": {"nacre": "[" * DEEP + "]" * DEEP}})),
        "safetensors file, but not",
    ),
    "safetensors-overlap": Attack(
        "claims a thousand times its bytes by tensors that lie on one another",
        one(
            "a.safetensors",
            tensors(
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
        codec_elsewhere,
        "is not the name of a file",
    ),
    "npz-pickle": Attack(
        "runs a function from a pickled array",
        lambda: {"a.npz": npz_bytes(pickled())},
        "header is damaged|of type object",
    ),
    "npy-pickle": Attack(
        "the same, in an array of its own",
        lambda: {"a.npy": pickled()},
        "header is damaged|of type object|expected a name like",
    ),
    "pickle-by-name": Attack(
        "is a pickle under the name of a network",
        one("a.safetensors", pickle.dumps(Payload())),
        "is a Python pickle, which would run code",
    ),
    "npz-deflated": Attack(
        "unpacks to a thousand times its bytes",
        lambda: {"a.npz": bomb(zipfile.ZIP_DEFLATED)},
        "larger than any table",
    ),
    "npz-bzip2": Attack(
        "unpacks to many thousand times its bytes, by another method",
        lambda: {"a.npz": bomb(zipfile.ZIP_BZIP2)},
        "larger than any table|packed in an unusual way",
    ),
    "npz-lying": Attack(
        "says in its list that it is small",
        lambda: {"a.npz": lying_zip()},
        "the length that the archive says|damaged",
    ),
    "npy-shape": Attack(
        "claims an array larger than any memory",
        lambda: {"a.npz": npz_bytes(claimed_npy((2**31, 2**31, 2, 3)))},
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
        "has weights in a file elsewhere on the disk", outside_weights, "not a whole Keras"
    ),
    "h5-packed": Attack(
        "claims a terabyte of packed weights", packed_weights, "not stored whole and plain"
    ),
    "h5-end": Attack(
        "claims that the file ends beyond its end",
        claimed_end,
        "not a whole Keras",
    ),
    "h5-endless": Attack(
        "has a name of no length, in whose heap HDF5 never comes to an end",
        lambda: strings(8, struct.pack("<Q", 2**64 - 16)),
        "heap of strings is damaged",
    ),
    "h5-names": Attack(
        "claims a name of four gigabytes, which HDF5 takes before it looks for it",
        lambda: strings(-4, struct.pack("<I", 2**32 - 1)),
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
        lambda: {"a.png": png_of_one_color(60_000)},
        "more than 67,108,864 pixels",
        _LIT,
    ),
    "hdr-size": Attack(
        "claims 3.6 billion pixels of light behind a line that claims few",
        one("a.hdr", HDR + b"# -Y 4 +X 4\n\n-Y 60000 +X 60000\n" + bytes(64)),
        "more than 67,108,864 pixels",
        _LIT,
    ),
    "hdr-decoy": Attack(
        "claims 3.6 billion pixels in the line that Mitsuba reads, and few in the next",
        one("a.hdr", HDR + b"\n -Y 60000 +X 60000\n-Y 4 +X 8\n" + bytes(128)),
        "is not an OpenEXR, Radiance",
        _LIT,
    ),
    "hdr-rows": Attack(
        "has plain rows after packed ones, which Mitsuba writes beyond the end of its pixels",
        one("a.hdr", HDR + b"\n-Y 4 +X 8\n" + PACKED_ROW + bytes(128)),
        "some of its rows are packed",
        _LIT,
    ),
    "csv-name": Attack(
        "writes to the terminal by the name of a column",
        one(
            "a.csv",
            b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b,\x1b[2J\n0,0,0,0,1,1,1,1\n",
        ),
        "column",
    ),
    "csv-line": Attack(
        "has one line of a hundred thousand cells",
        one("a.csv", b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b\n" + b"0," * 100_000),
        "longer than 65536",
    ),
    "csv-numbers": Attack(
        "has numbers that are read as infinite",
        one("a.csv", b"# units: degrees\ntheta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1e999,1,1\n"),
        "line 3",
    ),
    "cornell-bands": Attack(
        "claims a billion wavelengths",
        one("a.brdf", b"# Cornell, paint\n1000000000\n400 500 600\n"),
        "number of bands",
    ),
    "scene-laughs": Attack(
        "expands entities to three billion letters in a scene",
        one("a.xml", f'{BILLION}<scene version="3.0.0">&l9;</scene>'.encode()),
        "DOCTYPE",
        _SCENE,
    ),
    "scene-outside": Attack(
        "has a file of the system read as a part of a scene",
        one("a.xml", f'{OUTSIDE}<scene version="3.0.0">&f;</scene>'.encode()),
        "DOCTYPE",
        _SCENE,
    ),
    "scene-deep": Attack(
        "nests elements until the stack of Mitsuba's parser ends",
        one("a.xml", SCENE_DEEP),
        "lies within 64 others",
        _SCENE,
    ),
    "scene-deep-elsewhere": Attack(
        "has another file do the same",
        lambda: {
            "a.xml": b'<scene version="3.0.0"><include filename="b.xml"/>' + END,
            "b.xml": SCENE_DEEP,
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
                + END
                for name, other in pairwise("abcdefghijklmno")
            }
            | {"o.xml": b'<scene version="3.0.0"><bsdf type="diffuse"/>' + END}
        ),
        "more than 1,000,000 elements",
        _SCENE,
    ),
    "materialx-laughs": Attack(
        "expands entities to three billion letters in a material",
        one("a.mtlx", (BILLION + MATERIAL.format("&l9;")).encode()),
        "DOCTYPE",
    ),
    "materialx-outside": Attack(
        "has a file of the system read as a value",
        one("a.mtlx", (OUTSIDE + MATERIAL.format("&f;")).encode()),
        "DOCTYPE",
    ),
    "materialx-tower": Attack(
        "computes 2 to the power of 25 nodes from 25, each of which is twice the next",
        one("a.mtlx", TOWER.encode()),
        "steps to compute",
    ),
    "radiance-laughs": Attack(
        "expands entities in a table of tensor trees",
        one("a.xml", f"{BILLION}<WindowElement>&l9;</WindowElement>".encode()),
        "document type",
    ),
    "gltf-deep": Attack(
        "nests JSON until a parser's stack ends",
        one("a.glb", glb(b'{"asset":{"version":"2.0"},"materials":' + b"[" * DEEP)),
        "not whole JSON",
    ),
    "gltf-length": Attack(
        "claims a chunk of four gigabytes",
        one("a.glb", glb(b'{"asset":{"version":"2.0"}}', 2**32 - 4)),
        "a.glb",
    ),
    "json-deep": Attack(
        "nests the parameters of a model until a parser's stack ends",
        one("a.json", b'{"model":"ggx","parameters":' + b"[" * DEEP),
        "not whole JSON",
    ),
    "json-digits": Attack(
        "has a number of ten thousand digits, which takes quadratic time to read",
        one("a.json", b'{"model":"ggx","parameters":{"roughness":' + b"9" * 10_000 + b"}}"),
        "not whole JSON",
    ),
    "bsdf-digits": Attack(
        "describes a BSDF with a number of ten thousand digits",
        one("a.json", b'{"type":"plastic","int_ior":' + b"9" * 10_000 + b"}"),
        "cannot be read",
        (("measure", "bsdf"), ("-o", "out.binary")),
    ),
    "code-name": Attack(
        "writes to the terminal by the name of a model",
        one("a.json", json.dumps({"model": "\x1b[2Jx\n", "parameters": {}}).encode()),
        "is no known analytic model",
    ),
    "list-outside": Attack(
        "lists a photograph outside of its folder",
        photograph_list("../secret.png"),
        "not a path within the folder",
    ),
    "list-absolute": Attack(
        "lists a photograph by an absolute path",
        photograph_list("/etc/passwd"),
        "not a path within the folder",
    ),
    "archive-gzip": Attack(
        "is packed as a whole, so that looking at it unpacks it",
        lambda: {"a.binary": zeros(gzip.compress)},
        "unpacks to more than",
    ),
    "archive-bzip2": Attack(
        "unpacks to a million times its bytes",
        lambda: {"a.binary.bz2": zeros(bz2.compress)},
        "unpacks to more than",
    ),
    "archive-zip": Attack(
        "unpacks to a thousand times its bytes, from an archive that says that it is small",
        lambda: {"a.zip": lying_zip("a.binary")},
        "damaged|unpacks to more than",
    ),
    "archive-sum": Attack(
        "holds two files, neither of which is too large by itself",
        lambda: {"a.zip": zipped({f"{k}.binary": bytes(ZEROS // 2) for k in range(2)})},
        "unpacks to more than",
    ),
    "archive-memory": Attack(
        "claims to need four gigabytes to be unpacked",
        lambda: {"a.binary.xz": xz_of_all_memory()},
        "too much memory",
    ),
    "archive-names": Attack(
        "holds two thousand files of no length",
        lambda: {"a.zip": zipped({f"{k}.csv": b"" for k in range(2000)})},
        "is an archive of 2000 files",
    ),
    "archive-escape": Attack(
        "writes to the terminal by a name in an archive",
        lambda: {"a.zip": zipped({"\x1b]0;owned\x07\n": b"", "b": b""})},
        "is an archive of 2 files",
    ),
    "archive-outside": Attack(
        "is put outside of its folder by its name",
        lambda: {"a.zip": zipped({"../../out.binary": b"a"})},
        "no known format",
    ),
    "page-comments": Attack(
        "begins with a thousand comments, as a pattern that is tried in all ways would meet",
        one("a.bsdf", b"<!---->" * 140 + b"<!"),
        "no known format",
    ),
}
"""Every attack by name."""
