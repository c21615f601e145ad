"""Array work spread over the cores of this machine."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import TypeVar

from threadpoolctl import LibController, ThreadpoolController

_In = TypeVar("_In")
_Out = TypeVar("_Out")


def core_count() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _OneBlasThread:
    """A limit that many blocks share: libraries know one number of threads, not one per block."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks = 0
        self._libraries: list[LibController] = []
        self._modules = 0
        self._before: list[int] = []

    def __enter__(self) -> None:
        with self._lock:
            if self._blocks == 0:
                self._find()
                self._before = [library.num_threads for library in self._libraries]
                for library in self._libraries:
                    _set_threads(library, 1)
            self._blocks += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._blocks -= 1
            if self._blocks == 0:
                for library, count in zip(self._libraries, self._before, strict=True):
                    _set_threads(library, count)

    def _find(self) -> None:
        """Look for libraries where modules, which may bring some, were imported since."""
        if self._modules != len(sys.modules):
            self._modules = len(sys.modules)
            self._libraries = ThreadpoolController().select(user_api="blas").lib_controllers


def _set_threads(library: LibController, count: int) -> None:
    """Set a library's number of threads from any thread.

    From 3.8 on, threadpoolctl ignores every thread but the one that set OpenBLAS's number last,
    unless that one is forgotten.
    """
    forget = getattr(library, "clear_controlling_thread", None)
    if forget is not None:
        forget(force=True)
    library.set_num_threads(count)
    if forget is not None:
        forget(force=True)


_ONE_BLAS_THREAD = _OneBlasThread()


def one_blas_thread() -> AbstractContextManager[None]:
    """A block in which matrix products run on one thread each.

    A library's own threads on top of ours would only compete for the cores, and their number would
    decide the last bits of results. Blocks may overlap, in one thread or several: libraries get
    their threads back when the last one ends.
    """
    return _ONE_BLAS_THREAD


_worker = threading.local()


def thread_slices(function: Callable[[slice], _Out], count: int, size: int) -> list[_Out]:
    """`function` of slices of `size` out of `count`, with one thread per core, in order.

    For functions without the interpreter lock. A thread of :func:`thread_map` or of this function,
    or one that called :func:`one_of_many`, does all of them itself: the others have work.
    """
    slices = [slice(start, start + size) for start in range(0, count, size)]
    cores = min(free_cores(), len(slices))
    if cores < 2:
        return [function(part) for part in slices]
    with ThreadPoolExecutor(cores, initializer=one_of_many) as pool:
        return list(pool.map(function, slices))


def free_cores() -> int:
    """Cores that this thread may spread its work over: one where the others have work."""
    return 1 if getattr(_worker, "busy", False) else core_count()


def one_of_many() -> None:
    """Say that this thread is one of as many as there are cores: it does its slices itself."""
    _worker.busy = True


def thread_map(function: Callable[[_In], _Out], items: Iterable[_In]) -> Iterator[_Out]:
    """`map(function, items)` with one thread per core, in order; see :func:`one_blas_thread`."""
    with one_blas_thread():
        pool = ThreadPoolExecutor(core_count(), initializer=one_of_many)
        try:
            yield from pool.map(function, items)
        finally:  # an error or an interrupt must not wait for what has not begun
            pool.shutdown(cancel_futures=True)
