"""An autoencoder as the header and the tensors of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.io.tensors import Tensors
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.neural_file import check_tensors, named_layers, named_tensors


def pack(basis: Autoencoder) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    tensors: Tensors = {"common": np.ascontiguousarray(basis.common)}
    return {"seed": basis.seed}, tensors | named_tensors(basis.layers)


def unpack(header: dict[str, Any], tensors: Tensors) -> Autoencoder:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    check_tensors(tensors)
    layers = named_layers(tensors, Autoencoder.LAYERS)
    seed, metadata = int(header["seed"]), header["metadata"]
    return Autoencoder(tensors["common"], **layers, seed=seed, metadata=metadata)
