"""Pictures of more and more samples."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, is_shortage, require
from nacre.io.memory import available_memory
from nacre.render.engine import mitsuba
from nacre.render.kernels import release_kernels
from nacre.runtime.interrupts import uninterrupted

PASS = 16
"""Samples per pixel that are rendered at a time, at most."""
_MAX_SAMPLES, _MAX_WAVEFRONT = 1 << 24, 1 << 21
"""Samples of all pixels that are rendered at a time: by one kernel, and in a wavefront."""
_SAMPLE_BYTES, _WAVEFRONT_BYTES = 32, 600
"""Memory of each of them, about."""
_PIXEL_BYTES, _DENOISER_BYTES = 128, 112
"""Memory of a pixel of the picture, its sums, and what writes it, about; and what the denoiser's
images add."""


def pass_sizes(counts: Sequence[int], largest: int = PASS) -> list[int]:
    """Samples per pixel of passes, up to `largest`, that stop at each of increasing counts."""
    sizes: list[int] = []
    for before, count in zip((0, *counts), counts, strict=False):
        whole, rest = divmod(count - before, largest)
        sizes += [largest] * whole + [rest] * (rest > 0)
    return sizes


def needs_wavefronts(scene: Any) -> bool:
    """Whether a BSDF of a scene says, by an attribute `wavefront`, that it is for these."""
    return any(getattr(shape.bsdf(), "wavefront", False) for shape in scene.shapes())


@dataclass(frozen=True)
class Plan:
    """How a picture is rendered a part at a time, so that memory stays bounded.

    By passes of some samples per pixel, at most, and some rows of pixels at a time.
    """

    samples: int
    rows: int


def plan_passes(
    width: int, height: int, spp: int, wavefront: bool = False, denoised: bool = False
) -> Plan:
    """The passes of a picture.

    Its paths may be traced one bounce at a time (:func:`wavefronts`); it may be denoised then.

    Raises
    ------
    NacreError
        If there is not memory enough for the picture.
    """
    limit = _MAX_WAVEFRONT if wavefront else _MAX_SAMPLES
    samples = max(1, min(PASS, spp, limit // (width * height)))
    rows = max(1, min(height, limit // (width * samples)))
    bytes_each = _WAVEFRONT_BYTES if wavefront else _SAMPLE_BYTES
    pixel_bytes = _PIXEL_BYTES + (_DENOISER_BYTES if denoised else 0)
    needed = width * height * pixel_bytes + width * rows * samples * bytes_each
    available = available_memory()
    if available is not None and needed > available:
        fitting = math.sqrt(available / needed)
        raise NacreError(
            f"a picture of {width} x {height} pixels takes about {needed / 2**30:.1f} GiB of "
            f"memory, and {available / 2**30:.1f} GiB are left: render {int(width * fitting)} x "
            f"{int(height * fitting)} pixels or fewer"
        )
    return Plan(samples, rows)


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
    scene: Any,
    sizes: Sequence[int],
    seed: int,
    rows: int | None = None,
    integrator: Any = None,
    channels: int = 3,
) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Render a scene pass by pass: samples per pixel so far, and their mean.

    The picture is linear RGB, or what an integrator in place of the scene's gives; shape (height,
    width, channels). The same seed gives the same pictures, but for the rounding of sums whose
    order the renderer's threads decide.

    Parameters
    ----------
    sizes
        Samples per pixel of each pass, at least 1.
    rows
        Rows of pixels to render at a time; all where None.

    Raises
    ------
    NacreError
        If memory runs out.
    """
    mi = mitsuba()
    release_kernels()
    width, height = (int(v) for v in scene.sensors()[0].film().crop_size())
    starts = range(0, height, rows or height)
    seeds = np.random.SeedSequence(seed).generate_state(len(sizes) * len(starts))
    total = np.zeros((height, width, channels))
    done = 0
    for index, samples in enumerate(sizes):
        for start, part_seed in zip(starts, seeds[index * len(starts) :], strict=False):
            part = slice(start, min(start + starts.step, height))
            with _cropped(mi, scene, part, height), uninterrupted(), _shortages():
                # Mitsuba makes an error of its own of what ends it.
                picture = mi.render(scene, integrator=integrator, spp=samples, seed=int(part_seed))
                total[part] += samples * np.array(picture, np.float64)
        done += samples
        yield done, total / done


@contextmanager
def _cropped(mi: Any, scene: Any, part: slice, height: int) -> Iterator[None]:
    """A block in which the scene's first film shows some of its rows only."""
    if part.stop - part.start == height:
        yield
        return
    sensor = scene.sensors()[0]
    width, _ = sensor.film().crop_size()
    left, top = sensor.film().crop_offset()
    parameters = mi.traverse(sensor)

    def crop(offset: int, rows: int) -> None:
        parameters["film.crop_size"] = mi.ScalarVector2u(width, rows)
        parameters["film.crop_offset"] = mi.ScalarPoint2u(left, offset)
        parameters.update()

    crop(top + part.start, part.stop - part.start)
    try:
        yield
    finally:
        crop(top, height)


@contextmanager
def _shortages() -> Iterator[None]:
    """A block whose want of memory is told in a line."""
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        if is_shortage(error):
            raise NacreError("memory ran out while rendering: render fewer pixels") from error
        raise
