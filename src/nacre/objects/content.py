"""Whether two objects hold the same: numbers, arrays, and objects of these."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import is_dataclass
from functools import cached_property
from types import FunctionType, ModuleType
from typing import Any

_PLAIN = (str, int, bool, type(None))
_DEFAULTS = (*_PLAIN, float, tuple)


def content_of(thing: Any) -> dict[str, Any]:
    """The attributes of an object that count where it is compared, but for those that are what the
    class has unless something else is said.
    """
    without = {"_closed", *getattr(type(thing), "not_content", ())}
    return {
        name: value
        for name, value in stored(thing).items()
        if name not in without and not _is_default(type(thing), name, value)
    }


def _is_default(kind: type, name: str, value: Any) -> bool:
    default = getattr(kind, name, _DEFAULTS)
    return isinstance(default, _DEFAULTS) and type(default) is type(value) and default == value


def stored(thing: Any) -> dict[str, Any]:
    """The attributes of an object, without what is computed from them when first asked for."""
    return {name: value for name, value in vars(thing).items() if not is_computed(thing, name)}


def is_computed(thing: Any, name: str) -> bool:
    """Whether an attribute is computed when first asked for; False where it was given instead."""
    computed = isinstance(getattr(type(thing), name, None), cached_property)
    return computed and name not in vars(thing).get("_given", ())


def same(a: Any, b: Any) -> bool:
    """Whether two values are of one type and equal in all parts; NaN equals NaN.

    Arrays are equal if their types, shapes and numbers are, wherever they lie. What compares by
    identity, and dataclasses, are equal if their attributes are.
    """
    import numpy as np  # not needed to import nacre, or for its help

    if a is b:
        return True
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        nan = a.dtype.kind in "fc"
        return a.dtype == b.dtype and bool(np.array_equal(a, b, equal_nan=nan))
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return a == b or (math.isnan(a) and math.isnan(b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if _by_attributes(a):
        return same(content_of(a), content_of(b))
    return bool(a == b)


def mark(value: Any) -> Hashable:
    """Something that is the same for all that is :func:`same`, and quick to compute: of an array,
    its type and shape.
    """
    import numpy as np

    if isinstance(value, _PLAIN):
        return value
    if isinstance(value, float):
        return None if math.isnan(value) else value
    if isinstance(value, np.ndarray):
        return value.dtype, value.shape
    if isinstance(value, dict):
        return frozenset((key, mark(each)) for key, each in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(mark, value))
    return type(value).__qualname__


def _by_attributes(thing: Any) -> bool:
    """Whether an object has attributes, and `==` would ask for the identity, or for the truth of
    arrays. Functions, classes and modules are no such objects.
    """
    kind: Any = type(thing)
    if isinstance(thing, type | ModuleType | FunctionType) or not getattr(thing, "__dict__", None):
        return False
    return kind.__eq__ is object.__eq__ or is_dataclass(kind)
