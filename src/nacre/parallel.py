"""Array work spread over the cores of this machine."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

_In = TypeVar("_In")
_Out = TypeVar("_Out")


def core_count() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def thread_map(function: Callable[[_In], _Out], items: Iterable[_In]) -> Iterator[_Out]:
    """`map(function, items)` with one thread a core, in order.

    Matrix products inside `function` run on one thread each: a library's own threads on top of
    these would only fight for the cores.
    """
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(core_count()) as pool:
        yield from pool.map(function, items)
