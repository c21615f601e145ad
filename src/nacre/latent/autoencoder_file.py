"""An autoencoder as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.latent.autoencoder import LAYERS, Autoencoder
from nacre.latent.neural_file import check_tensors
from nacre.neural.nbrdf import Layer
from nacre.tensors import Tensors


def pack(basis: Autoencoder) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    tensors: Tensors = {"common": np.ascontiguousarray(basis.common)}
    for name, layer in basis.layers.items():
        tensors |= {f"{name}_weights": layer.weights, f"{name}_biases": layer.biases}
    return {"seed": basis.seed}, tensors


def unpack(header: dict[str, Any], tensors: Tensors) -> Autoencoder:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    check_tensors(tensors)
    layers = {name: Layer(tensors[f"{name}_weights"], tensors[f"{name}_biases"]) for name in LAYERS}
    seed, metadata = int(header["seed"]), header["metadata"]
    return Autoencoder(tensors["common"], **layers, seed=seed, metadata=metadata)
