"""Rendering in passes, so that memory stays bounded."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, is_shortage, require
from nacre.io.memory import available_memory
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.kernels import release_kernels
from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.store import SAVE_EVERY, Store

PASS = 16
"""The most samples per pixel in one pass."""
WHOLE = 1 << 22
"""The most samples of all pixels in one pass where passes are as long as they may be: more take
seconds, for which Ctrl-C would wait."""

# The most samples of all pixels in one pass, and about how much memory each takes.
_MAX_SAMPLES, _SAMPLE_BYTES = 1 << 24, 32
_MAX_WAVEFRONT, _WAVEFRONT_BYTES = 1 << 21, 600
# About how much memory a pixel of three channels takes: the picture, sums, and writing; and one of
# the denoiser's images.
_COLOR_BYTES, _DENOISER_BYTES = 128, 112


def pass_sizes(counts: Sequence[int], largest: int = PASS) -> list[int]:
    """Samples per pixel of each pass, at most `largest`; passes end at each increasing count."""
    sizes: list[int] = []
    for before, count in zip((0, *counts), counts, strict=False):
        whole, rest = divmod(count - before, largest)
        sizes += [largest] * whole + [rest] * (rest > 0)
    return sizes


def needs_wavefronts(scene: Any) -> bool:
    """Whether a BSDF of a scene asks for :func:`wavefronts`, by its attribute `wavefront`.

    BSDFs within others, and those of shape groups, are asked too.
    """
    return any(getattr(part, "wavefront", False) for part in mitsuba().traverse(scene).hierarchy)


class Plan(NamedTuple):
    """The most samples per pixel in a pass, and the rows of pixels to render at a time."""

    samples: int
    rows: int


def plan_passes(
    width: int,
    height: int,
    spp: int,
    wavefront: bool = False,
    denoised: bool = False,
    channels: int = 3,
    largest: int = PASS,
) -> Plan:
    """How to render a picture within the memory that there is.

    Passes have at most `largest` samples per pixel. Raises NacreError if there is not enough memory
    for the picture.
    """
    limit = _MAX_WAVEFRONT if wavefront else _MAX_SAMPLES
    samples = max(1, min(largest, spp, limit // (width * height)))
    rows = max(1, min(height, limit // (width * samples)))
    bytes_each = _WAVEFRONT_BYTES if wavefront else _SAMPLE_BYTES
    pixel_bytes = _COLOR_BYTES * channels // 3 + (_DENOISER_BYTES if denoised else 0)
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


class Accumulation:
    """A scene rendered in passes, whose mean so far can be had at any time.

    The picture is what Mitsuba's film holds, with all its channels, before it is written.

    Parameters
    ----------
    scene
        Mitsuba's scene.
    sizes
        Samples per pixel of each pass.
    seed
        The same seed gives the same pictures, except for rounding where a film's filter reaches
        beyond a pixel: threads add to it in any order.
    rows
        Rows of pixels to render at a time; by default all.
    integrator
        In place of the scene's.
    sensor
        Number of the sensor.
    own_seed
        Whether the first part is rendered with Mitsuba's seed `seed`, not with one made from it: a
        picture in one part is then the one that Mitsuba renders.
    store
        Keeps what is rendered, for another process to go on; the caller removes it.
    name
        Of this picture in the store.
    """

    def __init__(
        self,
        scene: Any,
        sizes: Sequence[int],
        seed: int,
        rows: int | None = None,
        integrator: Any = None,
        sensor: int = 0,
        own_seed: bool = False,
        store: Store | None = None,
        name: str = "",
    ) -> None:
        self._scene, self._integrator, self._sensor = scene, integrator, sensor
        self._store, self._name, self._began = store or Store(None), name, time.monotonic()
        self._film = scene.sensors()[sensor].film()
        width, height = (int(v) for v in self._film.crop_size())
        starts = range(0, height, rows or height)
        self._parts = [slice(start, min(start + starts.step, height)) for start in starts]
        self._steps = [(samples, part) for samples in sizes for part in self._parts]
        self._taken = 0
        seeds = np.random.SeedSequence(seed).generate_state(len(sizes) * len(starts))
        self._seeds = [int(each) for each in seeds]
        if own_seed:
            self._seeds[0] = seed
        self._counts = np.zeros((height, 1, 1))
        self._total: npt.NDArray[np.float64] = np.zeros((height, width, 0))
        self.bitmap: Any = None
        """Mitsuba's picture of the last part."""

    def passes(self) -> Iterator[int]:
        """Render; yields the samples per pixel so far after each pass.

        Raises NacreError if memory runs out, or the store keeps another picture.
        """
        mi = mitsuba()
        release_kernels()
        self._restore()
        for number in range(self._taken, len(self._steps)):
            samples, part = self._steps[number]
            try:
                self._render(mi, part, samples, self._seeds[number])
            except KeyboardInterrupt:
                # What took no time is not worth a file.
                if time.monotonic() - self._began > SAVE_EVERY:
                    self._keep()
                raise
            if self._store.due(SAVE_EVERY):
                self._keep()
            if part is self._parts[-1]:
                yield self.done

    def _keep(self) -> None:
        """Put what is rendered into the store; the last part gives the picture its form, and is
        rendered again.
        """
        if self._taken < len(self._steps):
            with uninterrupted():
                state = {"taken": self._taken, "counts": self._counts, "total": self._total}
                self._store.save(state, self._name)

    def _restore(self) -> None:
        kept = self._store.load(self._name)
        if kept is None:
            return
        with self._store.readable(self._name):
            taken, counts, total = kept["taken"], kept["counts"], kept["total"]
            if counts.shape != self._counts.shape or total.shape[:2] != self._total.shape[:2]:
                raise ValueError(f"the picture is {total.shape}")
            if type(taken) is not int or not 0 <= taken < len(self._steps):
                raise ValueError(f"part {taken!r:.20} of {len(self._steps)}")
            self._taken, self._counts, self._total = taken, counts.copy(), total.copy()

    @property
    def done(self) -> int:
        """Samples per pixel so far, those of an interrupted pass too."""
        return int(self._counts.min())

    def _render(self, mi: Any, part: slice, samples: int, seed: int) -> None:
        with self._cropped(mi, part), uninterrupted(), _shortages():
            # Interrupts wait: Mitsuba would turn them into an error of its own, and what is
            # rendered counts.
            mi.render(
                self._scene,
                sensor=self._sensor,
                integrator=self._integrator,
                spp=samples,
                seed=seed,
            )
            self.bitmap = self._film.bitmap()
            values = np.array(self.bitmap, np.float64)
            values = values.reshape(*values.shape[:2], -1)
            if not self._total.size:
                self._total = np.zeros((*self._total.shape[:2], values.shape[-1]))
            self._total[part] += samples * values
            self._counts[part] += samples
            self._taken += 1

    def mean(self) -> npt.NDArray[np.float64]:
        """The picture so far, shape (height, width, channels): 0 where nothing is rendered yet."""
        return self._total / np.maximum(self._counts, 1.0)

    @contextmanager
    def _cropped(self, mi: Any, part: slice) -> Iterator[None]:
        """Crop the film to some of its rows."""
        if len(self._parts) == 1:
            yield
            return
        width, height = (int(v) for v in self._film.crop_size())
        left, top = self._film.crop_offset()
        parameters = mi.traverse(self._scene.sensors()[self._sensor])

        def crop(offset: int, rows: int) -> None:
            parameters["film.crop_size"] = mi.ScalarVector2u(width, rows)
            parameters["film.crop_offset"] = mi.ScalarPoint2u(left, offset)
            parameters.update()

        crop(top + part.start, part.stop - part.start)
        try:
            yield
        finally:
            crop(top, height)


def accumulate(
    scene: Any,
    sizes: Sequence[int],
    seed: int,
    rows: int | None = None,
    integrator: Any = None,
    store: Store | None = None,
    name: str = "",
) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
    """Render a scene in passes of some `sizes`; yields samples per pixel so far, and their mean.

    See :class:`Accumulation`, whose arguments these are.
    """
    accumulation = Accumulation(scene, sizes, seed, rows, integrator, store=store, name=name)
    for done in accumulation.passes():
        yield done, accumulation.mean()


@contextmanager
def _shortages() -> Iterator[None]:
    """Turn an out-of-memory error into a NacreError."""
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        if is_shortage(error):
            raise NacreError("memory ran out while rendering: render fewer pixels") from error
        raise
