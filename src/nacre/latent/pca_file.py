"""Principal components as the header and the tensors of a file."""

from __future__ import annotations

import math
from dataclasses import astuple
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.latent.codes import LARGEST
from nacre.latent.pca import Basis
from nacre.measured.merl import Resolution

Tensors = dict[str, npt.NDArray[Any]]

_TENSORS = ("mask", "centre", "components", "uses", "colours", "deviations")


def pack(basis: Basis) -> tuple[dict[str, Any], Tensors]:
    """What the header says beside the metadata, and the tensors."""
    tensors: Tensors = {
        "mask": np.packbits(basis.mask),
        "uses": basis.uses.astype(np.int32),
        **{
            name: np.ascontiguousarray(getattr(basis, name), np.float32)
            for name in ("centre", "components", "colours", "deviations")
        },
    }
    return {"resolution": list(astuple(basis.resolution))}, tensors


def unpack(header: dict[str, Any], tensors: Tensors) -> Basis:
    """The basis of a file.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is not whole.
    """
    resolution = Resolution(*(int(n) for n in header["resolution"]))
    packed, centre, components, uses, colours, deviations = (tensors[name] for name in _TENSORS)
    count = math.prod(resolution.dimensions)
    if packed.dtype != np.uint8 or packed.shape != (-(-count // 8),):
        raise ValueError(f"mask has another length than its {count} nodes need")
    mask = np.unpackbits(packed, count=count).astype(bool).reshape(resolution.dimensions)
    nodes, values = np.count_nonzero(mask), len(uses)
    if nodes < count // 8:
        raise ValueError(f"mask leaves {nodes} of {count} nodes")
    shapes = {
        "centre": (centre, (nodes,)),
        "components": (components, (len(components), nodes)),
        "colours": (colours, (values, 3)),
        "deviations": (deviations, (values,)),
    }
    for name, (array, shape) in shapes.items():
        if array.dtype != np.float32 or array.shape != shape:
            raise ValueError(f"{name} is {array.dtype} {array.shape}, expected float32 {shape}")
        if not (np.abs(array) < LARGEST).all():
            raise ValueError(f"{name} holds numbers that are not finite or too large")
    if uses.dtype != np.int32 or not ((uses >= 0) & (uses < len(components))).all() or not values:
        raise ValueError("uses does not name components")
    if not (deviations > 0).all():
        raise ValueError("deviations are not positive")
    metadata = header["metadata"]
    return Basis(
        resolution, mask, centre, components, uses.astype(np.int64), colours, deviations, metadata
    )
