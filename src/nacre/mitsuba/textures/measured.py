"""A whole texture of measurements at hits: the reference for all decoders."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats, aligned_zeros
from nacre.btf import Btf
from nacre.errors import NacreError, require
from nacre.mitsuba.textures.hemisphere import Hemisphere
from nacre.mitsuba.textures.texels import AlignedBuffer, Corners
from nacre.sampling.tilted import PARAMETERS
from nacre.textures.lobes import coarse_texels, even_directions, fitted_lobes, lobe_views

_BLOCK = 1 << 26
_MOST = 1 << 32  # values that 32 bits can number
_DIGITS = 5  # directions that agree to these are the same
_POINTS = 1 << 14  # points on the hemisphere that measure each light's solid angle


class MeasuredDecoder:
    """Interpolation between three lights and three views around a pair (Rainer et al. 2020).

    The texture is read once, into half precision; values below 0 count as 0. For `stochastic` see
    :class:`nacre.mitsuba.textures.hemisphere.Hemisphere`. A table with more bytes than `memory`, or
    a value too large for half precision, is a :class:`NacreError`.
    """

    def __init__(self, mi: Any, btf: Btf, sides: Sides, stochastic: bool, memory: int) -> None:
        self._mi = mi
        size = 4 * btf.texel_count * btf.pair_count
        if 2 * size > memory or size > _MOST:
            limit = min(memory, 2 * _MOST)
            raise NacreError(
                f"{btf.name}: its table needs {2 * size / 2**20:,.0f} MiB, {limit / 2**20:,.0f} "
                "are allowed; encode it (nacre fit) and render that, or raise memory"
            )
        # A fourth value keeps each color in one cache line.
        table = aligned_zeros((btf.texel_count, btf.pair_count, 4), np.float16)
        for block in btf.blocks(_BLOCK):
            with np.errstate(over="ignore"):
                table[block, :, :3] = np.maximum(btf.texels(block)[:, sides.order], 0.0)
        if not all(np.isfinite(table[b]).all() for b in btf.blocks(_BLOCK)):
            raise NacreError(f"{btf.name}: has values above 65,504; scale it down")
        self._table = AlignedBuffer(mi, table.reshape(-1, 4))
        self._pairs, self._lights = btf.pair_count, len(sides.lights)
        self._light_side = Hemisphere(mi, sides.lights, stochastic)
        self._view_side = Hemisphere(mi, sides.views, stochastic)

    def texels(self, corners: Corners) -> Corners:
        return corners

    def reflectance(self, texels: Corners, wi: Components, wo: Components) -> Components:
        mi, dr = self._mi, require("drjit", "render")
        lights, views = self._light_side.around(wi), self._view_side.around(wo)
        total = [mi.Float(0.0)] * 3
        for texel, texel_weight in texels:
            for view, view_weight in views:
                start = texel * self._pairs + view * self._lights
                for light, light_weight in lights:
                    *rgb, _ = self._table[start + light]
                    weight = texel_weight * view_weight * light_weight
                    terms = zip(rgb, total, strict=True)
                    total = [dr.fma(mi.Float(v), weight, sum_) for v, sum_ in terms]
        return total[0], total[1], total[2]


@dataclass(frozen=True, eq=False)
class Sides:
    """Lights and views of a texture in which every light is measured with every view.

    Unit directions have shapes (l, 3) and (v, 3). The order of its pairs, shape (v * l,), puts all
    lights with the first view first, and so on.
    """

    lights: Floats
    views: Floats
    order: npt.NDArray[np.intp]

    @classmethod
    def of(cls, btf: Btf) -> Sides:
        """From a texture; a :class:`NacreError` unless every light occurs once with every view."""
        (lights, light), (views, view) = (
            np.unique(w.round(_DIGITS), axis=0, return_inverse=True) for w in (btf.wi, btf.wo)
        )
        place = view.reshape(-1) * len(lights) + light.reshape(-1)
        order = np.argsort(place)
        if not np.array_equal(place[order], np.arange(len(lights) * len(views))):
            raise NacreError(
                f"{btf.name}: not every light is measured once with every view; encode it "
                "(nacre fit) and render that"
            )
        return cls(lights, views, order)


def table_lobes(btf: Btf, sides: Sides) -> Floats:
    """Lobes for a measured texture; see :func:`nacre.textures.lobes.latent_lobes`."""
    from scipy.spatial import KDTree  # not where no texture is rendered

    lights, views = sides.lights, sides.views
    chosen = np.unique(KDTree(views).query(lobe_views())[1])
    pairs = sides.order.reshape(len(views), len(lights))[chosen].ravel()
    nearest = KDTree(lights).query(even_directions(_POINTS, 0.0))[1]
    counts = np.bincount(nearest, minlength=len(lights))
    areas = np.tile(counts * (2.0 * math.pi / _POINTS), len(chosen)).astype(np.float32)
    rows, columns = coarse_texels(btf.height, btf.width)
    index = np.arange(btf.texel_count).reshape(btf.height, btf.width)[rows, columns]
    flat, wi, wo = index.ravel(), btf.wi[pairs], btf.wo[pairs]
    found = fitted_lobes(len(flat), lambda part: btf.texels(flat[part])[:, pairs], wi, wo, areas)
    return found.reshape(*index.shape, PARAMETERS)
