"""A grid over pairs of directions, between whose nodes functions are linear."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Components, Floats
from nacre.errors import require
from nacre.render.textures.texels import Records, jitters


def node_directions(resolution: int) -> Floats:
    """The directions of one side of the grid, shape (resolution^2, 3).

    A hemisphere is an equal-area disk (Lambert's azimuthal projection) in a square; nodes outside
    the disk have the direction of the horizon that is nearest to them.
    """
    axis = np.linspace(-1.0, 1.0, resolution)
    y, x = (part.ravel() for part in np.meshgrid(axis, axis, indexing="ij"))
    radius = np.hypot(x, y)
    inside = np.minimum(radius, 1.0)
    scale = np.sqrt(2.0 - np.square(inside)) * inside / np.maximum(radius, 1e-12)
    directions = np.stack([x * scale, y * scale, 1.0 - np.square(inside)], axis=-1)
    return directions.astype(np.float32)


class AngleGrid:
    """What is between nodes, `resolution` along each of the four axes; the index of light p with
    view q is p * resolution^2 + q.

    Stochastically, one node stands for the sixteen around a pair, as likely as its weight; the same
    pair always has the same node.
    """

    def __init__(self, mi: Any, resolution: int, stochastic: bool) -> None:
        self._mi, self._resolution, self._stochastic = mi, resolution, stochastic

    def interpolated(self, records: Records, wi: Components, wo: Components) -> list[Any]:
        """The numbers of records of the nodes, at pairs of directions."""
        mi, dr = self._mi, require("drjit", "render")
        size = self._resolution
        # The least significant axis is the view's x.
        places = [*self._place(wo), *self._place(wi)]
        strides = [size**k for k in range(4)]
        if self._stochastic:
            shifts = jitters(mi, (wi[0], wi[1], wo[0], wo[1]), 4)
            index = mi.UInt32(0)
            for place, shift, stride in zip(places, shifts, strides, strict=True):
                index += mi.UInt32(dr.minimum(place + shift, size - 0.5)) * stride
            return records.at([(index, mi.Float(1.0))])
        first = [dr.minimum(mi.UInt32(place), size - 2) for place in places]
        after = [place - mi.Float(low) for place, low in zip(places, first, strict=True)]

        def add(corner: Any, total: list[Any]) -> tuple[Any, list[Any]]:
            index, weight = mi.UInt32(0), mi.Float(1.0)
            for axis, (low, part, stride) in enumerate(zip(first, after, strides, strict=True)):
                step = (corner >> axis) & 1
                index += (low + step) * stride
                weight *= dr.select(step == 1, part, 1.0 - part)
            values = records.at([(index, mi.Float(1.0))])
            return corner + 1, [dr.fma(v, weight, t) for v, t in zip(values, total, strict=True)]

        # As a loop it compiles sixteen times as fast.
        zeros = [mi.Float(0.0)] * records.numbers
        _, total = dr.while_loop((mi.UInt32(0), zeros), lambda corner, _: corner < 16, add)
        return list(total)

    def _place(self, w: Components) -> tuple[Any, Any]:
        """Coordinates of a direction in steps of the grid; the horizon's for those below it."""
        dr = require("drjit", "render")
        most = self._resolution - 1.0
        scale = dr.rsqrt(1.0 + dr.maximum(w[2], 0.0))
        return tuple(dr.clip((v * scale + 1.0) * (0.5 * most), 0.0, most) for v in w[:2])
