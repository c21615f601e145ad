"""Parallax: the point on a height field that a viewer sees."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import require

_STEPS = 256  # at most this many points of a ray are compared with the field
_LOWEST = 0.1  # cosine of the view below which the shift stops growing


class Relief:
    """A height field over a texture, intersected by rays (parallax occlusion mapping; Tatarchuk
    2006).

    Heights have shape (height, width), and are taken relative to their mean: the plane of the mean
    is where the texture lies in a scene, so a flat field changes nothing. A difference of 1 stands
    for `depth` texture widths; `aspect` is width over height of the texture. Texels are points of
    the field, as in a measurement that refers to the surface.
    """

    def __init__(self, mi: Any, heights: Any, depth: float, aspect: float) -> None:
        dr = require("drjit", "render")
        field = depth * (np.asarray(heights, np.float64) - np.mean(heights))
        self._mi, self._aspect, self._shape = mi, aspect, field.shape
        self._bottom, self._top = float(field.min()), float(field.max())
        tensor = mi.TensorXf(field[:, :, None].astype(np.float32))
        # Graphics cards filter with fractions of 8 bits, which would turn slopes into steps.
        self._field = mi.Texture2f(
            tensor, wrap_mode=dr.WrapMode.Repeat, migrate=False, use_accel=False
        )

    def seen(self, uv: Any, view: Components) -> Any:
        """Where the ray that would hit the plane at `uv`, an `mi.Point2f`, hits the field.

        The view, toward the viewer, is in the texture's frame: x along u, y against v. The ray is
        marched from pixel to pixel of the field.
        """
        if self._bottom == self._top:
            return uv
        mi, dr = self._mi, require("drjit", "render")
        scale = 1.0 / dr.maximum(view[2], _LOWEST)
        along = mi.Vector2f(view[0] * scale, view[1] * (-self._aspect) * scale)
        span = self._top - self._bottom
        rows, columns = self._shape
        pixels = dr.maximum(dr.abs(along.x) * columns, dr.abs(along.y) * rows) * span
        step = span / dr.clip(dr.ceil(pixels), 1.0, _STEPS)

        def above(level: Any) -> Any:
            return level - self._field.eval(uv + along * level)[0]

        def further(level: Any, _: Any, gap: Any) -> tuple[Any, Any, Any]:
            level = level - step
            return level, gap, above(level)

        start = mi.Float(self._top) + dr.zeros(mi.Float, dr.width(uv))
        level, before, gap = dr.while_loop(
            (start, mi.Float(0.0), above(start)),
            lambda level, _, gap: (gap > 0.0) & (level > self._bottom),
            further,
        )
        back = dr.select(before > 0.0, gap / dr.minimum(gap - before, -1e-12), 0.0)
        return uv + along * (level + step * back)
