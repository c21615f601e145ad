"""Objects that do not change after they are made."""

from __future__ import annotations

import abc
from typing import Any, ClassVar, TypeVar

from nacre.objects.content import content_of, is_computed, mark, same, stored

_Self = TypeVar("_Self", bound="Frozen")


class _FrozenMeta(abc.ABCMeta):
    """Closes an object when its constructor is done."""

    def __call__(cls, *args: Any, **settings: Any) -> Any:
        made = super().__call__(*args, **settings)
        object.__setattr__(made, "_closed", True)
        return made


class Frozen(metaclass=_FrozenMeta):
    """Attributes are set in the constructor and stay; :meth:`replaced` makes a changed copy.

    Objects of one class with equal attributes are equal, arrays included, and have one hash; what
    is computed from the attributes later does not count.
    """

    not_content: ClassVar[frozenset[str]] = frozenset()
    """Attributes that do not count where objects are compared: where their content lies."""

    _closed = False
    _given: frozenset[str] = frozenset()
    """Cached properties that were given a value, which counts as content."""

    @property
    def closed(self) -> bool:
        return self._closed

    def __setattr__(self, name: str, value: Any) -> None:
        if self._closed:
            hint = f"use replaced({name}=...) for a copy"
            raise AttributeError(f"a {type(self).__name__} does not change: {hint}")
        self._set(name, value)

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)
        if is_computed(self, name):  # now it is given
            vars(self)["_given"] = self._given | {name}

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a {type(self).__name__} does not change")

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self is other or same(content_of(self), content_of(other))

    def __hash__(self) -> int:
        return hash((type(self), mark(content_of(self))))

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: not what is computed from the attributes, which may not be pickled."""
        return stored(self)

    def replaced(self: _Self, **attributes: Any) -> _Self:
        """A copy that shares all data with this object but for the given attributes.

        Cached properties are shared too. A dataclass checks the new values as its constructor does.
        Raises AttributeError if there is no attribute of a name.
        """
        for name in attributes:
            if name not in vars(self) and not hasattr(type(self), name):
                raise AttributeError(f"a {type(self).__name__} has no attribute {name!r}")
        other: _Self = object.__new__(type(self))
        vars(other).update(vars(self))
        for name, value in attributes.items():
            other._set(name, value)
        check = getattr(other, "__post_init__", None)
        if check is not None:
            object.__setattr__(other, "_closed", False)
            check()
            object.__setattr__(other, "_closed", True)
        return other
