"""Safetensors files with one JSON header: what the files of all networks have in common."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt
import safetensors.numpy
from safetensors import SafetensorError

from nacre.files import FormatError, PathLike, check_json, read_bytes, reason

Tensors = dict[str, npt.NDArray[Any]]


def to_bytes(key: str, header: dict[str, Any], tensors: Tensors, limit: int) -> bytes:
    """The content of a file; the same tensors and header give the same bytes.

    Parameters
    ----------
    key
        Name of the header in the file's metadata. One only: the library writes several in no
        particular order.
    header, tensors
        What to write.
    limit
        Bytes that are read back.

    Raises
    ------
    FormatError
        If the header is not JSON, or the file too large.
    """
    try:
        check_json(header)
        data = safetensors.numpy.save(tensors, {key: json.dumps(header)})
    except (TypeError, ValueError) as error:
        raise FormatError(f"metadata cannot be written as JSON: {error}") from error
    if len(data) > limit:
        raise FormatError(f"{len(data):,} bytes, more than the {limit:,} we read back")
    return data


def from_file(path: PathLike, key: str, limit: int, what: str) -> tuple[Any, Tensors]:
    """Header and tensors of a file, neither of them checked.

    Parameters
    ----------
    path
        File to read.
    key, limit
        As in :func:`to_bytes`.
    what
        The file is expected to be, for the message of an error: "a nacre material".

    Raises
    ------
    FormatError
        If it is no safetensors file of at most `limit` bytes, or has no such header.
    """
    data = read_bytes(path, limit)
    try:
        tensors = safetensors.numpy.load(data)
        size = int.from_bytes(data[:8], "little")
        header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"][key])
    except SafetensorError as error:
        raise FormatError(f"{path}: is not a whole safetensors file: {reason(error)}") from error
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is a safetensors file, but not {what}") from error
    return header, tensors


def check_numbers(tensors: Tensors, largest: float) -> None:
    """Refuse numbers that are not finite, or whose products could overflow.

    Raises
    ------
    ValueError
        With the name of the tensor.
    """
    for name, array in tensors.items():
        if not (np.abs(array) < largest).all():
            raise ValueError(f"{name} holds numbers that are not finite or too large")
