"""Neural materials as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from nacre.brdf import COLOR
from nacre.errors import FormatError
from nacre.io.files import PathLike, check_json, write_encoded
from nacre.io.format import Format
from nacre.io.tensors import (
    Tensors,
    format_errors,
    from_file,
    header_key,
    looks_like_tensors,
    to_bytes,
)
from nacre.neural import spectral_file
from nacre.neural.chain import ChainBrdf
from nacre.neural.chain_file import MODEL, described, made, numbered_tensors
from nacre.neural.inputs import ENHANCED, PAPER, RECIPROCAL, SPINNING, STEREOGRAPHIC, has_axes
from nacre.neural.nbrdf import PRECISIONS, NeuralBrdf, check_weights
from nacre.neural.spectral import SpectralBrdf
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.sampling import describe_sampler, make_sampler

_VERSIONS = {RELU: 1, SQUARED_RELU: 2}
"""Version of a file, by what follows the hidden layers: readers of version 1 know ReLU alone."""
_LIMIT = 1 << 26
_KEY = "nacre"
_FIXED = (
    *("version", "model", "sizes", "parametrisation", "angle"),
    *("output", "color_space", "name", "sampler", "channels", "notes"),
)
"""Fields that this module writes; whatever else the header holds is the material's metadata."""
_PARAMETRISATIONS = {
    (PAPER, True): "rusinkiewicz vectors, phi_h = 0",
    (PAPER, False): "rusinkiewicz vectors",
    (ENHANCED, True): "enhanced rusinkiewicz vectors, phi_h = 0",
    (ENHANCED, False): "enhanced half vectors along x and y, light carried to the pole",
    (SPINNING, False): "enhanced rusinkiewicz vectors",
    (STEREOGRAPHIC, False): "stereographic light and view",
    (RECIPROCAL, True): "reciprocal rusinkiewicz vectors, phi_h = 0",
    (RECIPROCAL, False): "reciprocal rusinkiewicz vectors",
}
"""What files call a network's inputs, by their name and whether the network is isotropic."""


def encode(network: NeuralBrdf | ChainBrdf) -> bytes:
    """The content of a neural material's file; the same network gives the same bytes.

    Raises FormatError if `network` is no neural material, or the format cannot hold it.
    """
    if isinstance(network, SpectralBrdf):
        return to_bytes(_KEY, spectral_file.described(network), network.stored, _LIMIT)
    if isinstance(network, ChainBrdf):
        return to_bytes(_KEY, described(network), numbered_tensors(network.layers), _LIMIT)
    if not isinstance(network, NeuralBrdf):
        raise FormatError("holds neural materials only; fit the material first")
    try:
        sampler = describe_sampler(network.sampler)
    except ValueError as error:
        raise FormatError(str(error)) from error
    header: dict[str, Any] = {
        **network.metadata,
        "version": _VERSIONS[network.activation],
        "model": "nbrdf",
        "sizes": list(network.sizes),
        "parametrisation": _PARAMETRISATIONS[network.inputs, network.isotropic],
        "output": _output(network.inputs),
        "color_space": "linear Rec. 709",
        "name": network.name,
        "sampler": sampler,
    }
    if network.channels != COLOR:
        header["color_space"], header["channels"] = "none", list(network.channels)
    if network.notes:
        header["notes"] = list(network.notes)
    if has_axes(network.inputs, network.isotropic):
        header["angle"] = network.angle
    numbered = numbered_tensors(network.layers)
    tensors = {k: v.astype(PRECISIONS[network.precision]) for k, v in numbered.items()}
    return to_bytes(_KEY, header, tensors, _LIMIT)


def _output(inputs: str) -> str:
    """What files say about how outputs x become f_r."""
    return "exp(x)" if inputs == RECIPROCAL else "exp(x) - 1, clamped at 0"


def texts(found: Any, count: int | None = None) -> tuple[Any, ...]:
    """A list of texts as a tuple; a ValueError says that it is none, or not of a length."""
    if not isinstance(found, list | tuple) or not all(isinstance(text, str) for text in found):
        raise ValueError("field 'channels' or 'notes' is not a list of texts")
    if count is not None and len(found) != count:
        raise ValueError(f"field 'channels' has {len(found)} names, expected {count}")
    return tuple(found)


def save(network: NeuralBrdf | ChainBrdf, path: PathLike) -> None:
    """Write a neural material; raises FormatError as :func:`encode` does, or for a bad path."""
    write_encoded(path, encode, network)


def load(path: PathLike) -> NeuralBrdf | ChainBrdf:
    """Read a neural material; FormatError if it is not a whole one of a version we know."""
    header, tensors = from_file(path, _KEY, _LIMIT, "a nacre material")
    with format_errors(path):
        return _from_header(header, tensors)


def _from_header(header: dict[str, Any], tensors: Tensors) -> NeuralBrdf | ChainBrdf:
    if header.get("model") == spectral_file.MODEL:
        spectral = spectral_file.made(header, tensors)
        check_json(header)
        named = spectral.in_channels(texts(header["channels"], 3))
        return named.replaced(notes=texts(header.get("notes", ())))
    if header.get("model") == MODEL:
        return _told(made(header, tensors), header)
    activations = [key for key, number in _VERSIONS.items() if number == header["version"]]
    if not activations:
        known = " and ".join(map(str, _VERSIONS.values()))
        raise ValueError(f"version {header['version']}; this nacre reads versions {known}")
    if header["model"] != "nbrdf":
        raise ValueError(f"unknown model {header['model']!r}; update nacre")
    found = [key for key, text in _PARAMETRISATIONS.items() if text == header["parametrisation"]]
    if not found:
        raise ValueError(f"unknown parametrization {header['parametrisation']!r}; update nacre")
    inputs, isotropic = found[0]
    metadata = {key: value for key, value in header.items() if key not in _FIXED}
    for key in ("source", "fit", "quality"):
        if not isinstance(metadata.get(key, {}), dict):
            raise ValueError(f"field {key!r} is not a table")
    layers, kinds = [], set()
    for index in range(1, len(header["sizes"])):
        parts = [tensors[f"{kind}_{index}"] for kind in ("weights", "biases")]
        kinds |= {part.dtype for part in parts}
        layers.append(Layer(*parts))
    stored = [name for name, kind in PRECISIONS.items() if kinds <= {kind}]
    if not stored:
        raise ValueError("layers do not hold float32 or float16 numbers, all alike")
    check_weights(layers, activations[0])
    network = NeuralBrdf(
        layers,
        isotropic=isotropic,
        inputs=inputs,
        name=str(header["name"]),
        sampler=make_sampler(header["sampler"]),
        metadata=metadata,
        precision=stored[0],
        activation=activations[0],
        angle=float(header["angle"]) if has_axes(inputs, isotropic) else 0.0,
    )
    network = _told(network, header)
    if list(network.sizes) != header["sizes"]:
        raise ValueError(f"tensors have sizes {network.sizes}, the header says {header['sizes']}")
    check_json(header)  # so that what was read can be written again
    return network


_Network = TypeVar("_Network", NeuralBrdf, ChainBrdf)


def _told(network: _Network, header: dict[str, Any]) -> _Network:
    """With the channels and notes of a header."""
    return network.replaced(
        channels=texts(header.get("channels", COLOR), 3), notes=texts(header.get("notes", ()))
    )


FORMAT = Format(
    "nacre neural material",
    (".safetensors",),
    lambda head: looks_like_tensors(head) and header_key(head) in (None, _KEY),
    lambda path: load(Path(path)),
    save,
    holds="neural",
    measured=False,
)
