"""Contents of files that lie, swell or nest, as attacks and their helpers make them."""

from __future__ import annotations

import io
import json
import lzma
import struct
import zipfile
import zlib
from collections.abc import Callable
from functools import cache

import numpy as np
import numpy.lib.format as npy

from tests.packing import zipped
from tests.specimens import SPECIMENS
from tests.specimens.images import png_bytes
from tests.specimens.networks import safetensors_bytes
from tests.specimens.tables import npz_bytes

HUGE = 2**31 - 1
DEEP = 20_000
ZEROS = 80 << 20
"""Bytes that a bomb unpacks to."""


def one(name: str, content: bytes) -> Callable[[], dict[str, bytes]]:
    return lambda: {name: content}


class Payload:
    """What a pickle would run."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return print, ("PICKLE WAS RUN",)


def pickled() -> bytes:
    array = np.empty((1, 1, 1, 3), object)
    array[...] = Payload()
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def claimed_npy(shape: tuple[int, ...]) -> bytes:
    stream = io.BytesIO()
    npy.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue() + bytes(64)


@cache
def bomb(method: int) -> bytes:
    """An archive of one array of zeros, of which each byte stands for many."""
    return npz_bytes(claimed_npy((90, 90, 180, 3)) + bytes(ZEROS), method=method)


def lying_zip(name: str = "") -> bytes:
    """Its list says that an array, or a named file, is small; its stream goes on without end."""
    data = bytearray(zipped({name: bytes(ZEROS)}) if name else bomb(zipfile.ZIP_DEFLATED))
    for signature, place in ((b"PK\1\2", 24), (b"PK\3\4", 22)):
        start = data.index(signature) + place
        data[start : start + 4] = struct.pack("<I", 400)
    return bytes(data)


def tensors(header: object, data: bytes = b"") -> bytes:
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def rgl(fields: int = 1, rank: int = 1, offset: int = 0, size: int = HUGE) -> bytes:
    entry = struct.pack("<H", 3) + b"rgb" + struct.pack("<HBQ", rank, 10, offset)
    return b"tensor_file\0" + struct.pack("<2BI", 1, 0, fields) + entry + struct.pack("<Q", size)


@cache
def zeros(pack: Callable[[bytes], bytes]) -> bytes:
    """Packed zeros, of which each byte stands for many."""
    return pack(bytes(ZEROS))


def xz_of_all_memory() -> bytes:
    """A stream whose header asks for a dictionary of four gigabytes."""
    data = bytearray(lzma.compress(bytes(100)))
    size = 4 * (data[12] + 1)
    data[12 + data[12:].index(b"\x21\x01") + 2] = 40
    data[12 + size - 4 : 12 + size] = struct.pack("<I", zlib.crc32(data[12 : 12 + size - 4]))
    return bytes(data)


LAUGHS = "".join(f'<!ENTITY l{n + 1} "{f"&l{n};" * 10}">' for n in range(9))
BILLION = f'<!DOCTYPE x [<!ENTITY l0 "lol">{LAUGHS}]>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY f SYSTEM "file:///etc/passwd">]>'
END = b"</scene>"
SCENE_DEEP = (
    b'<scene version="3.0.0">' + b'<bsdf type="a">' * (DEEP // 2) + b"</bsdf>" * (DEEP // 2) + END
)
MATERIAL = '<materialx version="1.39"><a b="{}"/></materialx>'
_DOUBLED = (
    '<nodedef name="N{0}" node="n{0}"><output name="out" type="float"/></nodedef>'
    '<nodegraph name="G{0}" nodedef="N{0}">'
    '<n{1} name="a" type="float"/><n{1} name="b" type="float"/>'
    '<add name="c" type="float"><input name="in1" type="float" nodename="a"/>'
    '<input name="in2" type="float" nodename="b"/></add>'
    '<output name="out" type="float" nodename="c"/></nodegraph>'
)
TOWER = (
    '<materialx version="1.39">'
    + "".join(_DOUBLED.format(k, k + 1) for k in range(25))
    + '<nodedef name="N25" node="n25"><output name="out" type="float"/></nodedef>'
    '<nodegraph name="G25" nodedef="N25"><output name="out" type="float" value="0"/></nodegraph>'
    '<n0 name="x" type="float"/><open_pbr_surface name="s" type="surfaceshader">'
    '<input name="base_weight" type="float" nodename="x"/></open_pbr_surface></materialx>'
)


def png_of_one_color(edge: int) -> bytes:
    """A whole picture of many pixels in few bytes."""
    rows = zlib.compress(bytes(1 + 3 * 4), 9)
    data = png_bytes(np.zeros((4, 4, 3), np.uint8), edge, edge)
    return data[: data.index(b"IDAT")] + b"IDAT" + rows + data[-12:]


def glb(text: bytes, length: int | None = None) -> bytes:
    chunk = struct.pack("<II", len(text) if length is None else length, 0x4E4F534A) + text
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunk)) + chunk


def photograph_list(name: str) -> Callable[[], dict[str, bytes]]:
    """A folder of photographs whose list names one elsewhere."""
    rows = f"file,theta_l,phi_l,theta_v,phi_v\n{name},0,0,0,0\n"
    picture = png_bytes(np.zeros((4, 4, 3), np.uint8), 4, 4)
    return lambda: {"cloth/directions.csv": rows.encode(), "secret.png": picture}


def codec_elsewhere() -> dict[str, bytes]:
    header = {
        "version": 1,
        "name": "a",
        "codec": {"file": "../secret", "sha256": "0" * 64},
        "metadata": {},
    }
    directions = np.array([[0.0, 0.0, 1.0]], "<f4")
    tensors = {"codes": np.zeros((1, 1, 2), "<f4"), "lights": directions, "views": directions}
    return {"a.safetensors": safetensors_bytes(tensors, header, None, "nacre latent map")}


def claimed_end() -> dict[str, bytes]:
    data = SPECIMENS["NBRDF network (Keras)"].files()[0]
    return {"a.h5": data[:40] + struct.pack("<Q", 2**62) + data[48:200]}


def outside_weights() -> dict[str, bytes]:
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


def packed_weights() -> dict[str, bytes]:
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


def strings(offset: int, value: bytes) -> dict[str, bytes]:
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


HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"
PACKED_ROW = b"\2\2\0\x08" + b"\x88\x80" * 4
