"""A virtual gonioreflectometer: path tracing of a periodic surface for all lights at once.

For each view, rays of an orthographic camera pass through jittered points of a texel on the plane z
= 0, as in a rectified photograph: parallax displaces what lies above or below the plane, which also
hides and shadows. Instead they can pass through points of the surface, as in measurements that are
rectified with known heights. At each surface point of a path all directional lights are evaluated;
whether they reach a triangle is found beforehand. What each point behind the first adds to a
channel is limited to :data:`nacre.textures.capture.tracing.FIREFLY`, for single rare paths would
show as bright dots.
"""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from functools import cached_property
from itertools import groupby, pairwise, product
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices, TableBtf
from nacre.compile.compilation import Compiled
from nacre.errors import NacreError
from nacre.measured.textures.domes import below
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress
from nacre.textures.capture.mesostructure import Mesostructure

STEEPEST = 89.0  # largest polar angle in degrees
DEPTH = 3  # surface points of the longest paths

_SHADOW_RAYS = 1 << 18  # least number per light, over all triangles
_PART = 1 << 28  # bytes of values that are worked on at a time
_VISIBLE = 1 << 30  # bytes of what the triangles see of the lights that are worked on at a time
_IN_MEMORY = 1 << 31  # values of more bytes lie in a file without a name

_photograph = Compiled("nacre.textures.capture.tracing:photograph")
_visibility = Compiled("nacre.textures.capture.tracing:visibility")


def capture(
    surface: Mesostructure,
    wi: Floats,
    wo: Floats,
    width: int = 32,
    height: int | None = None,
    *,
    samples: int = 64,
    seed: int = 0,
    depth: int = DEPTH,
    on_surface: bool = False,
    name: str = "",
    progress: Progress | None = None,
) -> TableBtf:
    """Measure a periodic surface at pairs of directions; see :class:`Capture`.

    Raises what that and :meth:`Capture.table` do.
    """
    made = Capture(
        surface, wi, wo, width, height,
        samples=samples, seed=seed, depth=depth, on_surface=on_surface, name=name,
    )  # fmt: skip
    return made.table(progress)


class Capture(Btf):
    """A periodic surface, measured where and when values are asked for.

    The texture covers one period, so it tiles, with as many rows as columns unless told otherwise.
    A view costs as much for one light as for all that occur with any view: name the same lights for
    all views where there is a choice. More lights than fit in memory are taken in groups, each with
    the views that occur with it. The same seed gives the same values, whatever the number of
    threads and the order in which they are asked for. Values are rounded to half precision, as
    files hold them.

    Parameters
    ----------
    wi, wo
        Unit directions to the light and to the viewer, within :data:`STEEPEST`, shape (n, 3).
    samples
        Paths per texel and view.
    depth
        Largest number of surface points of a path; 1 leaves interreflection out.
    on_surface
        Whether texels are points of the surface, not of the plane: those of
        :meth:`nacre.textures.capture.mesostructure.Mesostructure.height_map`. Then they are the
        same points in all views, and show what hides these, if anything does.

    Raises
    ------
    ValueError
        If a direction is steeper, or a number is less than 1.
    """

    def __init__(
        self,
        surface: Mesostructure,
        wi: Floats,
        wo: Floats,
        width: int = 32,
        height: int | None = None,
        *,
        samples: int = 64,
        seed: int = 0,
        depth: int = DEPTH,
        on_surface: bool = False,
        name: str = "",
    ) -> None:
        height = width if height is None else height
        if wi.shape != wo.shape or wi.ndim != 2 or wi.shape[1] != 3 or not len(wi):
            raise ValueError(f"expected two arrays of shape (n, 3), got {wi.shape} and {wo.shape}")
        if not (below(wi, STEEPEST).all() and below(wo, STEEPEST).all()):
            raise ValueError(f"directions must lie within {STEEPEST:g} degrees, above the horizon")
        if min(width, height, samples, depth) < 1:
            raise ValueError("width, height, samples and depth must be at least 1")
        super().__init__(
            width, height, np.asarray(wi, np.float32), np.asarray(wo, np.float32), name=name
        )
        self.surface, self.samples, self.seed = surface, samples, seed
        self.depth, self.on_surface = depth, on_surface
        self._lights, self._light_of = np.unique(wi, axis=0, return_inverse=True)
        self._views, self._view_of = np.unique(wo, axis=0, return_inverse=True)

    def describe(self) -> dict[str, Any]:
        return super().describe() | {"values": "measured when asked for"}

    def texels(self, chosen: Indices | slice) -> Floats:
        return self._values(chosen, np.arange(self.pair_count)).astype(np.float32)

    def kept_texels(self, chosen: slice) -> npt.NDArray[Any]:
        return self._values(chosen, np.arange(self.pair_count))

    def texels_at(self, chosen: Indices, pairs: Indices) -> Floats:
        return self._values(chosen, pairs).astype(np.float32)

    def images(self, chosen: Indices | slice) -> Floats:
        pairs = np.arange(self.pair_count)[chosen]
        pictures = np.moveaxis(self._values(slice(None), pairs), 1, 0)
        shape = len(pairs), self.height, self.width, 3
        return np.ascontiguousarray(pictures.reshape(shape), np.float32)

    def _values(self, chosen: Indices | slice, pairs: Indices) -> npt.NDArray[np.float16]:
        texels = np.arange(self.texel_count)[chosen]
        values = np.empty((len(texels), len(pairs), 3), np.float16)
        starts = np.flatnonzero(np.diff(texels, prepend=-2) != 1).tolist()
        for start, stop in pairwise([*starts, len(texels)]):
            self._fill(values[start:stop], int(texels[start]), pairs)
        return values

    def table(self, progress: Progress | None = None) -> TableBtf:
        """All values, of type float16; above 2 GiB they lie in a temporary file.

        Progress is called as views are done. Raises a NacreError if there is no room for them.
        """
        values = _empty((self.height, self.width, self.pair_count, 3))
        everything = np.arange(self.pair_count)
        self._fill(values.reshape(self.texel_count, -1, 3), 0, everything, progress)
        return TableBtf(values, self.wi, self.wo, self.name)

    def _fill(
        self,
        values: npt.NDArray[np.float16],
        first: int,
        pairs: Indices,
        progress: Progress | None = None,
    ) -> None:
        """Write values, shape (texels, pairs, 3), of texels from `first` on."""
        light_of, view_of = self._light_of[pairs], self._view_of[pairs]
        seeds = np.random.SeedSequence(self.seed).generate_state(len(self._views), np.uint64)
        limit = max(1, _VISIBLE // (2 * self.surface.size**2))
        group_of = light_of // limit
        order = np.lexsort((view_of, group_of))
        ends = np.diff(view_of[order]) | np.diff(group_of[order])
        runs = np.split(order, np.flatnonzero(ends) + 1)  # pairs of one view and one group
        part = max(1, _PART // (6 * len(pairs)))
        parts = range(0, len(values), part)
        total, done = len(runs) * len(parts), 0
        scene = self._scene

        def take(what: tuple[int, npt.NDArray[np.int64]]) -> None:
            start, its = what
            view = view_of[its[0]]
            out = np.empty((min(part, len(values) - start), scene.lights.shape[1], 3), np.float32)
            sums = np.empty((3, scene.lights.shape[1]), np.float32)
            _photograph(
                *scene.geometry, scene.coverings, scene.visible, scene.lights,
                self._views[view].astype(np.float64), self.on_surface, self.depth, self.samples,
                self.width, self.height, first + start, seeds[view], sums, out,
            )  # fmt: skip
            values[start : start + part, its] = out[:, light_of[its] % limit]

        for group, its_runs in groupby(runs, lambda its: group_of[its[0]]):
            scene.light(self._lights[group * limit : (group + 1) * limit])
            for _ in thread_map(take, product(parts, its_runs)):
                done += 1
                if progress:
                    progress("capture", done, total, "")

    @cached_property
    def _scene(self) -> _Scene:
        return _Scene(self.surface)


def _empty(shape: tuple[int, ...]) -> npt.NDArray[np.float16]:
    """Room for values, in memory or in a file that vanishes with the process."""
    size = 2 * math.prod(shape)
    if size < _IN_MEMORY:
        return np.empty(shape, np.float16)
    folder = tempfile.gettempdir()
    if size > (free := shutil.disk_usage(folder).free):
        raise NacreError(
            f"{folder}: values need {size / 1e9:,.0f} GB, {free / 1e9:,.0f} are free; ask for "
            "fewer texels or directions, or set TMPDIR to another folder"
        )
    with tempfile.TemporaryFile() as file:
        if hasattr(os, "posix_fallocate"):  # a disk that fills up later would end the process
            try:
                os.posix_fallocate(file.fileno(), 0, size)
            except OSError as error:
                problem = f"no room for {size / 1e9:,.0f} GB of values: {error.strerror}"
                raise NacreError(f"{folder}: {problem}; set TMPDIR to another folder") from error
        return np.memmap(file, np.float16, "w+", shape=shape)


class _Scene:
    """A surface with what each of its triangles sees of some lights."""

    def __init__(self, surface: Mesostructure) -> None:
        heights = surface.heights_in_cells()
        above = np.maximum(heights, np.roll(heights, -1, 0))
        tops = np.maximum(above, np.roll(above, -1, 1))
        self.geometry = heights, tops, float(heights.min()), float(heights.max())
        self.coverings = surface.coverings()
        self.lights = np.empty((3, 0), np.float32)

    def light(self, lights: Floats) -> None:
        """Set lights: unit directions, shape (k, 3); nothing is done where they are set already."""
        size, new = len(self.coverings), np.ascontiguousarray(lights.T, np.float32)
        if np.array_equal(self.lights, new):
            return
        self.lights = new
        self.visible = np.empty((size, size, 2, len(lights)), np.uint8)
        points = max(1, _SHADOW_RAYS // (2 * size * size))

        def shade(first: int) -> None:
            out = self.visible[first : first + 8]
            _visibility(*self.geometry, self.lights, points, first, out)

        for _ in thread_map(shade, range(0, size, 8)):
            pass
