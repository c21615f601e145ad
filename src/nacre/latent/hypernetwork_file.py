"""A hypernetwork as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

from nacre.latent import neural_file
from nacre.latent.hypernetwork import LAYERS, Hypernetwork
from nacre.neural.nbrdf import Layer
from nacre.tensors import Tensors


def pack(basis: Hypernetwork) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    header, tensors = neural_file.pack(basis.basis)
    for name, layer in basis.layers.items():
        tensors |= {f"{name}_weights": layer.weights, f"{name}_biases": layer.biases}
    return header, tensors


def unpack(header: dict[str, Any], tensors: Tensors) -> Hypernetwork:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    basis = neural_file.unpack(header, tensors)
    layers = {name: Layer(tensors[f"{name}_weights"], tensors[f"{name}_biases"]) for name in LAYERS}
    return Hypernetwork(basis, **layers, metadata=header["metadata"])
