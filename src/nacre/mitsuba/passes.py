"""Rendering in passes, so that memory stays bounded."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.color import xyz_to_rgb
from nacre.errors import NacreError, is_shortage, require
from nacre.io.memory import available_memory
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.kernels import release_kernels
from nacre.runtime.interrupts import uninterrupted

PASS = 16
"""The most samples per pixel in one pass."""
# The most samples of all pixels in one pass, and about how much memory each takes.
_MAX_SAMPLES, _SAMPLE_BYTES = 1 << 24, 32
_MAX_WAVEFRONT, _WAVEFRONT_BYTES = 1 << 21, 600
# About how much memory a pixel takes: the picture, sums, and writing; and the denoiser's images.
_PIXEL_BYTES, _DENOISER_BYTES = 128, 112


def pass_sizes(counts: Sequence[int], largest: int = PASS) -> list[int]:
    """Samples per pixel of each pass, at most `largest`; passes end at each increasing count."""
    sizes: list[int] = []
    for before, count in zip((0, *counts), counts, strict=False):
        whole, rest = divmod(count - before, largest)
        sizes += [largest] * whole + [rest] * (rest > 0)
    return sizes


def needs_wavefronts(scene: Any) -> bool:
    """Whether a BSDF of a scene asks for :func:`wavefronts`, by its attribute `wavefront`."""
    return any(getattr(shape.bsdf(), "wavefront", False) for shape in scene.shapes())


class Plan(NamedTuple):
    """The most samples per pixel in a pass, and the rows of pixels to render at a time."""

    samples: int
    rows: int


def plan_passes(
    width: int, height: int, spp: int, wavefront: bool = False, denoised: bool = False
) -> Plan:
    """How to render a picture within the memory that there is.

    Raises NacreError if there is not enough memory for the picture.
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
    """Trace paths one bounce at a time, all paths that hit the same BSDF together.

    One kernel for whole paths is faster unless a BSDF costs far more than tracing: sixteen paths
    run together in such a kernel, and all sixteen pay for what one of them hits.
    """
    dr: Any = require("drjit", "render")
    whole, flag = dr.scoped_set_flag, dr.JitFlag
    # In a condition that is recorded, calls would be recorded as well.
    loops, calls = whole(flag.SymbolicLoops, False), whole(flag.SymbolicCalls, False)
    with loops, calls, whole(flag.SymbolicConditionals, False):
        yield


def accumulate(
    scene: Any,
    sizes: Sequence[int],
    seed: int,
    rows: int | None = None,
    integrator: Any = None,
    channels: int = 3,
) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Render a scene in passes of some `sizes`; yields samples per pixel so far, and their mean.

    The picture is linear RGB, or the output of `integrator` in place of the scene's; its shape is
    (height, width, channels). `rows` of pixels are rendered at a time, by default all. The same
    seed gives the same pictures, except for rounding in sums whose order depends on threads.

    Raises NacreError if memory runs out.
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
                # Interrupts wait: Mitsuba would turn them into an error of its own.
                picture = mi.render(scene, integrator=integrator, spp=samples, seed=int(part_seed))
                values = np.array(picture, np.float64)
                total[part] += samples * (
                    values if integrator is not None else _colors(scene, values)
                )
        done += samples
        yield done, total / done


def _colors(scene: Any, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Linear RGB, shape (height, width, 3), of what a scene's film holds: luminance, RGB or XYZ,
    with or without alpha, before what an integrator of more than colors adds.

    Raises NacreError for a film of other channels.
    """
    film = str(scene.sensors()[0].film())
    match = re.search(r"pixel_format = (ya?|rgba?|xyza?),", film)
    if match is None:
        kind = film.partition("[")[0]
        raise NacreError(f"the scene's film is a {kind}, which has no colors; make it an hdrfilm")
    if match[1].startswith("y"):  # luminance
        return np.repeat(values[..., :1], 3, axis=-1)
    return xyz_to_rgb(values[..., :3]) if match[1].startswith("xyz") else values[..., :3]


@contextmanager
def _cropped(mi: Any, scene: Any, part: slice, height: int) -> Iterator[None]:
    """Crop the scene's first film to some of its rows."""
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
    """Turn an out-of-memory error into a NacreError."""
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        if is_shortage(error):
            raise NacreError("memory ran out while rendering: render fewer pixels") from error
        raise
