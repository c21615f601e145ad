"""Parallax: where on a height field a viewer looks."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import FormatError, reason, require
from nacre.io.files import PathLike

_STEPS = 16  # heights at which a ray is compared with the field
_LOWEST = 0.1  # cosine of the view below which the shift grows no more


class Relief:
    """A height field over a texture, met by rays (parallax occlusion mapping; Tatarchuk 2006).

    Heights, of shape (height, width), are of the plane of the mean height, to which texels of a
    rectified measurement refer, so that a flat field changes nothing. A difference of 1 stands for
    `depth` widths of the texture; `aspect` is its width over its height.
    """

    def __init__(self, mi: Any, heights: Any, depth: float, aspect: float) -> None:
        dr = require("drjit", "render")
        field = depth * (np.asarray(heights, np.float64) - np.mean(heights))
        self._mi, self._aspect = mi, aspect
        self._bottom, self._top = float(field.min()), float(field.max())
        tensor = mi.TensorXf(field[:, :, None].astype(np.float32))
        self._field = mi.Texture2f(tensor, wrap_mode=dr.WrapMode.Repeat, migrate=False)

    def seen(self, uv: Any, view: Components) -> Any:
        """Where the ray that would meet the plane at `uv`, an `mi.Point2f`, meets the field.

        The view, the direction to the viewer, is in the texture's frame: x along u, y against v.
        """
        if self._bottom == self._top:
            return uv
        mi, dr = self._mi, require("drjit", "render")
        scale = 1.0 / dr.maximum(view[2], _LOWEST)
        along = mi.Vector2f(view[0] * scale, view[1] * (-self._aspect) * scale)
        step = (self._top - self._bottom) / _STEPS
        before = self._top - self._field.eval(uv + along * self._top)[0]
        height, found = mi.Float(self._bottom), mi.Bool(False)
        for k in range(1, _STEPS + 1):
            level = self._top - k * step
            above = level - self._field.eval(uv + along * level)[0]
            met = ~found & (above <= 0.0)
            part = before / dr.maximum(before - above, 1e-12)
            height = dr.select(met, level + step * (1.0 - part), height)
            found |= met
            before = above
        return uv + along * height


def read_heights(path: PathLike) -> Any:
    """A gray image as heights, of bytes from 0 to 1 as they are, shape (height, width).

    Raises
    ------
    FormatError
        If it cannot be read.
    """
    mi: Any = require("mitsuba", "render")
    try:
        bitmap = mi.Bitmap(str(path))
        bitmap.set_srgb_gamma(False)
        gray = bitmap.convert(mi.Bitmap.PixelFormat.Y, mi.Struct.Type.Float32, False)
        heights = np.array(gray, np.float32)
    except RuntimeError as error:
        raise FormatError(f"{path}: height field cannot be read: {reason(error)}") from error
    if not heights.size or not np.isfinite(heights).all():
        raise FormatError(f"{path}: height field has no pixels, or some that are not finite")
    return heights.reshape(heights.shape[:2])
