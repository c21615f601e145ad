"""Small MERL, MDL and UTIA files, and tables as NumPy arrays."""

from __future__ import annotations

import io
import math
import struct
import zipfile
from collections.abc import Callable, Iterable
from random import Random

import numpy as np

from nacre.measured.utia import SHAPE as UTIA_SHAPE
from tests.specimens.specimen import (
    Array,
    Specimen,
    mutated,
    odd_array,
    odd_shape,
    packed,
    replaced,
)


def _merl_file(shape: tuple[int, ...] = (3, 2, 4), dtype: str = "<f8") -> bytes:
    values = np.linspace(0.0, 30.0, 3 * math.prod(shape))
    return struct.pack("<3i", *shape) + values.astype(dtype).tobytes()


def _merl_sized(count: int) -> Iterable[bytes]:
    return (replaced(_merl_file(), 4 * axis, packed(count, 4)) for axis in range(3))


def _merl_valued(value: float) -> Iterable[bytes]:
    for dtype in ("<f8", "<f4", "<f2"):
        last = np.array(value).astype(dtype)
        yield _merl_file(dtype=dtype)[: -last.itemsize] + last.tobytes()


def _merl_rebuilt(_: bytes, random: Random) -> bytes:
    shape = odd_shape(random, 3)
    dtype = random.choice(("<f8", "<f8", "<f4", "<f2"))
    return struct.pack("<3i", *shape) + odd_array(random, (3, *shape), dtype).tobytes()


# MDL


def mbsdf_file(
    theta: int = 2, phi: int = 3, channels: int = 3, text: bytes = b"", value: float = 0.5
) -> bytes:
    """An `.mbsdf` file of reflectance, with values from 0 to 2 but for the last."""
    values = np.linspace(0.0, 2.0, theta * theta * phi * channels, dtype="<f4")
    values[-1] = value
    block = mbsdf_block(channels == 3, theta, phi, values)
    return b"NVIDIA ARC MBSDF V1\n" + text + b"MBSDF_DATA_REFLECTION=\n" + block


def mbsdf_block(kind: int, theta: int, phi: int, values: Array) -> bytes:
    return struct.pack("<3I", kind, theta, phi) + values.astype("<f4").tobytes()


def _mbsdf_sized(count: int) -> Iterable[bytes]:
    data = mbsdf_file()
    start = data.index(b"=\n") + 2
    return (replaced(data, start + 4 * field, packed(count, 4)) for field in range(3))


def _mbsdf_valued(value: float) -> Iterable[bytes]:
    with np.errstate(over="ignore"):
        single = float(np.float32(value))
        return [mbsdf_file(value=single), mbsdf_file(1, 1, 1, value=single)]


def _mbsdf_rebuilt(_: bytes, random: Random) -> bytes:
    theta, phi = odd_shape(random, 2)
    channels = random.choice((1, 3, 3))
    text = random.choice((b"", b'description="paint"\n', b"\n" * 9, b"\xff\n", b"x" * 3000 + b"\n"))
    kind = random.choice((channels == 3, channels == 3, channels == 3, 2))
    values = odd_array(random, (theta, theta, phi, channels), "<f4")
    first = random.choice((b"", b"_REFLECTION", b"_REFLECTION", b"_TRANSMISSION"))
    block = b"MBSDF_DATA" + first + b"=\n" + mbsdf_block(kind, theta, phi, values)
    return b"NVIDIA ARC MBSDF V1\n" + text + block * random.choice((1, 1, 1, 2))


# NumPy arrays


def npy_bytes(array: Array) -> bytes:
    """An `.npy` file."""
    content = io.BytesIO()
    np.save(content, array)
    return content.getvalue()


def npz_bytes(content: bytes, name: str = "f_r.npy", method: int = zipfile.ZIP_STORED) -> bytes:
    """An archive of one file, with a checksum that is right."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        archive.writestr(zipfile.ZipInfo(name), content, method)
    return file.getvalue()


def _table(last: float = 0.5) -> Array:
    values = np.linspace(0.0, 1.0, 3 * 2 * 4 * 3).reshape(3, 2, 4, 3)
    values[1, 1, 1, 1] = last
    return values


def promised_shapes(array: Array, count: int) -> Iterable[bytes]:
    """The file of an array with each length replaced, in a header that is as long as before."""
    data, shape = npy_bytes(array), repr(array.shape).encode()
    for axis in range(array.ndim):
        lengths = [str(n) for n in array.shape]
        lengths[axis] = str(count)
        promised = f"({', '.join(lengths)}{',' * (array.ndim == 1)})".encode()
        extra = len(promised) - len(shape)
        header = data[:128].replace(shape, promised).replace(b"}" + b" " * max(extra, 0), b"}", 1)
        yield (header.rstrip(b" \n").ljust(127) + b"\n") + data[128:]


def npy_rebuilt(rank: int) -> Callable[[bytes, Random], bytes]:
    def rebuilt(_: bytes, random: Random) -> bytes:
        shape = odd_shape(random, rank)
        if rank == 4 and random.random() < 0.8:
            shape = (*shape[:3], 3) if random.random() < 0.7 else (3, *shape[:3])
        dtype = random.choice(("<f2", "<f4", "<f8", ">f8", "<f16", "<i4", "<c16"))
        values = odd_array(random, shape, dtype)
        return npy_bytes(np.asfortranarray(values) if random.random() < 0.5 else values)

    return rebuilt


def _npz_rebuilt(data: bytes, random: Random) -> bytes:
    if random.random() < 0.6:
        content = npy_rebuilt(4)(data, random)
    else:
        content = mutated(npy_bytes(_table()), random)
    method = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2))
    return npz_bytes(content, random.choice(("f_r.npy", "x.npy", "f_r.npy")), method)


# UTIA


def _utia_file(value: float = 0.5) -> bytes:
    values = np.resize(np.linspace(0.0, 1.0, 1009), math.prod(UTIA_SHAPE))
    values[4321] = value
    return values.tobytes()


def _utia_rebuilt(data: bytes, random: Random) -> bytes:
    """Values of a short file over and over, as many as the format has, or nearly."""
    size = 8 * math.prod(UTIA_SHAPE) + random.choice((0, 0, 0, 0, 0, -1, 1))
    values = (data or b"\0") if random.random() < 0.5 else odd_array(random, (9,), "<f8").tobytes()
    return (values * (size // len(values) + 1))[:size]


SPECIMENS = {
    "MERL": Specimen(
        "paint.binary",
        lambda: [
            _merl_file(),
            _merl_file((1, 1, 1)),
            _merl_file(dtype="<f4"),
            _merl_file(dtype="<f2"),
        ],
        header=40,
        sized=_merl_sized,
        valued=_merl_valued,
        rebuild=_merl_rebuilt,
    ),
    "MERL array (.npz)": Specimen(
        "paint.npz",
        lambda: [
            npz_bytes(npy_bytes(_table())),
            npz_bytes(npy_bytes(_table()), "x.npy", zipfile.ZIP_DEFLATED),
        ],
        header=200,
        sized=lambda count: map(npz_bytes, promised_shapes(_table(), count)),
        valued=lambda value: [npz_bytes(npy_bytes(_table(value)))],
        rebuild=_npz_rebuilt,
        memory=256 << 20,  # a whole table may pack into a small archive
    ),
    "MERL array (.npy)": Specimen(
        "paint.npy",
        lambda: [npy_bytes(_table()), npy_bytes(np.moveaxis(_table(), -1, 0).astype("<f2"))],
        header=140,
        sized=lambda count: promised_shapes(_table(), count),
        valued=lambda value: [npy_bytes(_table(value))],
        rebuild=npy_rebuilt(4),
    ),
    "MDL": Specimen(
        "paint.mbsdf",
        lambda: [
            mbsdf_file(),
            mbsdf_file(1, 1, 1),
            mbsdf_file(3, 2, 1, b'description="paint"\nversion="1"\n'),
        ],
        header=60,
        sized=_mbsdf_sized,
        valued=_mbsdf_valued,
        rebuild=_mbsdf_rebuilt,
    ),
    "UTIA": Specimen(
        "paint.bin",
        lambda: [_utia_file()],
        header=16,
        sized=lambda _: [],
        valued=lambda value: [_utia_file(value)],
        rebuild=_utia_rebuilt,
    ),
}
