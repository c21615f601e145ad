"""Small RGL tensor files."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from random import Random

import numpy as np

from tests.measured.support import material, spectral, tensor_bytes
from tests.specimens.specimen import Array, Specimen, odd_array, packed, replaced


def _rgl_fields(phi_i: tuple[float, ...] = (0.0,)) -> dict[str, Array]:
    return material(phi_i, size=5)


def _rgl_files() -> list[bytes]:
    turn = tuple(np.linspace(-math.pi, math.pi, 5))
    plain = _rgl_fields() | {"jacobian": np.zeros(1, np.uint8)}
    bands = spectral(_rgl_fields())
    return [tensor_bytes(fields) for fields in (_rgl_fields(), _rgl_fields(turn), plain, bands)]


def _rgl_sized(count: int) -> Iterable[bytes]:
    yield replaced(tensor_bytes(_rgl_fields()), 14, packed(count, 4))
    for fields in (_rgl_fields(), spectral(_rgl_fields())):
        data = tensor_bytes(fields)
        for name, array in fields.items():
            if array.dtype == np.float32:  # texts may be of any length that the file holds
                entry = struct.pack("<H", len(name)) + name.encode()
                sizes = data.index(entry) + len(entry) + 11
                for axis in range(array.ndim):
                    yield replaced(data, sizes + 8 * axis, packed(count, 8))


def _rgl_valued(value: float) -> Iterable[bytes]:
    for fields in (_rgl_fields(), spectral(_rgl_fields())):
        for name, array in fields.items():
            if array.dtype == np.float32:
                changed = array.copy()
                changed.flat[array.size // 2] = value
                yield tensor_bytes(fields | {name: changed})


def _rgl_rebuilt(_: bytes, random: Random) -> bytes:
    turns = ((0.0,), (-1.0, 1.0), tuple(np.linspace(-math.pi, math.pi * random.choice((0, 1)), 4)))
    fields = _rgl_fields(random.choice(turns))
    if random.random() < 0.4:
        fields = spectral(fields)
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


SPECIMENS = {
    "RGL": Specimen(
        "paint.bsdf",
        _rgl_files,
        header=420,
        sized=_rgl_sized,
        valued=_rgl_valued,
        rebuild=_rgl_rebuilt,
    ),
}
