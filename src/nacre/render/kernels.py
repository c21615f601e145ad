"""How many compiled kernels stay in memory.

Dr.Jit keeps every kernel that it has compiled until the process ends. A material whose numbers are
literals has kernels of its own, so a process that renders one new material after the other would
keep them all. Beside them, LLVM keeps each distinct number that it has compiled, about 0.8 kB,
which Dr.Jit cannot release: see `docs/results/endurance.md`.
"""

from __future__ import annotations

from nacre.errors import require

MAX_MATERIALS = 32
"""Materials whose kernels are kept at a time: some 440 kB each for a small preview."""

_compiled = 0


def count_material() -> None:
    """Note that a BSDF was made whose numbers are literals of its kernels."""
    global _compiled
    _compiled += 1


def release_kernels() -> None:
    """Before a rendering: drop all kernels once more than :data:`MAX_MATERIALS` BSDFs were noted.

    What is rendered after that takes its kernels from Dr.Jit's cache on the disk, and shows the
    same. Functions frozen by `drjit.freeze` are recorded again.
    """
    global _compiled
    if _compiled <= MAX_MATERIALS:
        return
    dr = require("drjit", "render")
    dr.sync_thread()
    dr.flush_kernel_cache()
    _compiled = 0
