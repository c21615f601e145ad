"""Files of the latent space: a basis as `.safetensors`, a code as `.json`."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import safetensors.numpy
from safetensors import SafetensorError

from nacre.files import FormatError, PathLike, atomic_path, read_bytes, reason
from nacre.latent.pca import LARGEST, Basis, PcaBrdf
from nacre.measured.merl import Resolution

VERSION = 1
BASIS, CODE = "log-relative PCA basis", "log-relative PCA code"
"""What files say that they are."""
_KEY = "nacre basis"
_BASIS_LIMIT, _CODE_LIMIT = 1 << 30, 1 << 20
_TENSORS = ("mask", "centre", "components", "uses", "colours", "deviations")


def save_basis(basis: Basis, path: PathLike) -> None:
    """Write a basis; the same basis gives the same bytes.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    header = {
        "version": VERSION,
        "model": BASIS,
        "resolution": list(astuple(basis.resolution)),
        "metadata": basis.metadata,
    }
    tensors: dict[str, npt.NDArray[Any]] = {
        "mask": np.packbits(basis.mask),
        "uses": basis.uses.astype(np.int32),
        **{
            name: np.ascontiguousarray(getattr(basis, name), np.float32)
            for name in ("centre", "components", "colours", "deviations")
        },
    }
    data = safetensors.numpy.save(tensors, {_KEY: json.dumps(header, allow_nan=False)})
    if len(data) > _BASIS_LIMIT:
        raise FormatError(f"{path}: {len(data):,} bytes; take a coarser grid or fewer values")
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def load_basis(path: PathLike) -> Basis:
    """Read a basis.

    Raises
    ------
    FormatError
        If the file is not a whole basis of a version we know.
    """
    data = read_bytes(path, _BASIS_LIMIT)
    try:
        tensors = safetensors.numpy.load(data)
        size = int.from_bytes(data[:8], "little")
        header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"][_KEY])
        if header["model"] != BASIS:
            raise FormatError(f"{path}: holds model {header['model']!r}, expected a basis")
        if header["version"] != VERSION:
            raise FormatError(f"{path}: version {header['version']!r} is not {VERSION}")
        return _basis(header, tensors)
    except FormatError:
        raise
    except SafetensorError as error:
        raise FormatError(f"{path}: is not a whole safetensors file: {reason(error)}") from error
    except KeyError as error:
        raise FormatError(f"{path}: field {reason(error)} is missing; is no basis") from error
    except (TypeError, ValueError, RecursionError, OverflowError) as error:
        raise FormatError(f"{path}: is not a whole basis: {reason(error)}") from error


def _basis(header: dict[str, Any], tensors: dict[str, npt.NDArray[Any]]) -> Basis:
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
    if not isinstance(metadata, dict):
        raise ValueError("metadata is not an object")
    return Basis(
        resolution, mask, centre, components, uses.astype(np.int64), colours, deviations, metadata
    )


def save_code(material: PcaBrdf, path: PathLike) -> None:
    """Write the code of a material, with a mark of the basis that it belongs to.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    content = {
        "code of": CODE,
        "version": VERSION,
        "name": material.name,
        "basis": fingerprint(material.basis),
        "values": [float(v) for v in material.code],
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def load_code(path: PathLike, basis: Basis) -> PcaBrdf:
    """Read a code and give the material that it stands for.

    Parameters
    ----------
    path
        File to read.
    basis
        The one that the code was made with.

    Raises
    ------
    FormatError
        If the file is not a whole code, or belongs to another basis.
    """
    try:
        content = json.loads(read_bytes(path, _CODE_LIMIT).decode("utf-8"))
        kind, version = content["code of"], content["version"]
        name, mark, values = content["name"], content["basis"], content["values"]
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not a whole code: {reason(error)}") from error
    if kind != CODE or version != VERSION:
        raise FormatError(f"{path}: is not a code of version {VERSION} of {CODE!r}")
    if mark != fingerprint(basis):
        raise FormatError(f"{path}: basis: the code was made with another one")
    try:
        material = basis.decode([float(v) for v in values], str(name))
    except (TypeError, ValueError, OverflowError) as error:
        raise FormatError(f"{path}: values: {reason(error)}") from error
    material.source = {"file": Path(path).name}
    return material


def fingerprint(basis: Basis) -> str:
    """SHA-256 of what a code means in a basis."""
    digest = hashlib.sha256(repr(astuple(basis.resolution)).encode())
    for name in _TENSORS:
        digest.update(np.ascontiguousarray(getattr(basis, name)).tobytes())
    return digest.hexdigest()
