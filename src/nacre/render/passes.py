"""Pictures of more and more samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.render.engine import mitsuba

PASS = 16
"""Most samples per pixel that are rendered at a time: memory grows with them."""


def pass_sizes(counts: Sequence[int]) -> list[int]:
    """Samples per pixel of passes that stop at each of some increasing counts."""
    sizes: list[int] = []
    for before, count in zip((0, *counts), counts, strict=False):
        whole, rest = divmod(count - before, PASS)
        sizes += [PASS] * whole + [rest] * (rest > 0)
    return sizes


def accumulate(
    scene: Any, sizes: Sequence[int], seed: int
) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Render a scene pass by pass.

    Parameters
    ----------
    scene
        Of `mitsuba.load_dict`.
    sizes
        Samples per pixel of each pass, at least 1.
    seed
        Of the samples: the same seed gives the same pictures, but for the rounding of sums whose
        order the renderer's threads decide.

    Yields
    ------
    count
        Samples per pixel so far.
    picture
        Their mean: linear RGB, shape (height, width, 3).
    """
    mi = mitsuba()
    seeds = np.random.SeedSequence(seed).generate_state(len(sizes))
    total: npt.NDArray[np.float64] | float = 0.0
    done = 0
    for samples, pass_seed in zip(sizes, seeds, strict=True):
        picture = np.array(mi.render(scene, spp=samples, seed=int(pass_seed)), np.float64)
        total = total + samples * picture
        done += samples
        yield done, total / done
