"""Small textures encoded by the default codec."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import Any

import numpy as np

from nacre.textures.latent_map import LatentMap
from nacre.textures.limit import Rate, limited
from tests.specimens.networks import safetensors_bytes
from tests.specimens.specimen import Array, Specimen, odd_array, odd_json, odd_shape, packed
from tests.textures.codecs.basis.made import codec

_KEY = "nacre latent map"
_NUMBERS = "functions.greys", "prior.noise"


def _tensors(scattered: bool = False, compact: bool = False) -> dict[str, Array]:
    directions = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], "<f4")
    _, weights = codec().pack()
    tensors = {
        "codes": np.linspace(-1.0, 1.0, 2 * 3 * 2, dtype="<f4").reshape(2, 3, 2),
        "lights": directions,
        "views": directions[:1],
        **{f"codec.{name}": array for name, array in weights.items()},
    }
    if scattered:
        tensors["pairs"] = np.array([[1, 0]], "<i4")
    if compact:
        tensors["codes"] = np.arange(0, 240, 40, dtype="u1").reshape(2, 3, 1)
        tensors["codes.axes"] = np.array([[0.1, 0.02], [-0.02, 0.1]], "<f4")
        tensors["codes.center"] = np.array([-1.0, 0.5], "<f4")
    return tensors


def _rated() -> bytes:
    """A file of version 2."""
    random = np.random.default_rng(3)
    codes = random.normal(size=(9, 7, 2)).astype(np.float32)
    directions = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], np.float32)
    found = limited(LatentMap(codes, codec(), directions, directions[[0, 0]]), Rate(8.0)).rated
    assert found is not None
    numbers, tensors = found.pack()
    plain = {name: array for name, array in _tensors().items() if name != "codes"}
    return _bytes(plain | tensors, _header() | {"version": 2, "codes": numbers})


def _header() -> dict[str, Any]:
    return {
        "version": 1,
        "name": "cloth",
        "codec": codec().pack()[0],
        "metadata": {"source": {"file": "a", "sha256": "b"}, "errors": {"MSE x 1e4": 1.0}},
    }


def _bytes(tensors: dict[str, Array], header: Any, entries: Any = None) -> bytes:
    return safetensors_bytes(tensors, header, entries, _KEY)


def _sized(count: int) -> Iterable[bytes]:
    tensors, header = _tensors(), _header()
    data = _bytes(tensors, header)
    yield packed(count, 8) + data[8:]
    start = 0
    for name, array in tensors.items():
        end = start + array.nbytes
        for axis in range(array.ndim):
            shape = [count if k == axis else size for k, size in enumerate(array.shape)]
            entry = {"dtype": "F32", "shape": shape, "data_offsets": [start, end]}
            yield _bytes(tensors, header, {name: entry})
        start = end


def _valued(value: float) -> Iterable[bytes]:
    for name, array in _tensors().items():
        changed = array.copy()
        changed.flat[-1] = value
        yield _bytes(_tensors() | {name: changed}, _header())


def _rebuilt(_: bytes, random: Random) -> bytes:
    tensors, header = _tensors(random.random() < 0.5, random.random() < 0.5), _header()
    name = random.choice(list(tensors))
    choice = random.random()
    if choice < 0.3:
        tensors[name] = odd_array(random, tensors[name].shape, "<f4")
    elif choice < 0.5:
        tensors[name] = odd_array(random, odd_shape(random, random.randrange(4)), "<f4")
    elif choice < 0.6:
        tensors["codes"] = odd_array(random, (4, 4, 2), "<f2")
    elif choice < 0.8:
        header[random.choice(list(header))] = odd_json(random)
    else:
        model = header["codec"]
        model[random.choice(list(model))] = odd_json(random)
        model = _header()["codec"] if random.random() < 0.5 else model
        if isinstance(model.get("numbers"), dict):
            model["numbers"][random.choice(_NUMBERS)] = odd_json(random)
        header["codec"] = model
    return _bytes(tensors, header if random.random() < 0.97 else odd_json(random))


SPECIMENS = {
    "nacre encoded texture": Specimen(
        "cloth.safetensors",
        lambda: [
            *(_bytes(_tensors(*kind), _header()) for kind in ((), (True,), (False, True))),
            _rated(),
        ],
        header=100,
        sized=_sized,
        valued=_valued,
        rebuild=_rebuilt,
    ),
}
