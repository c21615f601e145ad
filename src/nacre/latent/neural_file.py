"""A neural basis as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.pca import LARGEST
from nacre.neural.nbrdf import Layer

Tensors = dict[str, npt.NDArray[Any]]


def pack(basis: NeuralBasis) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    tensors: Tensors = {
        name: np.ascontiguousarray(getattr(basis, name)) for name in ("functions", "examples")
    }
    for index, layer in enumerate(basis.hidden, 1):
        tensors |= {f"weights_{index}": layer.weights, f"biases_{index}": layer.biases}
    return {"greys": basis.greys, "hidden": [len(layer.biases) for layer in basis.hidden]}, tensors


def unpack(header: dict[str, Any], tensors: Tensors) -> NeuralBasis:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    widths = [int(width) for width in header["hidden"]]
    check_tensors(tensors)
    hidden = [
        Layer(tensors[f"weights_{index}"], tensors[f"biases_{index}"])
        for index in range(1, len(widths) + 1)
    ]
    if [len(layer.biases) for layer in hidden] != widths:
        raise ValueError(f"layers are not as wide as {widths}")
    functions, examples = tensors["functions"], tensors["examples"]
    return NeuralBasis(hidden, functions, int(header["greys"]), examples, header["metadata"])


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
        if not (np.abs(array) < LARGEST).all():
            raise ValueError(f"{name} holds numbers that are not finite or too large")
