"""How fast scenes render, side by side."""

from __future__ import annotations

import time
from collections.abc import Mapping
from operator import truediv
from statistics import median
from typing import Any

from nacre.errors import NacreError, require
from nacre.mitsuba.engine import mitsuba
from nacre.runtime.progress import Progress

_WARM_UP = 2
"""Renderings before the first round: they compile, and wake the threads."""


def race(
    scenes: Mapping[str, Any],
    baseline: str,
    *,
    rounds: int,
    spp: int,
    progress: Progress | None = None,
) -> dict[str, tuple[float, list[float]]]:
    """Render every scene in every round, so that a busy machine slows all of them alike.

    The median over rounds of the seconds that a rendering takes; and in each round the speed
    relative to that of the scene that `baseline` names.

    Raises NacreError if a kernel was compiled during a round: its time would be no rendering time.
    """
    mi, dr = mitsuba(), require("drjit", "render")
    total, done = len(scenes) * (_WARM_UP + rounds), 0

    def render(name: str, seed: int) -> float:
        nonlocal done
        dr.sync_thread()
        start = time.perf_counter()
        dr.eval(mi.render(scenes[name], spp=spp, seed=seed))
        dr.sync_thread()
        seconds = time.perf_counter() - start
        done += 1
        if progress:
            progress("timing", done, total, name)
        return seconds

    for name in scenes:
        for seed in range(_WARM_UP):
            render(name, seed)
    times: dict[str, list[float]] = {name: [] for name in scenes}
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        for seed in range(_WARM_UP, _WARM_UP + rounds):
            for name in scenes:
                times[name].append(render(name, seed))
                kernels = dr.kernel_history([dr.KernelType.JIT])
                if not all(kernel["cache_hit"] for kernel in kernels):
                    raise NacreError(f"{name}: a kernel was compiled during the measurement")
    return {
        name: (median(seconds), list(map(truediv, times[baseline], seconds)))
        for name, seconds in times.items()
    }
