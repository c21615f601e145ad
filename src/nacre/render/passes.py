"""Pictures of more and more samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, require
from nacre.render.engine import mitsuba
from nacre.runtime.interrupts import uninterrupted

PASS = 16
"""Most samples per pixel that are rendered at a time: memory grows with them."""
_WAVEFRONT, _WIDEST = 1 << 21, 1 << 23
"""Samples of all pixels in a wavefront, unless one of each is more; and the most that it has."""
_SAMPLE_BYTES = 600
"""Of a sample in a wavefront, about."""


def pass_sizes(counts: Sequence[int], most: int = PASS) -> list[int]:
    """Samples per pixel of passes, of `most` or fewer, that stop at each of increasing counts."""
    sizes: list[int] = []
    for before, count in zip((0, *counts), counts, strict=False):
        whole, rest = divmod(count - before, most)
        sizes += [most] * whole + [rest] * (rest > 0)
    return sizes


def needs_wavefronts(scene: Any) -> bool:
    """Whether a BSDF of a scene says, by an attribute `wavefront`, that it is for these."""
    return any(getattr(shape.bsdf(), "wavefront", False) for shape in scene.shapes())


def wavefront_pass(scene: Any) -> int:
    """Samples per pixel of a scene that memory is enough for in one wavefront.

    Raises
    ------
    NacreError
        If it is not enough for one.
    """
    width, height = scene.sensors()[0].film().crop_size()
    pixels = int(width * height)
    if pixels > _WIDEST:
        raise NacreError(
            f"{width} x {height} pixels take {pixels * _SAMPLE_BYTES / 2**30:.1f} GiB where "
            f"networks are evaluated at hits, which is done up to {_WIDEST:,} pixels; render "
            "fewer, or functions in a table"
        )
    return min(PASS, max(1, _WAVEFRONT // pixels))


@contextmanager
def wavefronts() -> Iterator[None]:
    """Paths are traced one bounce at a time, all that meet a BSDF together.

    One kernel for whole paths is faster, but where a BSDF costs far more than tracing: sixteen
    paths go together in it, and all sixteen pay for what one of them meets.
    """
    dr: Any = require("drjit", "render")
    whole, flag = dr.scoped_set_flag, dr.JitFlag
    with whole(flag.SymbolicLoops, False), whole(flag.SymbolicCalls, False):
        yield


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
        with uninterrupted():  # Mitsuba makes an error of its own of what ends it
            picture = np.array(mi.render(scene, spp=samples, seed=int(pass_seed)), np.float64)
        total = total + samples * picture
        done += samples
        yield done, total / done
