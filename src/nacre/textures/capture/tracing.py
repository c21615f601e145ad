"""The compiled loops: which triangles lights reach, and paths through texels."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.compile.numba_code import compiled, inner, inner_fast
from nacre.textures.capture.reflection import (
    channel,
    fifth,
    grazing_edge,
    lobe,
    sample_light,
    smith,
)
from nacre.textures.capture.traversal import height_at, intersect, slopes

FIREFLY = 8.0
"""Most that each surface point of a path behind the first adds to a channel, in units of what a
white diffuse surface that faces the light sends."""

_OFFSET = 1e-4  # how far above the surface a ray leaves it, in cells


@inner  # type: ignore[untyped-decorator]
def _next(state: Any) -> Any:
    """Next state and a number in [0, 1) (SplitMix64; Steele, Lea and Flood 2014)."""
    state += np.uint64(0x9E3779B97F4A7C15)
    bits = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    bits = bits ^ (bits >> np.uint64(31))
    return state, np.float64(bits >> np.uint64(11)) * 2.0**-53


@compiled
def visibility(
    heights: Any, tops: Any, floor: Any, peak: Any, lights: Any, points: Any, first: Any, out: Any
) -> None:
    """Share of points of each triangle that a light reaches, in 255ths.

    `heights` to `peak` are as :func:`nacre.textures.capture.traversal.intersect` takes them,
    `lights` unit directions of shape (3, k), `points` the number of random points per triangle, the
    same for all lights. `out`, of shape (rows, size, 2, k), begins with row `first` of the cells.
    """
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
    lights: Any, visible: Any, tangent: Any, binormal: Any, normal: Any, view: Any, albedo: Any,
    specular: Any, edge: Any, along: Any, across: Any, weight: Any, limit: Any, sums: Any,
) -> None:  # fmt: skip
    """Add to `sums`, (3, k), what each light sends to the viewer by way of one point."""
    tx, ty, tz = tangent
    bx, by, bz = binormal
    nx, ny, nz = normal
    vx, vy, vz = view
    vt = vx * tx + vy * ty + vz * tz
    vb = vx * bx + vy * by + vz * bz
    vn = vx * nx + vy * ny + vz * nz
    root = smith(vt, vb, vn, along, across)
    one = np.float32(1.0)
    v = fifth(one - vn)
    for k in range(lights.shape[1]):
        lx, ly, lz = lights[0, k], lights[1, k], lights[2, k]
        ln = max(lx * nx + ly * ny + lz * nz, np.float32(0.0))
        lt = lx * tx + ly * ty + lz * tz
        lb = lx * bx + ly * by + lz * bz
        cosine = lx * vx + ly * vy + lz * vz
        shine, _, half = lobe(lt, lb, ln, vt, vb, vn, root, cosine, along, across)
        h, g = fifth(one - half), fifth(one - ln)
        arriving = ln * visible[k] * np.float32(1.0 / 255.0)
        red = channel(albedo[0], specular[0], edge, shine, h, g, v)
        green = channel(albedo[1], specular[1], edge, shine, h, g, v)
        blue = channel(albedo[2], specular[2], edge, shine, h, g, v)
        sums[0, k] += min(limit, weight[0] * arriving * red)
        sums[1, k] += min(limit, weight[1] * arriving * green)
        sums[2, k] += min(limit, weight[2] * arriving * blue)


@inner  # type: ignore[untyped-decorator]
def _frame(sx: Any, sy: Any, cosine: Any, sine: Any) -> Any:
    """Tangent of an azimuth, binormal and normal of a triangle of given slopes."""
    scale = 1.0 / math.sqrt(1.0 + sx * sx + sy * sy)
    nx, ny, nz = -sx * scale, -sy * scale, scale
    rise = sx * cosine + sy * sine
    scale = 1.0 / math.sqrt(cosine * cosine + sine * sine + rise * rise)
    tx, ty, tz = cosine * scale, sine * scale, rise * scale
    return (tx, ty, tz), (ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx), (nx, ny, nz)


@inner  # type: ignore[untyped-decorator]
def _dot(a: Any, x: Any, y: Any, z: Any) -> Any:
    return a[0] * x + a[1] * y + a[2] * z


@inner  # type: ignore[untyped-decorator]
def _single(a: Any) -> Any:
    return np.float32(a[0]), np.float32(a[1]), np.float32(a[2])


@inner  # type: ignore[untyped-decorator]
def _follow(
    heights: Any, tops: Any, floor: Any, peak: Any, coverings: Any, visible: Any, lights: Any,
    depth: Any, x: Any, y: Any, z: Any, dx: Any, dy: Any, dz: Any, state: Any, sums: Any,
) -> Any:  # fmt: skip
    """Add to `sums` what one path brings from all lights; gives the next random state."""
    red, green, blue = 1.0, 1.0, 1.0
    for bounce in range(depth):
        distance, i, j, upper = intersect(heights, tops, floor, peak, x, y, z, dx, dy, dz)
        if distance < 0.0:
            break
        x, y, z = x + distance * dx, y + distance * dy, z + distance * dz
        _, sx, sy = slopes(heights, i, j, upper)
        c0, c1, c2, s0, s1, s2, along, across, cosine, sine = coverings[i, j]
        t, b, n = _frame(sx, sy, cosine, sine)
        vn = -_dot(n, dx, dy, dz)
        if vn < 1e-4:
            break
        edge = np.float32(grazing_edge(s0, s1, s2))
        _add_lights(
            lights, visible[i, j, 1 if upper else 0], _single(t), _single(b), _single(n),
            _single((-dx, -dy, -dz)), (c0, c1, c2), (s0, s1, s2), edge, along, across,
            _single((red, green, blue)), np.float32(1e30 if bounce == 0 else FIREFLY), sums,
        )  # fmt: skip
        v = fifth(1.0 - vn)
        shiny = s0 + s1 + s2 + (3.0 * edge - s0 - s1 - s2) * v
        total = c0 + c1 + c2 + shiny
        if bounce + 1 == depth or total <= 0.0:
            break
        chance = shiny / total
        state, choice = _next(state)
        state, u1 = _next(state)
        state, u2 = _next(state)
        vt, vb = -_dot(t, dx, dy, dz), -_dot(b, dx, dy, dz)
        lt, lb, ln = sample_light(vt, vb, vn, along, across, chance, choice, u1, u2)
        if ln < 1e-4:
            break
        root = smith(vt, vb, vn, along, across)
        between = lt * vt + lb * vb + ln * vn
        shine, density, half = lobe(lt, lb, ln, vt, vb, vn, root, between, along, across)
        fraction = ln / (chance * density + (1.0 - chance) * ln)
        h, g = fifth(1.0 - half), fifth(1.0 - ln)
        red *= fraction * channel(c0, s0, edge, shine, h, g, v)
        green *= fraction * channel(c1, s1, edge, shine, h, g, v)
        blue *= fraction * channel(c2, s2, edge, shine, h, g, v)
        dx = lt * t[0] + lb * b[0] + ln * n[0]
        dy = lt * t[1] + lb * b[1] + ln * n[1]
        dz = lt * t[2] + lb * b[2] + ln * n[2]
        z += _OFFSET
    return state


@compiled
def photograph(
    heights: Any, tops: Any, floor: Any, peak: Any, coverings: Any, visible: Any, lights: Any,
    view: Any, on_surface: Any, depth: Any, samples: Any, width: Any, height: Any, first: Any,
    seed: Any, sums: Any, out: Any,
) -> None:  # fmt: skip
    """Reflectance factors of some texels, row by row, in one view, under all lights.

    For `heights` to `peak`, see :func:`nacre.textures.capture.traversal.intersect`; for
    `coverings`, :meth:`nacre.textures.capture.mesostructure.Mesostructure.coverings`; for `visible`
    and `lights`, :func:`visibility`. `view` is a unit direction, `depth` the largest number of
    surface points of a path, `samples` the paths per texel, `width` and `height` the texels of the
    whole picture; for `on_surface` see :func:`nacre.textures.capture.capture`. The seed has type
    uint64. `sums`, of shape (3, k), is written over. `out`, of shape (texels, k, 3), begins with
    texel `first`.
    """
    size = heights.shape[0]
    z = peak + _OFFSET
    slant_x, slant_y = view[0] / view[2], view[1] / view[2]
    begin = 0.5 if on_surface else 0.0
    for texel in range(first, first + out.shape[0]):
        row, column = texel // width, texel % width
        sums[:] = np.float32(0.0)
        state = np.uint64(seed) + (np.uint64(texel) << np.uint64(32))
        state, shift_x = _next(state)
        state, shift_y = _next(state)
        for sample in range(samples):
            # The sequence R2 fills a texel evenly with any number of points (Roberts 2018).
            px = (shift_x + sample * 0.7548776662466927) % 1.0
            py = (shift_y + sample * 0.5698402909980532) % 1.0
            x = (column + px) * size / width - begin
            y = (height - row - py) * size / height - begin
            back = z - height_at(heights, x, y) if on_surface else z
            x, y = x + slant_x * back, y + slant_y * back
            state = _follow(
                heights, tops, floor, peak, coverings, visible, lights, depth,
                x, y, z, -view[0], -view[1], -view[2], state, sums,
            )  # fmt: skip
        for k in range(lights.shape[1]):
            scale = np.float32(1.0) / (np.float32(samples) * lights[2, k])
            for c in range(3):
                out[texel - first, k, c] = sums[c, k] * scale
