"""Spheres for codes side by side: single texels as materials."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import Figure, Page
from nacre.mitsuba.sphere import frames, sphere_normals, standard_lights
from nacre.textures.codecs.codec import TexelCodec, on_all_cores

_PIXELS = 72  # along an edge of a sphere
_DIRECTIONS = 192  # of the environment's light
_PART = 512  # pixels at a time
_SIDE, _CAPTION, _ACROSS = 1.3, 0.42, 6  # inches of a sphere and its caption; spheres in a row


def texel_spheres(codec: TexelCodec, codes: Floats) -> Floats:
    """Spheres for single codes under the standard environment.

    They match :mod:`nacre.mitsuba.sphere`, with fewer directions, which are prepared once for all
    codes, shape (n, values). Returns linear RGB, shape (n, pixels, pixels, 3).
    """
    light = standard_lights(count=_DIRECTIONS)["environment"]
    normals, mask = sphere_normals(_PIXELS)
    local = frames(normals[mask])
    shaded = np.zeros((len(codes), len(local), 3), np.float32)
    for start in range(0, len(local), _PART):
        part = local[start : start + _PART]
        wi, weights, points = light.incident(part)
        wi, wo = (np.asarray(w, np.float32) for w in (wi, part[:, :, 2][points]))
        values = on_all_cores(codec, codec.decoder(wi, wo))(codes)
        values *= np.asarray(wi[:, 2:] * weights / math.pi, np.float32)
        for index, value in enumerate(values):
            for channel in range(3):
                sums = np.bincount(points, value[:, channel], minlength=len(part))
                shaded[index, start : start + _PART, channel] = sums
    pictures = np.zeros((len(codes), _PIXELS, _PIXELS, 3), np.float32)
    pictures[:, mask] = shaded
    return pictures


def spheres_figure(pictures: Floats, captions: Sequence[str]) -> Figure:
    """Spheres in rows, with captions below; the first caption is bold."""
    across = min(_ACROSS, len(pictures))
    rows = -(-len(pictures) // across)
    page = Page(across * _SIDE, rows * (_SIDE + _CAPTION), "white")
    for index, (picture, caption) in enumerate(zip(pictures, captions, strict=True)):
        row, column = divmod(index, across)
        x, y = column * _SIDE, row * (_SIDE + _CAPTION)
        page.sphere(x, y, _SIDE, tone_map(picture))
        weight = "normal" if index else "bold"
        middle, below = x + 0.5 * _SIDE, y + _SIDE + 0.02
        page.text(middle, below, caption, 8.0, ha="center", va="top", weight=weight)
    return page.figure
