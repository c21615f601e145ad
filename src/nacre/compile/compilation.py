"""Compiled functions, kept on disk from one process to the next as machine code alone.

Numba's own cache loads Numba before the code, which takes as long as a draft fit; and it knows a
function by its module alone, so it misses a change of the modules whose code is compiled into it.
Here every combination of code, libraries and processor has a folder of object files, and Numba is
imported only to make one.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib
import importlib.util
import threading
from array import array
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nacre.compile.code_folder import code_folder
from nacre.compile.machine_code import function_type, kept, load
from nacre.errors import NacreError
from nacre.io.memory import available_memory

_MIN_MEMORY = 256 << 20  # compiling the kernel of a fit takes half of it
_SOURCES = ("compilation.py", "emitter.py", "machine_code.py", "numba_code.py", "vector_code.py")
_WORD = (1 << 64) - 1

_lock = threading.Lock()


class Packed(NamedTuple):
    """Arguments of compiled functions as their code takes them."""

    kinds: tuple[str, ...]
    """Type of each: of a scalar its dtype, "float32"; of an array also dimensions and whether it is
    contiguous: "float32 2C", else "float32 2A"."""
    words: tuple[int, ...]
    """What they are in words of 64 bits: of an array its places and sizes."""
    held: tuple[Any, ...]
    """The arguments, so that their memory stays."""


@cache
def _kind(dtype: np.dtype[Any], dimensions: int, contiguous: bool) -> str:
    return f"{dtype} {dimensions}{'C' if contiguous else 'A'}"


def pack(*arguments: Any) -> Packed:
    """Arrays and numbers for calls of compiled functions, made ready once for many calls."""
    kinds: list[str] = []
    words: list[int] = []
    for argument in arguments:
        if isinstance(argument, Packed):
            kinds += argument.kinds
            words += argument.words
        elif isinstance(argument, np.ndarray):
            kinds.append(_kind(argument.dtype, argument.ndim, argument.flags.c_contiguous))
            words += 0, 0, argument.size, argument.itemsize, argument.ctypes.data
            words += argument.shape
            words += (stride & _WORD for stride in argument.strides)
        else:
            number = np.asarray(argument, np.int64 if type(argument) is int else None)
            kinds.append(number.dtype.name)
            words.append(int.from_bytes(number.tobytes(), "little"))
    return Packed(tuple(kinds), tuple(words), arguments)


class Compiled:
    """A function of a module that Numba compiles, once per machine and kinds of arguments.

    `place` is "module:function", marked by :data:`nacre.compile.numba_code.compiled`. Arguments are
    arrays, numbers of Python or NumPy, and what :func:`pack` made of them. The interpreter lock is
    free meanwhile. Calls raise NacreError if there is too little memory to compile, and MemoryError
    if the code reports a failure.
    """

    def __init__(self, place: str) -> None:
        self._module, _, self._name = place.partition(":")
        self._loaded: dict[tuple[str, ...], tuple[Any, Any]] = {}

    def __call__(self, *arguments: Any) -> None:
        packed = pack(*arguments)
        found = self._loaded.get(packed.kinds) or self._load(packed.kinds)
        words = array("Q", packed.words)
        if found[0](words.buffer_info()[0]):
            raise MemoryError

    def _load(self, kinds: tuple[str, ...]) -> tuple[Any, Any]:
        with _lock:
            if kinds not in self._loaded:
                left = available_memory()
                if left is not None and left < _MIN_MEMORY:  # LLVM would hang
                    few = f"{left >> 20} MiB of memory are left, too few to compile"
                    raise NacreError(f"{few}: free some, or raise ulimit -v")
                name = hashlib.sha256(repr((self._module, kinds)).encode()).hexdigest()[:16]
                path = cache_folder(_source(self._module).parent) / f"{self._name}-{name}.o"
                code = kept(path, lambda: self._compile(kinds))
                self._loaded[kinds] = load(code, function_type(ctypes.c_void_p))
            return self._loaded[kinds]

    def _compile(self, kinds: tuple[str, ...]) -> bytes:
        from nacre.compile.numba_code import object_code

        function = getattr(importlib.import_module(self._module), self._name)
        code: bytes = object_code(function, kinds)
        return code


def _source(module: str) -> Path:
    found = importlib.util.find_spec(module)
    return Path(str(found and found.origin))


@cache
def cache_folder(source: Path) -> Path:
    """Where compiled functions of the modules in a folder are kept for this processor."""
    here, version = Path(__file__).parent, _source("numba").with_name("_version.py")
    sources = [*(here / name for name in _SOURCES), version, *sorted(source.glob("*.py"))]
    return code_folder("kernel", sources)
