"""A neural basis as the header and the tensors of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nacre.io.tensors import Tensors, check_numbers
from nacre.latent.codes import LARGEST
from nacre.latent.lobe_predictor import LobePredictor
from nacre.latent.neural_basis import NeuralBasis
from nacre.numerics.mlp import Layer


def pack(basis: NeuralBasis) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    tensors: Tensors = {
        name: np.ascontiguousarray(getattr(basis, name)) for name in ("functions", "examples")
    }
    tensors |= _tensors(basis.hidden)
    own: dict[str, Any] = {
        "greys": basis.greys,
        "hidden": [len(layer.biases) for layer in basis.hidden],
    }
    if basis.predictors:
        own["predictors"] = {name: len(p.layers) for name, p in basis.predictors.items()}
    for name, predictor in basis.predictors.items():
        tensors |= _tensors(predictor.layers, _prefix(name))
    return own, tensors


def unpack(header: dict[str, Any], tensors: Tensors) -> NeuralBasis:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    widths = [int(width) for width in header["hidden"]]
    check_tensors(tensors)
    hidden = _layers(tensors, len(widths))
    if [len(layer.biases) for layer in hidden] != widths:
        raise ValueError(f"layers are not as wide as {widths}")
    predictors = {
        str(name): LobePredictor(str(name), _layers(tensors, int(count), _prefix(name)))
        for name, count in dict(header.get("predictors", {})).items()
    }
    functions, examples = tensors["functions"], tensors["examples"]
    greys, metadata = int(header["greys"]), header["metadata"]
    return NeuralBasis(hidden, functions, greys, examples, metadata, predictors)


def check_tensors(tensors: Tensors) -> None:
    """Refuse tensors that are not float32, or whose products could overflow.

    Raises
    ------
    ValueError
        With the name of the tensor.
    """
    for name, array in tensors.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name} is {array.dtype}, expected float32")
    check_numbers(tensors, LARGEST)


def named_tensors(layers: Mapping[str, Layer]) -> Tensors:
    """Weights and biases of layers by the layers' names."""
    return {
        f"{name}_{kind}": array
        for name, layer in layers.items()
        for kind, array in (("weights", layer.weights), ("biases", layer.biases))
    }


def named_layers(tensors: Tensors, names: Sequence[str]) -> dict[str, Layer]:
    """The inverse of :func:`named_tensors`."""
    return {name: Layer(tensors[f"{name}_weights"], tensors[f"{name}_biases"]) for name in names}


def _prefix(name: str) -> str:
    """Of the names of a predictor's tensors."""
    return f"predictor {name} "


def _tensors(layers: Sequence[Layer], prefix: str = "") -> Tensors:
    """Weights and biases of layers, numbered from 1."""
    return {
        f"{prefix}{kind}_{index}": np.ascontiguousarray(array)
        for index, layer in enumerate(layers, 1)
        for kind, array in (("weights", layer.weights), ("biases", layer.biases))
    }


def _layers(tensors: Tensors, count: int, prefix: str = "") -> list[Layer]:
    """The inverse of :func:`_tensors`."""
    return [
        Layer(tensors[f"{prefix}weights_{index}"], tensors[f"{prefix}biases_{index}"])
        for index in range(1, count + 1)
    ]
