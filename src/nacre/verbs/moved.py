"""Names of 0.2 in `nacre.render` and `nacre.export`, which were rooms and are verbs now.

`nacre.render.register()` still works, with a DeprecationWarning that says what to write, and so do
`from nacre.render import register` and `import nacre.render`. That is why these two verbs are
modules that can be called. To go with the next minor release: this module, `nacre/render.py` and
`nacre/export.py`; the verbs are then the functions that they call.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import warnings
from collections.abc import Callable, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

_ROOMS = {"render": "nacre.mitsuba", "export": "nacre.targets"}
"""Where the contents of a room of this package are now."""


class Verb(ModuleType):
    """A module that is called as the function of its name, and has what a room of it had."""

    def __call__(self, *arguments: Any, **settings: Any) -> Any:
        return self.__wrapped__(*arguments, **settings)

    def __repr__(self) -> str:
        return f"<function {self.__name__}>"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        room = _ROOMS[self.__name__.rpartition(".")[2]]
        new = f"{room}.{name}"
        try:
            found = getattr(importlib.import_module(room), name)
        except AttributeError:
            if importlib.util.find_spec(new) is None:
                raise AttributeError(f"{self.__name__} is a function and has no {name!r}") from None
            found = importlib.import_module(new)
        _warn(f"{self.__name__}.{name}", new)
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
        _warn(module.__name__, new)
        sys.modules[module.__name__] = importlib.import_module(new)


def become(name: str, function: Callable[..., Any]) -> None:
    """Turn the module of a name, which is being imported, into a verb that calls a function."""
    module = sys.modules[name]
    module.__class__ = Verb
    # With a path it may have modules below it.
    vars(module).update(__wrapped__=function, __doc__=function.__doc__, __path__=[])
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


def _renamed(name: str) -> str | None:
    """The name of today for a module below one of the rooms; None for any other."""
    package, *rooms = name.split(".")
    if package != "nacre" or len(rooms) < 2 or rooms[0] not in _ROOMS:
        return None
    return ".".join([_ROOMS[rooms[0]], *rooms[1:]])


def _warn(old: str, new: str) -> None:
    words = f"{old} is now {new}; the old name works for one more minor release"
    warnings.warn(words, DeprecationWarning, stacklevel=3)
