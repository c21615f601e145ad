"""A grid over pairs of directions, between whose nodes functions are linear."""

from __future__ import annotations

from typing import Any

from nacre.array import Components
from nacre.errors import require
from nacre.render.textures.texels import Records, jitters
from nacre.textures.factors import grid_place


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
        places = [*grid_place(wo, size), *grid_place(wi, size)]
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
