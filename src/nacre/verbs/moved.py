"""Names of 0.2 in `nacre.render` and `nacre.export`, which were rooms and are verbs now.

`nacre.render.register()` still works, with a DeprecationWarning that says what to write, and so do
`from nacre.render import register` and `import nacre.render`. To go with the next minor release:
this module, `nacre/render.py` and `nacre/export.py`.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from nacre.verbs import exporting, rendering

_ROOMS = {"nacre.render": "nacre.mitsuba", "nacre.export": "nacre.targets"}
"""Where the contents of a room are now."""


class Verb:
    """A function that also has what a room of its name had."""

    def __init__(self, name: str, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        self.__name__, self._old = name.rpartition(".")[2], name
        # As a package has them, for `from nacre.export.source import Language`.
        self.__path__: list[str] = []
        self.__spec__ = ModuleSpec(name, None, is_package=True)

    def __call__(self, *arguments: Any, **settings: Any) -> Any:
        return self.__wrapped__(*arguments, **settings)

    def __repr__(self) -> str:
        return f"<function {self._old}>"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        new = f"{_ROOMS[self._old]}.{name}"
        try:
            found = getattr(importlib.import_module(_ROOMS[self._old]), name)
        except AttributeError:
            if importlib.util.find_spec(new) is None:
                raise AttributeError(f"{self._old} is a function and has no {name!r}") from None
            found = importlib.import_module(new)
        _warn(f"{self._old}.{name}", new, 3)
        return found


class _Finder(MetaPathFinder, Loader):
    """Imports of modules that were in a room, such as `nacre.export.source`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        new = _renamed(fullname)
        if new is None or importlib.util.find_spec(new) is None:
            return None
        return ModuleSpec(fullname, self)

    def exec_module(self, module: ModuleType) -> None:
        """Put the module in its place of today where that of this name is expected."""
        new = _renamed(module.__name__)
        assert new is not None
        _warn(module.__name__, new, 3)
        sys.modules[module.__name__] = importlib.import_module(new)


def _renamed(name: str) -> str | None:
    """The name of today for a module below one of the rooms; None for any other."""
    for old, new in _ROOMS.items():
        if name.startswith(f"{old}."):
            return new + name.removeprefix(old)
    return None


def _warn(old: str, new: str, level: int) -> None:
    warnings.warn(f"{old} is now {new}", DeprecationWarning, stacklevel=level)


def take_place(name: str, verb: Verb) -> None:
    """Have imports of a module find a verb, and those of modules below it what is there now."""
    sys.modules[name] = verb  # type: ignore[assignment]
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


render = Verb("nacre.render", rendering.render)
export = Verb("nacre.export", exporting.export)
