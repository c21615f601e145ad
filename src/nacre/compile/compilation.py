"""Compiled functions, kept on disk from one process to the next.

Numba's own cache knows a function by its module alone: it misses a change of the modules whose
code is compiled into it, and processes on different processors that share a home directory can
mix up their files. Here every combination of code, libraries and processor has a folder of its own.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

from nacre.compile.code_folder import code_folder
from nacre.errors import NacreError
from nacre.io.memory import available_memory
from nacre.runtime.lock import exclusive

_MIN_MEMORY = 256 << 20  # compiling the kernel of a fit takes half of it

# Inlined, for a symbol of its own would be looked up in whatever this process has compiled so far:
# code with other roundings than what the next process loads from the disk.
inner = numba.njit(error_model="numpy", forceinline=True)
"""A function that becomes part of the compiled functions that call it."""
inner_fast = numba.njit(error_model="numpy", fastmath=True, forceinline=True)
"""One that may also reorder sums and takes all numbers to be finite."""


def compiled(function: Callable[..., Any]) -> Any:
    """A function that Numba compiles without the interpreter lock, once per machine.

    Compiled functions that it calls become part of it; they must lie in the same folder.
    """
    dispatcher = numba.njit(nogil=True, error_model="numpy", forceinline=True)(function)
    dispatcher._cache = _Cache(function)
    return dispatcher


@cache
def cache_folder(source: Path) -> Path:
    """Where compiled functions of the modules in a folder are kept for this processor."""
    return code_folder(
        "kernel", [Path(__file__), *sorted(source.glob("*.py"))], (numba.__version__,)
    )


class _Locator(_CacheLocator):  # type: ignore[misc]
    """Tells Numba the folder, whose name stands for the state of the source."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._py_file = function.__code__.co_filename
        self.folder = cache_folder(Path(self._py_file).parent)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], _py_file: str) -> _Locator:
        return cls(py_func)

    def get_cache_path(self) -> str:
        return str(self.folder)

    def get_source_stamp(self) -> str:
        return self.folder.name

    def get_disambiguator(self) -> str:
        return str(self._lineno)


class _Implementation(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class _Cache(FunctionCache):  # type: ignore[misc]
    """Numba's cache in that folder; functions are compiled anew if it cannot be used."""

    _impl_class = _Implementation

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        left = available_memory()
        if left is not None and left < _MIN_MEMORY:  # LLVM would hang
            few = f"{left >> 20} MiB of memory are left, too few to compile"
            raise NacreError(f"{few}: free some, or raise ulimit -v")
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a damaged file raises whatever unpickling does
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            folder = self._impl.locator.folder
            folder.mkdir(parents=True, exist_ok=True)
            # Two processes that add to the index at once would give two files the same name.
            with exclusive(folder / ".lock"):
                super().save_overload(sig, data)
