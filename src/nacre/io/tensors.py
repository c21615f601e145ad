"""Safetensors files with one JSON header: what the files of all networks have in common."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import safetensors.numpy
from safetensors import SafetensorError

from nacre.errors import CUT_SHORT, FormatError, reason
from nacre.io.files import PathLike, check_json, check_regular, read_bytes

Tensors = dict[str, npt.NDArray[Any]]

PRECISIONS: dict[str, np.dtype[Any]] = {
    "single": np.dtype(np.float32),
    "half": np.dtype(np.float16),
}  # of numbers in files

HALF_LARGEST = 65504.0  # what a half float holds
_LARGEST = 1e6
_HEADER_LIMIT = 1 << 24
_START = re.compile(rb'\{"__metadata__":\{"(nacre[ a-z]*)":')


def to_bytes(key: str, header: dict[str, Any], tensors: Tensors, limit: int) -> bytes:
    """The content of a file; the same tensors and header give the same bytes.

    The header has a name in the file's metadata, which holds nothing else, for the library writes
    several entries in no particular order. Raises :class:`FormatError` if the header is not JSON,
    or there are more bytes than `limit`, which are read back.
    """
    try:
        check_json(header)
        data = safetensors.numpy.save(tensors, {key: json.dumps(header)})
    except (TypeError, ValueError) as error:
        raise FormatError(f"metadata cannot be written as JSON: {error}") from error
    if len(data) > limit:
        raise FormatError(f"{len(data):,} bytes, more than the {limit:,} we read back")
    return data


def from_file(
    path: PathLike, key: str, limit: int, what: str, *, cut: bool = False
) -> tuple[Any, Tensors]:
    """Header and tensors of a file, neither of them checked; see :func:`to_bytes`.

    With `cut`, the file may be cut short: what is missing is zeros.

    Raises :class:`FormatError` if it is no safetensors file of at most `limit` bytes, or has no
    such header, and so is not `what` it should be: "a nacre material".
    """
    data = read_bytes(path, limit)
    try:
        size = int.from_bytes(data[:8], "little")
        if cut:
            entries = json.loads(data[8 : 8 + size])
            ends = [e["data_offsets"][1] for name, e in entries.items() if name != "__metadata__"]
            data = data.ljust(min(8 + size + max(ends), limit), b"\0")
        tensors = safetensors.numpy.load(data)
        header = json.loads(json.loads(data[8 : 8 + size])["__metadata__"][key])
    except SafetensorError as error:
        raise FormatError(f"{path}: is not a whole safetensors file: {CUT_SHORT}") from error
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is a safetensors file, but not {what}") from error
    return header, tensors


def check_header(header: dict[str, Any], version: int) -> None:
    """Refuse a header with another version, without metadata or that could not be written again.

    A KeyError or ValueError says what is wrong; see :func:`format_errors`.
    """
    if header["version"] != version:
        raise ValueError(f"version {header['version']!r}; this nacre reads version {version}")
    check_json(header)
    if not isinstance(header["metadata"], dict):
        raise ValueError("metadata is not an object")


def check_unit_vectors(tensors: Tensors) -> None:
    """Refuse, by a ValueError with its name, what is not of shape (n, 3), finite and of unit length
    to about a thousandth.
    """
    check_numbers(tensors, _LARGEST)
    for name, array in tensors.items():
        if array.ndim != 2 or not np.allclose(np.square(array).sum(axis=-1), 1.0, atol=1e-3):
            raise ValueError(f"{name} are no unit directions")


def check_numbers(tensors: Tensors, largest: float) -> None:
    """Raise ValueError, naming the tensor, for numbers that are not finite or too large."""
    for name, array in tensors.items():
        # Extremes, for large arrays are not to be copied; NaN is one wherever it is.
        if array.size and not -largest < float(array.min()) <= float(array.max()) < largest:
            raise ValueError(f"{name} holds numbers that are not finite or too large")


def in_precision(tensors: Tensors, precision: str | None, largest: float = _LARGEST) -> Tensors:
    """Single-precision numbers as they are written.

    `precision` is one of :data:`PRECISIONS`; half where None, if it changes no number. Raises
    :class:`FormatError` if a number is not finite or too large.
    """
    if precision is None:
        with np.errstate(over="ignore"):
            exact = all((a.astype(np.float16) == a).all() for a in tensors.values())
        precision = "half" if exact else "single"
    try:
        check_numbers(tensors, HALF_LARGEST if precision == "half" else largest)
    except ValueError as error:
        raise FormatError(str(error)) from error
    return {name: array.astype(PRECISIONS[precision]) for name, array in tensors.items()}


def in_single(tensors: Tensors, largest: float = _LARGEST) -> Tensors:
    """What :func:`in_precision` returned, in single precision; ValueError if it is not that."""
    kinds = {array.dtype for array in tensors.values()}
    if len(kinds) != 1 or not kinds <= set(PRECISIONS.values()):
        raise ValueError("weights are not float32 or float16 numbers, all alike")
    single = {name: array.astype(np.float32) for name, array in tensors.items()}
    check_numbers(single, largest)
    return single


@contextmanager
def format_errors(path: PathLike) -> Iterator[None]:
    """A block that makes sense of a file's header and tensors; whatever goes wrong where a field is
    missing or bad becomes a :class:`FormatError` that names the path.
    """
    try:
        yield
    except FormatError:
        raise
    except KeyError as error:
        raise FormatError(f"{path}: field {reason(error)} is missing") from error
    except (TypeError, AttributeError) as error:  # Python's own words would not help a user
        raise FormatError(f"{path}: a field of its header has the wrong type") from error
    except (ValueError, OverflowError, RecursionError) as error:
        raise FormatError(f"{path}: {reason(error)}") from error


def header_key(head: bytes) -> str | None:
    """Name of the header of one of our files by its first bytes; None for any other file.

    Ours have one name in their metadata, which the library writes first.
    """
    match = _START.match(head, 8)
    return match[1].decode() if match else None


def looks_like_tensors(head: bytes) -> bool:
    """Whether the first bytes of a file could be those of a safetensors file."""
    return len(head) > 9 and head[8:9] == b"{" and int.from_bytes(head[:8], "little") < 1 << 32


def has_header(path: PathLike, key: str) -> bool:
    """Whether a file is a safetensors file with such a header; does not raise."""
    try:
        whole = check_regular(Path(path))
        with Path(path).open("rb") as file:
            size = int.from_bytes(file.read(8), "little")
            if size > min(whole, _HEADER_LIMIT):  # to read it would take memory for all of it
                return False
            return key in json.loads(file.read(size))["__metadata__"]
    except (OSError, KeyError, TypeError, ValueError, RecursionError):
        return False
