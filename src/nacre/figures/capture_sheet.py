"""A sheet of pictures that shows what was captured."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.figures.texture_views import laid_out, nearest_pairs, reduced_pictures

_LIGHTS = ((0.0, 0.0), (45.0, 180.0), (45.0, 90.0), (75.0, 0.0))
_VIEWS = ((0.0, 0.0), (45.0, 0.0), (75.0, 90.0))
"""Polar angles and azimuths in degrees."""
_LEAST = 160
"""Pixels that a picture's width is enlarged to, about."""


def sheet(btf: Btf, repeats: int = 2) -> Floats:
    """Linear values of pictures at four lights (columns) and three views (rows), tiled.

    Each is of the pair nearest to what is wanted, under a lamp of the same power throughout, which
    makes most of the first picture nearly white: reflectance times the light's cosine.

    Returns
    -------
    array
        Shape (rows, columns, 3).
    """
    chosen = nearest_pairs(btf, _LIGHTS, _VIEWS)
    pictures = reduced_pictures(btf, chosen) * btf.wi[chosen, 2][..., None, None, None]
    bright = float(np.quantile(pictures[0, 0].max(-1), 0.9))
    pictures = np.tile(pictures * (0.8 / max(bright, 1e-3)), (1, 1, repeats, repeats, 1))
    enlarged = max(1, _LEAST // pictures.shape[3])
    pictures = pictures.repeat(enlarged, 2).repeat(enlarged, 3)
    framed = np.pad(pictures, ((0, 0), (0, 0), (1, 1), (1, 1), (0, 0)), constant_values=1.0)
    return laid_out(framed)
