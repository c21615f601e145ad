"""Objects that do not change after they are made."""

from __future__ import annotations

import abc
import copy
from typing import Any, TypeVar

_Self = TypeVar("_Self", bound="Frozen")


class _FrozenMeta(abc.ABCMeta):
    """Closes an object when its constructor is done."""

    def __call__(cls, *args: Any, **settings: Any) -> Any:
        made = super().__call__(*args, **settings)
        object.__setattr__(made, "_closed", True)
        return made


class Frozen(metaclass=_FrozenMeta):
    """Attributes are set in the constructor and stay; :meth:`replaced` makes a changed copy."""

    _closed = False

    @property
    def closed(self) -> bool:
        return self._closed

    def __setattr__(self, name: str, value: Any) -> None:
        if self._closed:
            hint = f"use replaced({name}=...) for a copy"
            raise AttributeError(f"a {type(self).__name__} does not change: {hint}")
        object.__setattr__(self, name, value)

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a {type(self).__name__} does not change")

    def replaced(self: _Self, **attributes: Any) -> _Self:
        """A copy that shares all data with this object but for the given attributes.

        Cached properties are shared too. A dataclass checks the new values as its constructor does.
        Raises AttributeError if there is no attribute of a name.
        """
        for name in attributes:
            if name not in vars(self) and not hasattr(type(self), name):
                raise AttributeError(f"a {type(self).__name__} has no attribute {name!r}")
        other = copy.copy(self)
        for name, value in attributes.items():
            object.__setattr__(other, name, value)
        check = getattr(other, "__post_init__", None)
        if check is not None:
            object.__setattr__(other, "_closed", False)
            check()
            object.__setattr__(other, "_closed", True)
        return other
