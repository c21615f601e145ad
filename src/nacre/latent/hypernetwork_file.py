"""A hypernetwork as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

from nacre.io.tensors import Tensors
from nacre.latent import neural_file
from nacre.latent.hypernetwork import Hypernetwork
from nacre.latent.neural_file import named_layers, named_tensors


def pack(basis: Hypernetwork) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    header, tensors = neural_file.pack(basis.basis)
    return header, tensors | named_tensors(basis.layers)


def unpack(header: dict[str, Any], tensors: Tensors) -> Hypernetwork:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    basis = neural_file.unpack(header, tensors)
    layers = named_layers(tensors, Hypernetwork.LAYERS)
    return Hypernetwork(basis, **layers, metadata=header["metadata"])
