"""Families of things by name: built-in members, and those that other packages bring.

A package adds a member by an entry point: in its `pyproject.toml`, under
`[project.entry-points."nacre.models"]`, the line `mine = "my_package:MyModel"`. See
`docs/extending.md`.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from typing import Any, Generic, TypeVar

from nacre.errors import DISTRIBUTION, NacreError, did_you_mean, reason

_Member = TypeVar("_Member")


class Registry(Mapping[str, _Member], Generic[_Member]):
    """The members of a family by name; each is imported when it is first asked for.

    Built-in members have a place, `module:attribute`, and come in that order, before those that
    other packages add by entry points in a `group` like `nacre.formats` if `builtin_first`. Members
    are instances or subclasses of `base`, which is checked for those from other packages; `what`
    they are called in messages is, for example, "format".
    """

    def __init__(
        self,
        group: str,
        what: str,
        builtin: Mapping[str, str],
        base: type | None = None,
        *,
        builtin_first: bool = True,
    ) -> None:
        self.group, self.what, self._base = group, what, base
        self._builtin_first = builtin_first
        self._places = dict(builtin)
        self._members: dict[str, _Member] = {}
        self._entry_points: dict[str, metadata.EntryPoint] | None = None

    def __getitem__(self, name: str) -> _Member:
        """The member of a name.

        Raises KeyError if there is none, NacreError if another package brings it and it does not
        load.
        """
        if name not in self._members:
            if name in self._places:
                module, _, attribute = self._places[name].partition(":")
                self._members[name] = getattr(importlib.import_module(module), attribute)
            else:
                self._members[name] = self._load(self._installed()[name])
        return self._members[name]

    def __iter__(self) -> Iterator[str]:
        known = dict.fromkeys((*self._members, *self._installed()))
        others = [name for name in known if name not in self._places]
        return iter((*self._places, *others) if self._builtin_first else (*others, *self._places))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def members(self, names: Iterable[str] | None = None) -> Iterator[tuple[str, _Member]]:
        """All names and members, or those of some names; one from another package that does not
        load is left out with a warning, for a broken plugin must not take everything else with it.
        """
        for name in self if names is None else names:
            try:
                yield name, self[name]
            except NacreError as error:
                warnings.warn(str(error), RuntimeWarning, stacklevel=2)

    def package(self, name: str) -> str:
        """The package that brings a member by an entry point; empty for a built-in one."""
        point = None if name in self._places else self._installed().get(name)
        return point.dist.name if point is not None and point.dist else ""

    def register(self, name: str, member: _Member) -> None:
        """Add a member in this process.

        Raises NacreError if there is one of this name, or it is not what members are.
        """
        if name in self:
            raise NacreError(f"there is a {self.what} {name!r} already")
        self._check(name, member)
        self._members[name] = member

    def find(self, name: str) -> _Member:
        """The member of a name that a user gave.

        Raises NacreError if there is none, with similar names, else all; and as for an item.
        """
        if name not in self:
            hint = did_you_mean(name, self, f"known: {', '.join(self)}")
            raise NacreError(f"{name!r} is no known {self.what}{hint}")
        return self[name]

    def _installed(self) -> dict[str, metadata.EntryPoint]:
        if self._entry_points is None:
            found = metadata.entry_points(group=self.group)
            # Of one name, nacre's own comes last and is kept: no package takes it.
            ordered = sorted(found, key=lambda e: (e.name, _is_own(e)))
            self._entry_points = {e.name: e for e in ordered}
        return self._entry_points

    def _load(self, entry_point: metadata.EntryPoint) -> _Member:
        try:
            member: _Member = entry_point.load()
        except Exception as error:  # other people's code fails in any way
            package = entry_point.dist.name if entry_point.dist else entry_point.value
            raise NacreError(
                f"{self.what} {entry_point.name!r} of the package {package} does not load: "
                f"{reason(error)}"
            ) from error
        self._check(entry_point.name, member)
        return member

    def _check(self, name: str, member: Any) -> None:
        base = self._base
        is_one = isinstance(member, type) and base is not None and issubclass(member, base)
        if not (base is None or is_one or isinstance(member, base)):
            raise NacreError(f"{self.what} {name!r} is not a {base.__module__}.{base.__qualname__}")


def _is_own(entry_point: metadata.EntryPoint) -> bool:
    return entry_point.dist is not None and entry_point.dist.name == DISTRIBUTION
