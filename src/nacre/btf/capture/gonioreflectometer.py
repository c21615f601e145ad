"""A virtual gonioreflectometer: path tracing of a periodic surface for all lights at once.

For each view, rays of an orthographic camera pass through jittered points of a texel on the plane
z = 0, which a rectified photograph shows as well: what lies above or below the plane is displaced
by parallax, hides and shadows. At each of at most three surface points of a path all directional
lights are evaluated; whether they reach a triangle is found beforehand. Light that arrives by way
of other points is limited to :data:`FIREFLY` a path and light, in units of what a white diffuse
surface facing the light would send: single rare paths would show as bright dots.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.capture.mesostructure import Mesostructure
from nacre.btf.capture.reflection import (
    fifth,
    grazing_edge,
    lobe,
    sample_half_vector,
    smith,
)
from nacre.btf.capture.traversal import intersect, slopes
from nacre.btf.texture import TableBtf
from nacre.parallel import thread_map
from nacre.progress import Progress

DEPTH = 3
"""Surface points of the longest paths."""
FIREFLY = 8.0

_OFFSET = 1e-4
"""How far above the surface a ray leaves it, in cells."""
_SHADOW_RAYS = 1 << 18
"""Shadow rays a light, at least, over all triangles."""

inner = numba.njit(error_model="numpy", forceinline=True)
inner_fast = numba.njit(error_model="numpy", forceinline=True, fastmath=True)
compiled = numba.njit(nogil=True, error_model="numpy", cache=True)


@inner  # type: ignore[untyped-decorator]
def _next(state: Any) -> Any:
    """Next state and a number in [0, 1) (SplitMix64; Steele, Lea and Flood 2014)."""
    state += np.uint64(0x9E3779B97F4A7C15)
    bits = state
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    bits = bits ^ (bits >> np.uint64(31))
    return state, np.float64(bits >> np.uint64(11)) * 2.0**-53


@compiled
def _visibility(
    heights: Any, tops: Any, floor: Any, peak: Any, lights: Any, points: Any, first: Any, out: Any
) -> None:
    """Share of points of each triangle that a light reaches, in 255ths."""
    size = heights.shape[0]
    for row in range(first, first + out.shape[0]):
        for column in range(size):
            for side in range(2):
                h, sx, sy = slopes(heights, row, column, side == 1)
                for k in range(lights.shape[1]):
                    lx, ly, lz = lights[0, k], lights[1, k], lights[2, k]
                    seen = 0
                    state = np.uint64((row * size + column) * 2 + side) << np.uint64(20)
                    if lz - sx * lx - sy * ly > 0.0:
                        for _ in range(points):
                            state, u = _next(state)
                            state, v = _next(state)
                            low, high = min(u, v), max(u, v)
                            u, v = (low, high) if side == 1 else (high, low)
                            t, _, _, _ = intersect(
                                heights, tops, floor, peak, column + u, row + v,
                                h + sx * u + sy * v + _OFFSET, lx, ly, lz,
                            )  # fmt: skip
                            seen += t < 0.0
                    out[row - first, column, side, k] = (255 * seen + points // 2) // points


@inner_fast  # type: ignore[untyped-decorator]
def _add_lights(
    lights: Any, visible: Any, normal: Any, tangent: Any, binormal: Any, view: Any, colour: Any,
    reflected: Any, edge: Any, along: Any, across: Any, weight: Any, limit: Any, sums: Any,
) -> None:  # fmt: skip
    """Add what all lights send to the viewer from one point."""
    one = np.float32(1.0)
    nx, ny, nz = normal
    tx, ty, tz = tangent
    bx, by, bz = binormal
    vx, vy, vz = view
    vt = vx * tx + vy * ty + vz * tz
    vb = vx * bx + vy * by + vz * bz
    vn = vx * nx + vy * ny + vz * nz
    root = smith(vt, vb, vn, along, across)
    grazing = fifth(one - vn)
    red, green, blue = reflected
    span = (edge - red, edge - green, edge - blue)
    base = (
        colour[0] * (one - red - span[0] * grazing),
        colour[1] * (one - green - span[1] * grazing),
        colour[2] * (one - blue - span[2] * grazing),
    )
    for k in range(lights.shape[1]):
        lx, ly, lz = lights[0, k], lights[1, k], lights[2, k]
        ln = lx * nx + ly * ny + lz * nz
        ln = max(ln, np.float32(0.0))
        lt = lx * tx + ly * ty + lz * tz
        lb = lx * bx + ly * by + lz * bz
        cosine = lx * vx + ly * vy + lz * vz
        shine, _, half = lobe(lt, lb, ln, vt, vb, vn, root, cosine, along, across)
        m, g = fifth(one - half), fifth(one - ln)
        arriving = ln * visible[k] * np.float32(1.0 / 255.0)
        r = base[0] * (one - red - span[0] * g) + shine * (red + span[0] * m)
        sums[0, k] += min(limit, weight[0] * arriving * r)
        r = base[1] * (one - green - span[1] * g) + shine * (green + span[1] * m)
        sums[1, k] += min(limit, weight[1] * arriving * r)
        r = base[2] * (one - blue - span[2] * g) + shine * (blue + span[2] * m)
        sums[2, k] += min(limit, weight[2] * arriving * r)


@compiled
def _photograph(
    heights: Any, tops: Any, floor: Any, peak: Any, coverings: Any, visible: Any, lights: Any,
    view: Any, depth: Any, samples: Any, width: Any, height: Any, first: Any, seed: Any, out: Any,
) -> None:  # fmt: skip
    """Reflectance factors of rows of texels from `first` in one view, (rows, width, lights, 3)."""
    size = heights.shape[0]
    count = lights.shape[1]
    sums = np.zeros((3, count), np.float32)
    f = np.float32
    for row in range(first, first + out.shape[0]):
        for column in range(width):
            sums[:] = f(0.0)
            state = np.uint64(seed) + (np.uint64(row * width + column) << np.uint64(32))
            state, shift_x = _next(state)
            state, shift_y = _next(state)
            for sample in range(samples):
                # The sequence R2 fills a texel evenly with any number of points (Roberts 2018).
                px = (shift_x + sample * 0.7548776662466927) % 1.0
                py = (shift_y + sample * 0.5698402909980532) % 1.0
                dx, dy, dz = -view[0], -view[1], -view[2]
                back = (peak + _OFFSET) / dz
                x = (column + px) * size / width + back * dx
                y = (height - row - py) * size / height + back * dy
                z = peak + _OFFSET
                red, green, blue = 1.0, 1.0, 1.0
                for bounce in range(depth):
                    t, i, j, upper = intersect(
                        heights, tops, floor, peak, x, y, z, dx, dy, dz
                    )
                    if t < 0.0:
                        break
                    x, y, z = x + t * dx, y + t * dy, z + t * dz
                    h, sx, sy = slopes(heights, i, j, upper)
                    scale = 1.0 / math.sqrt(1.0 + sx * sx + sy * sy)
                    nx, ny, nz = -sx * scale, -sy * scale, scale
                    vn = -(nx * dx + ny * dy + nz * dz)
                    if vn < 1e-4:
                        break
                    tx, ty = coverings[i, j, 8], coverings[i, j, 9]
                    tz = sx * tx + sy * ty
                    scale = 1.0 / math.sqrt(tx * tx + ty * ty + tz * tz)
                    tx, ty, tz = tx * scale, ty * scale, tz * scale
                    bx, by, bz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
                    c0, c1, c2 = coverings[i, j, 0], coverings[i, j, 1], coverings[i, j, 2]
                    s0, s1, s2 = coverings[i, j, 3], coverings[i, j, 4], coverings[i, j, 5]
                    along, across = coverings[i, j, 6], coverings[i, j, 7]
                    edge = f(grazing_edge(s0, s1, s2))
                    _add_lights(
                        lights, visible[i, j, 1 if upper else 0],
                        (f(nx), f(ny), f(nz)), (f(tx), f(ty), f(tz)), (f(bx), f(by), f(bz)),
                        (f(-dx), f(-dy), f(-dz)), (c0, c1, c2), (s0, s1, s2), edge, along, across,
                        (f(red), f(green), f(blue)), f(1e30 if bounce == 0 else FIREFLY), sums,
                    )  # fmt: skip
                    if bounce + 1 == depth:
                        break
                    vt = -(tx * dx + ty * dy + tz * dz)
                    vb = -(bx * dx + by * dy + bz * dz)
                    diffuse = c0 + c1 + c2
                    grazing = fifth(1.0 - vn)
                    shiny = s0 + s1 + s2
                    shiny += (3.0 * edge - shiny) * grazing
                    if diffuse + shiny <= 0.0:
                        break
                    chance = shiny / (diffuse + shiny)
                    state, u = _next(state)
                    state, phi = _next(state)
                    state, choice = _next(state)
                    phi *= 2.0 * math.pi
                    if choice < chance:
                        ht, hb, hn = sample_half_vector(vt, vb, vn, along, across, u, phi)
                        twice = 2.0 * (ht * vt + hb * vb + hn * vn)
                        lt, lb, ln = twice * ht - vt, twice * hb - vb, twice * hn - vn
                    else:
                        radius = math.sqrt(u)
                        lt, lb, ln = radius * math.cos(phi), radius * math.sin(phi), math.sqrt(1.0 - u)
                    if ln < 1e-4:
                        break
                    cosine = lt * vt + lb * vb + ln * vn
                    root = smith(vt, vb, vn, along, across)
                    shine, density, half = lobe(
                        lt, lb, ln, vt, vb, vn, root, cosine, along, across
                    )
                    share = ln / (chance * density + (1.0 - chance) * ln)
                    m, g = fifth(1.0 - half), fifth(1.0 - ln)
                    red *= share * (
                        c0 * (1.0 - s0 - (edge - s0) * grazing) * (1.0 - s0 - (edge - s0) * g)
                        + shine * (s0 + (edge - s0) * m)
                    )
                    green *= share * (
                        c1 * (1.0 - s1 - (edge - s1) * grazing) * (1.0 - s1 - (edge - s1) * g)
                        + shine * (s1 + (edge - s1) * m)
                    )
                    blue *= share * (
                        c2 * (1.0 - s2 - (edge - s2) * grazing) * (1.0 - s2 - (edge - s2) * g)
                        + shine * (s2 + (edge - s2) * m)
                    )
                    dx = lt * tx + lb * bx + ln * nx
                    dy = lt * ty + lb * by + ln * ny
                    dz = lt * tz + lb * bz + ln * nz
                    z += _OFFSET
            for k in range(count):
                scale = f(1.0) / (f(samples) * lights[2, k])
                for c in range(3):
                    out[row - first, column, k, c] = sums[c, k] * scale


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
    name: str = "",
    progress: Progress | None = None,
) -> TableBtf:
    """Measure a periodic surface from pairs of directions.

    The texture covers one period, so it tiles. A view costs as much for one light as for all lights
    that occur with any view: name the same lights for all views where there is a choice.

    Parameters
    ----------
    surface
        What is measured.
    wi, wo
        Unit directions to the light and to the viewer, above the horizon, shape (n, 3).
    width, height
        Texels; as many rows as columns where not given.
    samples
        Paths a texel and view.
    seed
        Same seed, same values, whatever the number of threads.
    depth
        Most surface points of a path; 1 leaves interreflection out.
    name
        Of the material.
    progress
        Called after each view.

    Returns
    -------
    TableBtf
        Values of type float16.
    """
    if wi.shape != wo.shape or wi.ndim != 2 or wi.shape[1] != 3 or not len(wi):
        raise ValueError(f"expected two arrays of shape (n, 3), got {wi.shape} and {wo.shape}")
    if min(wi[:, 2].min(), wo[:, 2].min()) < 0.01:
        raise ValueError("directions must lie above the horizon")
    height = width if height is None else height
    if min(width, height, samples, depth) < 1:
        raise ValueError("width, height, samples and depth must be at least 1")
    lights, light_of = np.unique(wi, axis=0, return_inverse=True)
    views, view_of = np.unique(wo, axis=0, return_inverse=True)
    pairs_of = np.split(np.argsort(view_of, kind="stable"), np.cumsum(np.bincount(view_of))[:-1])
    scene = _Scene(surface, lights)
    seeds = np.random.SeedSequence(seed).generate_state(len(views), np.uint64)
    values = np.empty((height, width, len(wi), 3), np.float16)
    band = max(1, _BAND // (12 * width * len(lights)))

    def photograph(part: tuple[int, int]) -> int:
        view, first = part
        rows = min(band, height - first)
        out = scene.photograph(views[view], depth, samples, width, height, first, rows, seeds[view])
        pairs = pairs_of[view]
        values[first : first + rows, :, pairs] = out[:, :, light_of[pairs]]
        return first + rows == height

    parts = [(view, first) for view in range(len(views)) for first in range(0, height, band)]
    done = 0
    for last in thread_map(photograph, parts):
        done += last
        if progress and last:
            progress("capture", done, len(views), "")
    return TableBtf(values, np.asarray(wi, np.float32), np.asarray(wo, np.float32), name)


_BAND = 1 << 24
"""Bytes of values that a thread works on at once."""


class _Scene:
    """A surface with what each of its triangles sees of the lights.

    Parameters
    ----------
    surface
        As heights and coverings.
    lights
        Unit directions, shape (k, 3).
    """

    def __init__(self, surface: Mesostructure, lights: Floats) -> None:
        heights = surface.heights_in_cells()
        east, north = np.roll(heights, -1, 1), np.roll(heights, -1, 0)
        corners = (heights, east, north, np.roll(north, -1, 1))
        self._lights = np.ascontiguousarray(lights.T, np.float32)
        self._geometry = (
            heights,
            np.maximum.reduce(corners),
            float(heights.min()),
            float(heights.max()),
        )
        self._coverings = surface.coverings()
        size = surface.size
        self._visible = np.empty((size, size, 2, len(lights)), np.uint8)
        points = max(1, _SHADOW_RAYS // (2 * size * size))

        def shade(first: int) -> None:
            out = self._visible[first : first + 8]
            _visibility(*self._geometry, self._lights, points, first, out)

        for _ in thread_map(shade, range(0, size, 8)):
            pass

    def photograph(
        self,
        view: Floats,
        depth: int,
        samples: int,
        width: int,
        height: int,
        first: int,
        rows: int,
        seed: np.uint64,
    ) -> npt.NDArray[np.float32]:
        """Values of some rows of texels in one view under all lights, (rows, width, k, 3)."""
        out = np.empty((rows, width, self._lights.shape[1], 3), np.float32)
        _photograph(
            *self._geometry, self._coverings, self._visible, self._lights,
            view.astype(np.float64), depth, samples, width, height, first, seed, out,
        )  # fmt: skip
        return out
