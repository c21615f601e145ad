"""Formulas on pairs of vectors as machine code, which is kept on disk."""

from __future__ import annotations

import ctypes
import hashlib
import threading
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import llvmlite.binding as llvm
import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Weights
from nacre.compile.code_folder import code_folder
from nacre.compile.machine_code import function_type, kept, load, target
from nacre.compile.trace import FLOAT, MASK, Trace
from nacre.compile.vector_code import LANES, Program, module
from nacre.runtime.parallel import thread_slices

Outputs: TypeAlias = tuple[Array | Components, ...]
Formula: TypeAlias = Callable[[Components, Components], tuple[Outputs, Array]]
"""From two vectors to arrays, of a value or a vector each, and whether an input is at fault."""

_PARALLEL = 100_000  # pairs from which all cores work
_SLICE = 1 << 15  # pairs that a core takes at a time
_SOURCES = ("trace.py", "elementary.py", "vector_code.py", "vectorized.py", "machine_code.py")

_lock = threading.Lock()
_loaded: dict[Program, tuple[Any, Any]] = {}


class VectorFunction:
    """A formula as machine code, called once with traced components.

    Raises TypeError, AttributeError or ValueError if it uses more than the functions of
    :class:`nacre.array.Namespace`.
    """

    def __init__(self, formula: Formula) -> None:
        trace = Trace()
        x, y, z, u, v, w = (trace.input(index) for index in range(6))
        outputs, fault = formula((x, y, z), (u, v, w))
        values = [[trace.as_value(c, FLOAT) for c in _parts(output)] for output in outputs]
        numbers = tuple(tuple(value.number for value in output) for output in values)
        program = Program(tuple(trace.operations), numbers, trace.as_value(fault, MASK).number)
        self._widths = [len(output) for output in values]
        self._numbers = np.array([*trace.numbers, 0.0], np.float32)
        self._tables = trace.tables
        self._pointers = _pointers(self._tables)
        self._run = _compiled(program)

    def __call__(self, a: Weights, b: Weights) -> tuple[list[Weights], bool]:
        """Arrays of shape (n, 3) or (n,) for n pairs of vectors (n, 3), contiguous, and whether one
        was at fault.
        """
        count = len(a)
        outputs = [np.empty((count, 3) if w == 3 else count, np.float32) for w in self._widths]
        faults = thread_slices(
            lambda part: self._part(a[part], b[part], [output[part] for output in outputs]),
            count,
            _SLICE if count >= _PARALLEL else count,
        )
        return outputs, any(faults)

    def _part(self, a: Weights, b: Weights, outputs: Sequence[Weights]) -> bool:
        whole = len(a) // LANES * LANES
        fault = self._panels(a[:whole], b[:whole], outputs) if whole else False
        if whole == len(a):
            return fault
        # The last panel is filled up with copies of the last pair.
        left = np.minimum(np.arange(whole, whole + LANES), len(a) - 1)
        padded = [np.empty((LANES, *output.shape[1:]), np.float32) for output in outputs]
        fault |= self._panels(a[left], b[left], padded)
        for output, values in zip(outputs, padded, strict=True):
            output[whole:] = values[: len(a) - whole]
        return fault

    def _panels(self, a: Weights, b: Weights, outputs: Sequence[Weights]) -> bool:
        where = _pointers(outputs)
        arrays = a, b, self._numbers, self._pointers, where
        return bool(self._run(len(a) // LANES, *(array.ctypes.data for array in arrays)))


def _parts(output: Array | Components) -> Sequence[Array]:
    return output if isinstance(output, tuple) else (output,)


def _pointers(arrays: Sequence[npt.NDArray[Any]]) -> npt.NDArray[np.uintp]:
    return np.array([*(array.ctypes.data for array in arrays), 0], np.uintp)


def _compiled(program: Program) -> Any:
    """A program's function, compiled once per machine, that needs no interpreter lock."""
    with _lock:
        if program not in _loaded:
            kind = function_type(ctypes.c_int64, *[ctypes.c_void_p] * 5)
            _loaded[program] = load(_code(program), kind)
        return _loaded[program][0]


@cache
def _folder() -> Path:
    here = Path(__file__).parent
    return code_folder("formulas", [here / name for name in _SOURCES])


def _code(program: Program) -> bytes:
    """The object file of a program, from the disk if it is there."""
    name = hashlib.sha256(repr(program).encode()).hexdigest()[:32]
    path = _folder() / f"{name}.o"
    return kept(path, lambda: target().emit_object(llvm.parse_assembly(str(module(program)))))
