"""Dataclasses as named tensors and numbers, for files.

The types of its fields say how a dataclass is packed: an array is a tensor, a layer two of them, a
number stands in the header, and the names of parts precede those of what they hold.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Sequence
from dataclasses import Field, fields, is_dataclass
from typing import Any, TypeVar

import numpy as np

from nacre.io.tensors import Tensors
from nacre.runtime.store import Store

_LAYERS = 1 << 6  # items of a sequence that are read
_Part = TypeVar("_Part")


def pack_fields(part: Any, prefix: str = "") -> tuple[dict[str, Any], Tensors]:
    """Numbers and tensors that a dataclass holds, by their names with dots between.

    A field with `metadata={"file": name}` has that name in files. A TypeError says that a field has
    a type that cannot be packed.
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

    Raises a KeyError if a number or a tensor is missing; a ValueError or TypeError if a number has
    another type, or the dataclass refuses what it gets.
    """
    hints = typing.get_type_hints(kind)
    values = {
        field.name: _unpacked(hints[field.name], numbers, tensors, f"{prefix}{_file_name(field)}")
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
    return [(_file_name(field), getattr(part, field.name)) for field in fields(part)]


def _file_name(field: Field[Any]) -> str:
    return str(field.metadata.get("file", field.name))


def _unpacked(kind: Any, numbers: dict[str, Any], tensors: Tensors, name: str) -> Any:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if hasattr(origin, "__value__"):  # the alias that NDArray is from NumPy 2.5 on
        origin = typing.get_origin(origin.__value__)
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


def kept(store: Store, name: str, kind: type[_Part], make: Callable[[], _Part]) -> _Part:
    """The dataclass that `make` gives, or gave in an earlier process.

    Raises what :meth:`nacre.runtime.store.Store.load` and :meth:`nacre.runtime.store.Store.save`
    do.
    """
    if name in store:
        with store.readable(name):
            found: Any = store.load(name)
            return unpack_fields(kind, found["numbers"], found["tensors"])
    made = make()
    numbers, tensors = pack_fields(made)
    store.save({"numbers": numbers, "tensors": tensors}, name)
    return made
