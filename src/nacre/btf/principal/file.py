"""Principal components as `.safetensors` files."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.btf.principal.codec import PcaCodec
from nacre.files import FormatError, PathLike, check_json, reason, write_encoded
from nacre.tensors import Tensors, check_numbers, from_file, to_bytes

VERSION = 1
_KEY = "nacre texel components"
_LIMIT = 1 << 29
_LARGEST = 1e12
_ARRAYS = ("wi", "wo", "mean", "components", "variances")


def save_components(codec: PcaCodec, path: PathLike) -> None:
    """Write components; the same ones give the same bytes.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    write_encoded(path, _encode, codec)


def load_components(path: PathLike) -> PcaCodec:
    """Read components.

    Raises
    ------
    FormatError
        If the file is not a whole one of a version we know.
    """
    header, tensors = from_file(path, _KEY, _LIMIT, "principal components of texels")
    try:
        return _from_header(header, tensors)
    except KeyError as error:
        raise FormatError(f"{path}: field {reason(error)} is missing") from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise FormatError(f"{path}: {reason(error)}") from error


def _encode(codec: PcaCodec) -> bytes:
    tensors: Tensors = {name: np.asarray(getattr(codec, name), np.float32) for name in _ARRAYS}
    tensors = {name: np.ascontiguousarray(array) for name, array in tensors.items()}
    header = {
        "version": VERSION,
        "values": "pi f_r, linear Rec. 709",
        "noise": float(codec.noise),
        "metadata": codec.metadata,
    }
    return to_bytes(_KEY, header, tensors, _LIMIT)


def _from_header(header: dict[str, Any], tensors: Tensors) -> PcaCodec:
    if header["version"] != VERSION:
        raise ValueError(f"version {header['version']!r}; this nacre reads version {VERSION}")
    metadata, noise = header["metadata"], header["noise"]
    if not isinstance(metadata, dict):
        raise ValueError("metadata is not an object")
    if not isinstance(noise, float) or not 0.0 < noise < _LARGEST:
        raise ValueError(f"noise is {noise!r}, expected a number above 0")
    check_json(header)  # so that what was read can be written again
    arrays = {name: tensors[name] for name in _ARRAYS}
    for name, array in arrays.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name} are not float32 numbers")
    check_numbers(arrays, _LARGEST)
    for name in ("wi", "wo"):
        lengths = np.square(arrays[name]).sum(axis=-1)
        if arrays[name].ndim != 2 or not np.allclose(lengths, 1.0, atol=1e-3):
            raise ValueError(f"{name} are no unit directions")
    return PcaCodec(**arrays, noise=noise, metadata=metadata)
