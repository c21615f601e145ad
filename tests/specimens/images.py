"""Small images of 288 x 288 pixels, as UTIA tables."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from random import Random

import numpy as np

from tests.specimens.specimen import NUMBERS, Array, Specimen, odd_array, packed, replaced

_EDGE = 288


def png_bytes(pixels: Array, width: int = _EDGE, height: int = _EDGE) -> bytes:
    """A PNG image of 8 or 16 bits a channel (ISO/IEC 15948), without filters."""
    bits, channels = 8 * pixels.dtype.itemsize, pixels.shape[2]
    header = struct.pack(">2I5B", width, height, bits, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return _png_of(header, _png_rows(pixels))


def _png_rows(pixels: Array) -> bytes:
    return b"".join(b"\0" + row.astype(f">u{pixels.dtype.itemsize}").tobytes() for row in pixels)


def _png_of(header: bytes, rows: bytes, *others: tuple[bytes, bytes]) -> bytes:
    chunks = ((b"IHDR", header), *others, (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _ramp(channels: int = 3, dtype: str = "u1") -> Array:
    """Pixels that pack well."""
    row = np.arange(_EDGE, dtype=dtype) // 2
    return np.broadcast_to(row[:, None], (_EDGE, _EDGE, channels))


def _png_sized(count: int) -> Iterable[bytes]:
    for place in range(2):
        size = [_EDGE, _EDGE]
        size[place] = count % 2**32
        yield png_bytes(_ramp(), *size)


def _png_rebuilt(_: bytes, random: Random) -> bytes:
    """Checksums are right; the header may lie, and rows may be damaged, missing or too many."""
    dtype, channels = random.choice(("u1", "u2")), random.choice((1, 3, 3, 4))
    rows = _png_rows(_ramp(channels, dtype))
    color, bits = {1: 0, 3: 2, 4: 6}[channels], 8 * np.dtype(dtype).itemsize
    fields = [_EDGE, _EDGE, bits, color, 0, 0, 0]
    if random.random() < 0.3:
        fields[random.randrange(2, 7)] = random.choice((0, 1, 2, 3, 4, 6, 8, 16, 255))
    choice = random.random()
    if choice < 0.3:
        rows = rows[: random.randrange(len(rows))]
    elif choice < 0.4:
        rows += rows * random.randint(1, 8)
    elif choice < 0.7:
        for place in random.choices(range(len(rows)), k=8):
            rows = replaced(rows, place, random.randbytes(1))
    kinds = (b"PLTE", b"tRNS", b"gAMA", b"sRGB", b"tEXt", b"iCCP", b"IHDR", b"IEND", b"XXXX")
    others = [
        (random.choice(kinds), random.randbytes(random.choice((0, 1, 3, 6, 13, 256, 768))))
        for _ in range(random.choice((0, 0, 1, 2)))
    ]
    return _png_of(struct.pack(">2I5B", *fields), rows, *others)


# OpenEXR, as its "Technical Introduction" and "File Layout" describe it

_BOX = struct.pack("<4i", 0, 0, _EDGE - 1, _EDGE - 1)
_TYPES = {"u4": 0, "f2": 1, "f4": 2}
_ZIP, _ROWS = 3, 16
"""The compression with zlib, and how many rows it packs at once."""


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value


def _zipped(raw: bytes) -> bytes:
    """Even bytes, then odd ones, as differences, and zlib; or as they are where that is shorter."""
    split = np.frombuffer(raw[::2] + raw[1::2], np.uint8)
    steps = np.append(split[:1], np.diff(split) + np.uint8(128))
    packed_rows = zlib.compress(steps.tobytes(), 1)
    return packed_rows if len(packed_rows) < len(raw) else raw


def exr_bytes(
    channels: Mapping[str, Array], attributes: Mapping[str, bytes] | None = None
) -> bytes:
    """An OpenEXR image in scan lines.

    Parameters
    ----------
    channels
        Pixels (288, 288) of each, of the types uint32, float16 or float32.
    attributes
        Bytes of header attributes that are to be replaced.
    """
    names = sorted(channels)
    listed = b"".join(
        f"{name}\0".encode() + struct.pack("<4I", _TYPES[channels[name].dtype.str[1:]], 0, 1, 1)
        for name in names
    )
    header = {
        "channels": ("chlist", listed + b"\0"),
        "compression": ("compression", bytes([_ZIP])),
        "dataWindow": ("box2i", _BOX),
        "displayWindow": ("box2i", _BOX),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1.0)),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1.0)),
    }
    start = struct.pack("<2I", 20000630, 2)
    for name, (kind, value) in header.items():
        start += _attribute(name, kind, (attributes or {}).get(name, value))
    start += b"\0"
    blocks = []
    for row in range(0, _EDGE, _ROWS):
        lines = range(row, row + _ROWS)
        packed_rows = _zipped(b"".join(channels[n][y].tobytes() for y in lines for n in names))
        blocks.append(struct.pack("<2i", row, len(packed_rows)) + packed_rows)
    offsets, offset = b"", len(start) + 8 * len(blocks)
    for block in blocks:
        offsets += struct.pack("<Q", offset)
        offset += len(block)
    return start + offsets + b"".join(blocks)


def _planes(names: str = "RGB", dtype: str = "<f4", value: float = 0.5) -> dict[str, Array]:
    planes = {name: (_ramp(1)[..., 0] / 64).astype(dtype) for name in names}
    planes[names[0]][7, 9] = value
    return planes


def _exr_by_mitsuba() -> bytes:
    """The compression that nacre writes, PIZ."""
    import mitsuba as mi

    stream = mi.MemoryStream()
    image = np.stack(list(_planes().values()), axis=-1)
    mi.Bitmap(image).write(stream, mi.Bitmap.FileFormat.OpenEXR)
    return bytes(stream.raw_buffer())


def _exr_sized(count: int) -> Iterable[bytes]:
    for axis in (2, 3):
        yield exr_bytes(_planes(), {"dataWindow": replaced(_BOX, 4 * axis, packed(count, 4))})
    data = exr_bytes(_planes())
    yield replaced(data, data.index(b"box2i\0") + 6, packed(count, 4))


def _exr_rebuilt(_: bytes, random: Random) -> bytes:
    dtype = random.choice(("<f2", "<f4", "<f4", "<u4"))
    names = random.choice(("RGB", "RGB", "RGB", "RGBA", "RG", "Y", "RGBX"))
    planes = _planes(names, dtype if dtype != "<u4" else "<f4")
    for name in random.sample(names, 1):
        planes[name] = np.tile(odd_array(random, (1, _EDGE), "<f4"), (_EDGE, 1))  # packs well
    if dtype == "<u4":
        kept = {n: np.nan_to_num(plane, posinf=9.0).clip(0, 9) for n, plane in planes.items()}
        planes = {n: plane.astype("<u4") for n, plane in kept.items()}
    attributes: dict[str, bytes] = {}
    if random.random() < 0.5:
        number = packed(random.choice(NUMBERS), 4)
        name = random.choice(("dataWindow", "displayWindow", "lineOrder", "compression"))
        if name.endswith("Window"):
            shift = random.choice((0, 5, -7, 2**31 - _EDGE - 1, -(2**31)))
            moved = struct.pack("<4i", shift, shift, shift + _EDGE - 1, shift + _EDGE - 1)
            changed = replaced(_BOX, 4 * random.randrange(4), number)
            attributes[name] = random.choice((moved, changed))
        else:
            attributes[name] = bytes([random.randrange(12)])
    data = exr_bytes(planes, attributes)
    if random.random() < 0.3:  # offsets and lengths of blocks
        start = data.index(b"screenWindowWidth\0") + 33
        place = start + random.randrange(8 * _EDGE // _ROWS + 8)
        data = replaced(data, place, packed(random.choice(NUMBERS), random.choice((1, 4, 8))))
    return data


SPECIMENS = {
    "UTIA image (.exr)": Specimen(
        "paint.exr",
        lambda: [exr_bytes(_planes()), exr_bytes(_planes("RGBA", "<f2")), _exr_by_mitsuba()],
        header=60,
        sized=_exr_sized,
        valued=lambda value: [exr_bytes(_planes(value=value))],
        rebuild=_exr_rebuilt,
        module="mitsuba",
    ),
    "UTIA image (.png)": Specimen(
        "paint.png",
        lambda: [png_bytes(_ramp()), png_bytes(_ramp(4, "u2"))],
        header=60,
        sized=_png_sized,
        valued=lambda _: [],
        rebuild=_png_rebuilt,
        module="mitsuba",
    ),
}
