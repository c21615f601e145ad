"""Array work spread over the cores of this machine."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import TypeVar

from threadpoolctl import threadpool_limits

_In = TypeVar("_In")
_Out = TypeVar("_Out")


def core_count() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def one_blas_thread() -> AbstractContextManager[object]:
    """A block in which matrix products run on one thread each.

    A library's own threads on top of ours would only fight for the cores, and their number would
    decide the last bits of results. Of blocks that overlap in several threads the first one counts.
    """
    return threadpool_limits(1, "blas")  # type: ignore[no-any-return]


def thread_map(function: Callable[[_In], _Out], items: Iterable[_In]) -> Iterator[_Out]:
    """`map(function, items)` with one thread a core, in order; see :func:`one_blas_thread`."""
    with one_blas_thread():
        pool = ThreadPoolExecutor(core_count())
        try:
            yield from pool.map(function, items)
        finally:  # an error or an interrupt must not wait for what has not begun
            pool.shutdown(cancel_futures=True)
