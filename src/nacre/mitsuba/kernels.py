"""Compiled kernels are released from time to time.

Dr.Jit keeps every kernel that it has compiled until the process ends. A material whose numbers are
literals has kernels of its own, so a process that renders one new material after another would keep
them all. LLVM also keeps about 0.8 kB for each distinct number that it has compiled, which Dr.Jit
cannot release: see `docs/results/endurance.md`.
"""

from __future__ import annotations

from nacre.errors import require

MAX_MATERIALS = 32
"""Materials whose kernels are kept; each takes about 440 kB for a small preview."""

_compiled = 0


def count_material() -> None:
    """Call this for each new BSDF whose numbers are literals in its kernels."""
    global _compiled
    _compiled += 1


def release_kernels() -> None:
    """Before a rendering: drop all kernels if more than :data:`MAX_MATERIALS` BSDFs were counted.

    Later renderings load theirs from Dr.Jit's cache on disk; pictures stay the same. Functions
    frozen by `drjit.freeze` are recorded again.
    """
    global _compiled
    if _compiled <= MAX_MATERIALS:
        return
    dr = require("drjit", "render")
    dr.sync_thread()
    dr.flush_kernel_cache()
    _compiled = 0
