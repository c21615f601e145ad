"""The default codec as named tensors and numbers, for files.

What a codec holds is packed by the types of its fields: an array is a tensor, a layer two of them,
a number stands in the header, and parts of a codec put their names in front.
"""

from __future__ import annotations

import typing
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

from nacre.array import Floats
from nacre.io.tensors import HALF_LARGEST, Tensors, check_header, in_precision, in_single
from nacre.measured.textures.domes import pairs
from nacre.textures.codecs.basis.codec import BasisCodec

MODEL = "basis"
"""What files and commands call the codec."""
VERSION = 2
_EXACT = "prior."
"""What is single in every file, as is what half cannot hold: inverses magnify rounding."""
_LARGEST = 1e9
"""Weights of coefficients that hardly vary in the training data are large."""
_WIDEST, _FUNCTIONS, _VALUES, _LAYERS = 1 << 13, 1 << 10, 1 << 10, 1 << 6
_Part = TypeVar("_Part")


def pack_basis(codec: BasisCodec, precision: str | None) -> tuple[dict[str, Any], Tensors]:
    """Header and tensors of a codec; see :func:`nacre.textures.codecs.codec_file.pack_codec`."""
    numbers, tensors = pack_fields(codec)
    metadata = numbers.pop("metadata")
    written: Tensors = {}
    for name, array in tensors.items():
        exact = name.startswith(_EXACT) or np.abs(array).max() >= HALF_LARGEST
        kind = "single" if exact else precision
        written |= in_precision({name: array}, kind, _LARGEST)
    header = {
        "version": VERSION,
        "model": MODEL,
        "numbers": numbers,
        "values": "roots of pi f_r, linear Rec. 709, as gray values and pairs of colors",
        "metadata": metadata,
    }
    return header, written


def unpack_basis(header: dict[str, Any], tensors: Tensors) -> BasisCodec:
    """A codec; see :func:`nacre.textures.codecs.codec_file.unpack_codec`."""
    check_header(header, VERSION)
    metadata, numbers = header["metadata"], header["numbers"]
    if not isinstance(numbers, dict):
        raise ValueError("numbers are not an object")
    wide = [name for name, array in tensors.items() if max(array.shape, default=0) > _WIDEST]
    if wide:
        raise ValueError(f"{wide[0]} is {tensors[wide[0]].shape}, wider than {_WIDEST:,}")
    single: Tensors = {}
    for name, array in tensors.items():
        single |= in_single({name: array}, _LARGEST)
    codec = unpack_fields(BasisCodec, {**numbers, "metadata": metadata}, single)
    functions = len(codec.functions.last.biases)
    if not 1 <= codec.values <= _VALUES or functions > _FUNCTIONS:
        raise ValueError(f"{codec.values:,} values, {functions:,} functions: more than we read")
    _try(codec)
    return codec


def pack_fields(part: Any, prefix: str = "") -> tuple[dict[str, Any], Tensors]:
    """Numbers and tensors that a dataclass holds, by their names with dots between.

    Raises
    ------
    TypeError
        If a field is of no type that can be packed.
    """
    numbers: dict[str, Any] = {}
    tensors: Tensors = {}
    for name, value in _members(part):
        here = f"{prefix}{name}"
        if isinstance(value, np.ndarray):
            tensors[here] = np.ascontiguousarray(value)
        elif isinstance(value, int | float | str | dict):
            numbers[here] = value
        elif isinstance(value, list | tuple) or is_dataclass(value):
            more = pack_fields(value, f"{here}.")
            numbers |= more[0]
            tensors |= more[1]
        else:
            raise TypeError(f"{here} is a {type(value).__name__}, which cannot be packed")
    return numbers, tensors


def unpack_fields(
    kind: type[_Part], numbers: dict[str, Any], tensors: Tensors, prefix: str = ""
) -> _Part:
    """The dataclass that :func:`pack_fields` packed.

    Raises
    ------
    KeyError
        If a number or a tensor is missing.
    ValueError, TypeError
        If a number is of another type, or the dataclass refuses what it gets.
    """
    hints = typing.get_type_hints(kind)
    values = {
        field.name: _unpacked(hints[field.name], numbers, tensors, f"{prefix}{field.name}")
        for field in fields(kind)  # type: ignore[arg-type]
    }
    try:
        return kind(**values)
    except ValueError as error:
        where = prefix.rstrip(".")
        raise ValueError(f"{where}: {error}" if where else str(error)) from error


def _members(part: Any) -> list[tuple[str, Any]]:
    if isinstance(part, list | tuple):
        return [(str(index), value) for index, value in enumerate(part)]
    return [(field.name, getattr(part, field.name)) for field in fields(part)]


def _unpacked(kind: Any, numbers: dict[str, Any], tensors: Tensors, name: str) -> Any:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is Sequence:
        items: list[Any] = []
        while len(items) < _LAYERS and any(
            key == f"{name}.{len(items)}" or key.startswith(f"{name}.{len(items)}.")
            for key in (*tensors, *numbers)
        ):
            items.append(_unpacked(inner[0], numbers, tensors, f"{name}.{len(items)}"))
        return items
    if origin is np.ndarray:
        return tensors[name]
    if is_dataclass(kind):
        return unpack_fields(typing.cast(type[Any], kind), numbers, tensors, f"{name}.")
    value = numbers[name]
    wanted = origin or kind
    if wanted is float and type(value) is int:
        value = float(value)
    if type(value) is not wanted:
        raise ValueError(f"{name} is {value!r:.40}, expected a {wanted.__name__}")
    return value


def _try(codec: BasisCodec) -> None:
    """Refuse a codec that cannot encode and decode a gray texel at a few directions."""
    directions: Floats = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], np.float32)
    wi, wo = pairs(directions, directions)
    with np.errstate(all="ignore"):
        codes = codec.encoder(wi, wo)(np.full((1, len(wi), 3), 0.5, np.float32))
        values = codec.decoder(wi, wo)(codes)
    if codes.shape != (1, codec.values) or values.shape != (1, len(wi), 3):
        raise ValueError(f"gives codes {codes.shape} and values {values.shape} of one texel")
    if not (np.isfinite(codes).all() and np.isfinite(values).all()):
        raise ValueError("encodes a gray texel as numbers that are not finite")
