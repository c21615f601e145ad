"""Small whole files of every format in the registry, and ways to break each.

The tests of bad input and the fuzz targets go through :data:`SPECIMENS`: a new reader is covered
by an entry here. Nothing is a real measurement.
"""

from __future__ import annotations

import io
import itertools
import json
import math
import struct
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.measured.utia_table import SHAPE as UTIA_SHAPE
from tests.measured.support import material, tensor_bytes

Array = npt.NDArray[Any]

NUMBERS = (0, -1, 1, 2, 3, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1)
"""Integers at which sizes overflow or vanish."""
VALUES = (0.0, -0.0, -1.0, 1e-45, 1e-38, 1e-6, 1.0, 6e4, 1e10, 3.4e38, 1e300, math.inf, math.nan)
"""Floats at which formulas overflow or vanish."""

_ROWS = ((0.3, 0.0, 0.5, -2.0), (1.0, 0.0, 1.2, 3.1), (0.3, 0.0, 1.2, 0.7), (0.6, 1.0, 0.2, 0.1))


@dataclass(frozen=True)
class Specimen:
    """What is known of the files of one format.

    Parameters
    ----------
    name
        File name; its ending is the format's.
    files
        Makes whole files, small ones.
    header
        How many bytes at the start are worth cutting one by one.
    sized
        Makes files in which one count is replaced by a given one that is never true.
    valued
        Makes files in which one value is replaced by a given one.
    rebuild
        Makes a file whose lengths and checksums agree, around contents that are out of the
        ordinary: damage that bytes alone would hardly find.
    text
        Whether files are text: cut between lines, a file may be a whole one.
    companions
        Other files of the set that a file belongs to.
    memory
        Bytes that reading may take whatever the length of the file, beside a multiple of it.
    """

    name: str
    files: Callable[[], list[bytes]]
    header: int
    sized: Callable[[int], Iterable[bytes]]
    valued: Callable[[float], Iterable[bytes]]
    rebuild: Callable[[bytes, Random], bytes]
    text: bool = False
    companions: Mapping[str, bytes] = field(default_factory=dict)
    memory: int = 16 << 20


def _packed(number: int, size: int) -> bytes:
    """The low bytes of an integer."""
    return (number % (1 << (8 * size))).to_bytes(size, "little")


def _replaced(data: bytes, place: int, part: bytes) -> bytes:
    return data[:place] + part + data[place + len(part) :]


def odd_array(random: Random, shape: tuple[int, ...], dtype: str) -> Array:
    """Numbers of the interval (0, 1), some of them replaced by extreme ones."""
    generator = np.random.default_rng(random.getrandbits(32))
    with np.errstate(over="ignore", invalid="ignore"):
        array = np.asarray(generator.random(shape))
        if random.random() < 0.3:
            array[...] = random.choice(VALUES[:-2])
        for _ in range(random.choice((0, 0, 1, 3))):
            if array.size:
                array.flat[random.randrange(array.size)] = random.choice(VALUES)
        return array.astype(dtype)


def _odd_shape(random: Random, rank: int) -> tuple[int, ...]:
    return tuple(random.choice((1, 1, 2, 3, 4, 6)) for _ in range(rank))


# MERL


def _merl_file(shape: tuple[int, ...] = (3, 2, 4), dtype: str = "<f8") -> bytes:
    values = np.linspace(0.0, 30.0, 3 * math.prod(shape))
    return struct.pack("<3i", *shape) + values.astype(dtype).tobytes()


def _merl_sized(count: int) -> Iterable[bytes]:
    return (_replaced(_merl_file(), 4 * axis, _packed(count, 4)) for axis in range(3))


def _merl_rebuilt(_: bytes, random: Random) -> bytes:
    shape = _odd_shape(random, 3)
    return struct.pack("<3i", *shape) + odd_array(random, (3, *shape), "<f8").tobytes()


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


def _shapes(array: Array, count: int) -> Iterable[bytes]:
    """The file of an array with each length replaced, in a header that is as long as before."""
    data, shape = npy_bytes(array), repr(array.shape).encode()
    for axis in range(array.ndim):
        lengths = [str(n) for n in array.shape]
        lengths[axis] = str(count)
        promised = f"({', '.join(lengths)}{',' * (array.ndim == 1)})".encode()
        extra = len(promised) - len(shape)
        header = data[:128].replace(shape, promised).replace(b"}" + b" " * max(extra, 0), b"}", 1)
        yield (header.rstrip(b" \n").ljust(127) + b"\n") + data[128:]


def _npy_rebuilt(rank: int) -> Callable[[bytes, Random], bytes]:
    def rebuilt(_: bytes, random: Random) -> bytes:
        shape = _odd_shape(random, rank)
        if rank == 4 and random.random() < 0.8:
            shape = (*shape[:3], 3) if random.random() < 0.7 else (3, *shape[:3])
        dtype = random.choice(("<f2", "<f4", "<f8", ">f8", "<f16", "<i4", "<c16"))
        order = random.choice("CF")
        return npy_bytes(np.asarray(odd_array(random, shape, dtype), order=order))

    return rebuilt


def _npz_rebuilt(data: bytes, random: Random) -> bytes:
    if random.random() < 0.6:
        content = _npy_rebuilt(4)(data, random)
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


# RGL


def _rgl_fields(phi_i: tuple[float, ...] = (0.0,)) -> dict[str, Array]:
    return material(phi_i, size=5)


def _rgl_files() -> list[bytes]:
    turn = tuple(np.linspace(-math.pi, math.pi, 5))
    plain = _rgl_fields() | {"jacobian": np.zeros(1, np.uint8)}
    return [tensor_bytes(fields) for fields in (_rgl_fields(), _rgl_fields(turn), plain)]


def _rgl_sized(count: int) -> Iterable[bytes]:
    fields = _rgl_fields()
    data = tensor_bytes(fields)
    yield _replaced(data, 14, _packed(count, 4))
    for name, array in fields.items():
        if array.dtype == np.float32:  # texts may be of any length that the file holds
            entry = data.index(struct.pack("<H", len(name)) + name.encode()) + 2 + len(name) + 11
            for axis in range(array.ndim):
                yield _replaced(data, entry + 8 * axis, _packed(count, 8))


def _rgl_valued(value: float) -> Iterable[bytes]:
    for name, array in _rgl_fields().items():
        if array.dtype == np.float32:
            changed = array.copy()
            changed.flat[array.size // 2] = value
            yield tensor_bytes(_rgl_fields() | {name: changed})


def _rgl_rebuilt(_: bytes, random: Random) -> bytes:
    turns = ((0.0,), (-1.0, 1.0), tuple(np.linspace(-math.pi, math.pi * random.choice((0, 1)), 4)))
    fields = _rgl_fields(random.choice(turns))
    for name in random.choices(list(fields), k=random.randint(1, 3)):
        array = fields.get(name)
        if array is None or array.dtype != np.float32:
            continue
        choice = random.random()
        if choice < 0.05:
            del fields[name]
        elif choice < 0.15:
            fields[name] = array[..., : random.randint(1, 3)].copy()
        elif choice < 0.2:
            fields[name] = array.astype(random.choice(("f2", "f8", "i4")))
        elif array.ndim == 1:
            fields[name] = np.sort(odd_array(random, array.shape, "<f4"))
        else:
            fields[name] = odd_array(random, array.shape, "<f4")
    return tensor_bytes(fields)


# Text


def _cornell_file(value: float = 0.25, bands: int = 3) -> bytes:
    lines = ["# Cornell University, Program of Computer Graphics", "# Test Paint", str(bands)]
    lines.append("450.0 550.0 650.0")
    lines += [" ".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _csv_file(value: float = 0.25, columns: str = "r,g,b") -> bytes:
    lines = ["# name: red paint", "# units: radians", f"theta_i,phi_i,theta_o,phi_o,{columns}"]
    lines += [",".join(map(str, (*row, 0.1, 0.2, value))) for row in _ROWS]
    return ("\n".join(lines) + "\n").encode()


def _text_rebuilt(data: bytes, random: Random) -> bytes:
    """Lines of a text in another order, with words of it replaced."""
    words = [str(n).encode() for n in (*NUMBERS, *VALUES)]
    words += [b"", b"theta_i", b"550 nm", b"theta_o [deg]", b"isotropic: no", b"1_0", b"0x10"]
    words += ["٣".encode(), b"\xff", b"\0", b"9" * 400, b"#", b"\x85", b"\x1c", b"name: x"]
    lines = data.split(b"\n")
    for _ in range(random.randint(1, 4)):
        place = random.randrange(len(lines))
        mark = b"," if b"," in lines[place] else b" "
        parts = lines[place].split(mark)
        parts[random.randrange(len(parts))] = random.choice(words)
        lines[place] = mark.join(parts)
        if random.random() < 0.2:
            lines.insert(random.randrange(len(lines)), random.choice(lines))
        if random.random() < 0.1:
            del lines[random.randrange(len(lines))]
    return b"\n".join(lines or [b""])


# Networks


def _weights(sizes: tuple[int, ...] = (6, 4, 3)) -> dict[str, Array]:
    random = np.random.default_rng(1)
    tensors: dict[str, Array] = {}
    for k, (a, b) in enumerate(itertools.pairwise(sizes), 1):
        tensors[f"weights_{k}"] = random.normal(size=(a, b)).astype("<f4")
        tensors[f"biases_{k}"] = random.normal(size=b).astype("<f4")
    return tensors


def _material_header(sizes: tuple[int, ...] = (6, 4, 3)) -> dict[str, Any]:
    return {
        "version": 1,
        "model": "nbrdf",
        "sizes": list(sizes),
        "parametrisation": "rusinkiewicz vectors",
        "name": "paint",
        "sampler": {"kind": "cosine + Blinn-Phong", "specular": 0.5, "exponent": 10.0},
        "source": {"file": "a", "sha256": "b"},
        "fit": {"epochs": 3},
        "quality": {"held_out_loss": 0.1},
    }


def safetensors_bytes(
    tensors: Mapping[str, Array], header: Any, entries: Mapping[str, Any] | None = None
) -> bytes:
    """A tensor container; `entries` replaces what it says about single tensors."""
    described: dict[str, Any] = {"__metadata__": {"nacre": json.dumps(header)}}
    body = b""
    for name, array in tensors.items():
        offsets = [len(body), len(body) + array.nbytes]
        kind = {"f": "F"}.get(array.dtype.kind, "I") + str(8 * array.dtype.itemsize)
        described[name] = {"dtype": kind, "shape": list(array.shape), "data_offsets": offsets}
        body += array.tobytes()
    text = json.dumps(described | dict(entries or {})).encode()
    return len(text).to_bytes(8, "little") + text + body


def _safetensors_file() -> bytes:
    return safetensors_bytes(_weights(), _material_header())


def _safetensors_sized(count: int) -> Iterable[bytes]:
    data, tensors = _safetensors_file(), _weights()
    yield _packed(count, 8) + data[8:]
    for place in range(3):
        sizes = [6, 4, 3]
        sizes[place] = count
        yield safetensors_bytes(tensors, _material_header() | {"sizes": sizes})
    start = 0
    for name, array in tensors.items():
        for shape, offsets in (
            ([count, *array.shape[1:]], [start, start + array.nbytes]),
            (list(array.shape), [start, count]),
            (list(array.shape), [count, start + array.nbytes]),
        ):
            if offsets != [start, start + array.nbytes] or shape != list(array.shape):
                entry = {"dtype": "F32", "shape": shape, "data_offsets": offsets}
                yield safetensors_bytes(tensors, _material_header(), {name: entry})
        start += array.nbytes


def _safetensors_valued(value: float) -> Iterable[bytes]:
    for name, array in _weights().items():
        changed = array.copy()
        changed.flat[-1] = value
        yield safetensors_bytes(_weights() | {name: changed}, _material_header())
    for key in ("specular", "exponent"):
        sampler = _material_header()["sampler"] | {key: value}
        yield safetensors_bytes(_weights(), _material_header() | {"sampler": sampler})


def _odd_json(random: Random, depth: int = 0) -> Any:
    choices: list[Any] = [None, True, "", "x" * 300, "a\nb", "\ud800", [], {}, *NUMBERS, *VALUES]
    if depth < 3:
        choices += [[_odd_json(random, depth + 1)], {"kind": _odd_json(random, depth + 1)}]
    return random.choice(choices)


def _safetensors_rebuilt(_: bytes, random: Random) -> bytes:
    sizes = random.choice(((6, 4, 3), (6, 3), (6, 1, 2, 3), (6, 16, 16, 16, 3)))
    header, tensors = _material_header(sizes), _weights(sizes)
    choice = random.random()
    if choice < 0.3:
        for name in random.sample(list(tensors), 2):
            tensors[name] = odd_array(random, tensors[name].shape, "<f4")
    elif choice < 0.4:
        name = random.choice(list(tensors))
        tensors[name] = odd_array(random, _odd_shape(random, random.randrange(4)), "<f2")
    elif choice < 0.7:
        header[random.choice(list(header))] = _odd_json(random)
    else:
        place = random.choice(("sampler", "source", "fit", "quality"))
        key = random.choice([*header[place], "name", "model"])
        header[place] = header[place] | {key: _odd_json(random)}
    return safetensors_bytes(tensors, header if random.random() < 0.97 else _odd_json(random))


def keras_bytes(tensors: Mapping[str, Array], **options: Any) -> bytes:
    """Keras weights; `options` go to every dataset."""
    import h5py

    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        count = len(tensors) // 2
        file.attrs["layer_names"] = [f"dense_{k}".encode() for k in range(1, count + 1)]
        for k in range(1, count + 1):
            group = file.create_group(f"dense_{k}")
            group.attrs["weight_names"] = [b"kernel:0", b"bias:0"]
            group.create_dataset("kernel:0", data=tensors[f"weights_{k}"], **options)
            group.create_dataset("bias:0", data=tensors[f"biases_{k}"], **options)
    return content.getvalue()


def _keras_sized(count: int) -> Iterable[bytes]:
    data = keras_bytes(_weights((6, 5, 3)))
    for shape in ((6, 5), (5, 3)):
        stored = struct.pack("<2Q", *shape)
        place = data.index(stored)
        for axis in range(2):
            yield _replaced(data, place + 8 * axis, _packed(count, 8))


def _keras_valued(value: float) -> Iterable[bytes]:
    for name, array in _weights().items():
        changed = array.copy()
        changed.flat[-1] = value
        yield keras_bytes(_weights() | {name: changed})


def _keras_rebuilt(_: bytes, random: Random) -> bytes:
    sizes = random.choice(((6, 4, 3), (6, 3), (6, 1, 2, 3), (6, 8, 3)))
    tensors = _weights(sizes)
    for name in random.sample(list(tensors), 2):
        shape = tensors[name].shape
        if random.random() < 0.3:
            shape = _odd_shape(random, random.randrange(4))
        tensors[name] = odd_array(random, shape, random.choice(("f4", "f4", "f2", "f8", "i4")))
    options = ({}, {}, {"chunks": True}, {"compression": "gzip"}, {"compression": "lzf"})
    plain = all(array.ndim for array in tensors.values())
    return keras_bytes(tensors, **random.choice(options if plain else options[:1]))


# What comes of bytes alone


def mutated(data: bytes, random: Random) -> bytes:
    """A file with a few numbers overwritten, and parts cut, repeated or moved."""
    content = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 4))):
        near = 256 if random.random() < 0.6 else len(content)
        place = random.randrange(max(1, min(near, len(content))))
        choice = random.random()
        if choice < 0.5:
            size = random.choice((1, 2, 4, 8))
            content[place : place + size] = _packed(random.choice(NUMBERS), size)
        elif choice < 0.7:
            layout = random.choice(("<f", "<d"))
            value = random.choice(VALUES)
            value = value if layout == "<d" or not 3.5e38 < value < math.inf else math.inf
            part = struct.pack(layout, value)
            content[place : place + len(part)] = part
        elif choice < 0.8:
            del content[place : place + random.choice((1, 4, 8, 1 << 20))]
        elif choice < 0.9:
            content[place:place] = content[place : place + random.choice((1, 4, 8, 64))]
        elif content:
            content[place % len(content)] ^= 1 << random.randrange(8)
    return bytes(content)


_FC = npy_bytes(_weights()["weights_1"])

SPECIMENS: dict[str, Specimen] = {
    "nacre neural material": Specimen(
        "paint.safetensors",
        lambda: [
            _safetensors_file(),
            safetensors_bytes(
                _weights((6, 3)), _material_header((6, 3)) | {"sampler": {"kind": "cosine"}}
            ),
        ],
        header=64,
        sized=_safetensors_sized,
        valued=_safetensors_valued,
        rebuild=_safetensors_rebuilt,
    ),
    "RGL": Specimen(
        "paint.bsdf",
        _rgl_files,
        header=420,
        sized=_rgl_sized,
        valued=_rgl_valued,
        rebuild=_rgl_rebuilt,
    ),
    "MERL": Specimen(
        "paint.binary",
        lambda: [_merl_file(), _merl_file((1, 1, 1))],
        header=40,
        sized=_merl_sized,
        valued=lambda value: [_merl_file()[:-8] + struct.pack("<d", value)],
        rebuild=_merl_rebuilt,
    ),
    "MERL array (.npz)": Specimen(
        "paint.npz",
        lambda: [
            npz_bytes(npy_bytes(_table())),
            npz_bytes(npy_bytes(_table()), "x.npy", zipfile.ZIP_DEFLATED),
        ],
        header=200,
        sized=lambda count: map(npz_bytes, _shapes(_table(), count)),
        valued=lambda value: [npz_bytes(npy_bytes(_table(value)))],
        rebuild=_npz_rebuilt,
        memory=256 << 20,  # a whole table may pack into a small archive
    ),
    "MERL array (.npy)": Specimen(
        "paint.npy",
        lambda: [npy_bytes(_table()), npy_bytes(np.moveaxis(_table(), -1, 0).astype("<f2"))],
        header=140,
        sized=lambda count: _shapes(_table(), count),
        valued=lambda value: [npy_bytes(_table(value))],
        rebuild=_npy_rebuilt(4),
    ),
    "Cornell scan": Specimen(
        "paint.brdf",
        lambda: [_cornell_file()],
        header=100,
        sized=lambda count: [_cornell_file(bands=count)],
        valued=lambda value: [_cornell_file(value)],
        rebuild=_text_rebuilt,
        text=True,
    ),
    "comma-separated samples": Specimen(
        "paint.csv",
        lambda: [_csv_file(), _csv_file(columns="450,550 nm,650 [nm]".replace(" [nm]", ""))],
        header=100,
        sized=lambda _: [],
        valued=lambda value: [_csv_file(value)],
        rebuild=_text_rebuilt,
        text=True,
    ),
    "UTIA": Specimen(
        "paint.bin",
        lambda: [_utia_file()],
        header=16,
        sized=lambda _: [],
        valued=lambda value: [_utia_file(value)],
        rebuild=_utia_rebuilt,
    ),
    "NBRDF network (Keras)": Specimen(
        "paint.h5",
        lambda: [keras_bytes(_weights()), keras_bytes(_weights((6, 3)))],
        header=96,
        sized=_keras_sized,
        valued=_keras_valued,
        rebuild=_keras_rebuilt,
    ),
    "NBRDF network (NumPy)": Specimen(
        "paint_fc1.npy",
        lambda: [_FC],
        header=140,
        sized=lambda count: _shapes(_weights()["weights_1"], count),
        valued=lambda value: [npy_bytes(np.full((6, 4), value, "<f4"))],
        rebuild=_npy_rebuilt(2),
        companions={
            "paint_b1.npy": npy_bytes(_weights()["biases_1"]),
            "paint_fc2.npy": npy_bytes(_weights()["weights_2"]),
            "paint_b2.npy": npy_bytes(_weights()["biases_2"]),
        },
    ),
}
"""One entry for every format of the registry, by its name."""
