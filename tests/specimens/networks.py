"""Small neural materials, and networks as their authors publish them."""

from __future__ import annotations

import io
import itertools
import json
import struct
from collections.abc import Iterable, Mapping
from random import Random
from typing import Any

import numpy as np

from tests.specimens.specimen import (
    Array,
    Specimen,
    odd_array,
    odd_json,
    odd_shape,
    packed,
    replaced,
)
from tests.specimens.tables import npy_bytes, npy_rebuilt, promised_shapes


def _weights(sizes: tuple[int, ...] = (6, 4, 3)) -> dict[str, Array]:
    random = np.random.default_rng(1)
    tensors: dict[str, Array] = {}
    for k, (a, b) in enumerate(itertools.pairwise(sizes), 1):
        tensors[f"weights_{k}"] = random.normal(size=(a, b)).astype("<f4")
        tensors[f"biases_{k}"] = random.normal(size=b).astype("<f4")
    return tensors


_LOBES: dict[str, Any] = {
    "kind": "diffuse + GGX",
    "cosines": [0.1, 1.0],
    "uniform": [0.1, 0.2],
    "squared": [0.0, 0.1],
    "lobes": [
        {"share": [0.3, 0.4], "roughness": [0.1, 0.2], "across": [0.2, 0.2], "shift": [0.5, 0.0]}
    ],
    "angle": 0.5,
}


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
    tensors: Mapping[str, Array],
    header: Any,
    entries: Mapping[str, Any] | None = None,
    key: str = "nacre",
) -> bytes:
    """A tensor container; `entries` replaces what it says about single tensors."""
    described: dict[str, Any] = {"__metadata__": {key: json.dumps(header)}}
    body = b""
    for name, array in tensors.items():
        offsets = [len(body), len(body) + array.nbytes]
        kind = {"f": "F", "u": "U"}.get(array.dtype.kind, "I") + str(8 * array.dtype.itemsize)
        described[name] = {"dtype": kind, "shape": list(array.shape), "data_offsets": offsets}
        body += array.tobytes()
    text = json.dumps(described | dict(entries or {})).encode()
    return len(text).to_bytes(8, "little") + text + body


def _chain_file(**changes: Any) -> bytes:
    """A network of another kind: activations of its own, on the directions."""
    header = {key: _material_header()[key] for key in ("version", "sizes", "name", "sampler")}
    header |= {"model": "chain", "inputs": "directions", "isotropic": False}
    header |= {"activations": ["softplus 2.0", "exp"]} | changes
    return safetensors_bytes(_weights(), header)


def _safetensors_file() -> bytes:
    return safetensors_bytes(_weights(), _material_header())


def _safetensors_sized(count: int) -> Iterable[bytes]:
    data, tensors = _safetensors_file(), _weights()
    yield packed(count, 8) + data[8:]
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
    yield _chain_file(activations=["leaky relu " + repr(value), "softplus " + repr(value)])
    for key in ("specular", "exponent"):
        sampler = _material_header()["sampler"] | {key: value}
        yield safetensors_bytes(_weights(), _material_header() | {"sampler": sampler})
    (lobe,) = _LOBES["lobes"]
    changed_lobes = [_LOBES | {"lobes": [lobe | {key: [0.1, value]}]} for key in lobe]
    changed_lobes += [_LOBES | {key: [0.1, value]} for key in ("cosines", "uniform", "squared")]
    for sampler in (*changed_lobes, _LOBES | {"angle": value}):
        yield safetensors_bytes(_weights(), _material_header() | {"sampler": sampler})


def _safetensors_rebuilt(_: bytes, random: Random) -> bytes:
    sizes = random.choice(((6, 4, 3), (6, 3), (6, 1, 2, 3), (6, 16, 16, 16, 3)))
    header, tensors = _material_header(sizes), _weights(sizes)
    if random.random() < 0.5:
        header["sampler"] = _LOBES
    choice = random.random()
    if random.random() < 0.2:
        parts = ("inputs", "isotropic", "activations", "sizes", "sampler")
        return _chain_file(**{random.choice(parts): odd_json(random)})
    if choice < 0.3:
        for name in random.sample(list(tensors), 2):
            tensors[name] = odd_array(random, tensors[name].shape, "<f4")
    elif choice < 0.4:
        name = random.choice(list(tensors))
        tensors[name] = odd_array(random, odd_shape(random, random.randrange(4)), "<f2")
    elif choice < 0.7:
        header[random.choice(list(header))] = odd_json(random)
    else:
        place = random.choice(("sampler", "source", "fit", "quality"))
        key = random.choice([*header[place], "name", "model"])
        header[place] = header[place] | {key: odd_json(random)}
    return safetensors_bytes(tensors, header if random.random() < 0.97 else odd_json(random))


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
            yield replaced(data, place + 8 * axis, packed(count, 8))


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
            shape = odd_shape(random, random.randrange(4))
        tensors[name] = odd_array(random, shape, random.choice(("f4", "f4", "f2", "f8", "i4")))
    options: tuple[dict[str, Any], ...]
    options = ({}, {}, {"chunks": True}, {"compression": "gzip"}, {"compression": "lzf"})
    plain = all(array.ndim for array in tensors.values())
    return keras_bytes(tensors, **random.choice(options if plain else options[:1]))


_FC = npy_bytes(_weights()["weights_1"])

SPECIMENS = {
    "nacre neural material": Specimen(
        "paint.safetensors",
        lambda: [
            _safetensors_file(),
            safetensors_bytes(
                _weights((6, 3)), _material_header((6, 3)) | {"sampler": {"kind": "cosine"}}
            ),
            safetensors_bytes(_weights(), _material_header() | {"sampler": _LOBES}),
            _chain_file(),
        ],
        header=64,
        sized=_safetensors_sized,
        valued=_safetensors_valued,
        rebuild=_safetensors_rebuilt,
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
        sized=lambda count: promised_shapes(_weights()["weights_1"], count),
        valued=lambda value: [npy_bytes(np.full((6, 4), value))],
        rebuild=npy_rebuilt(2),
        companions={
            "paint_b1.npy": npy_bytes(_weights()["biases_1"]),
            "paint_fc2.npy": npy_bytes(_weights()["weights_2"]),
            "paint_b2.npy": npy_bytes(_weights()["biases_2"]),
        },
    ),
}
