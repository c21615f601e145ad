"""A sheet of pictures that shows what was captured."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.texture import Btf
from nacre.geometry import from_spherical, join

_LIGHTS = ((0.0, 0.0), (45.0, 180.0), (45.0, 90.0), (75.0, 0.0))
_VIEWS = ((0.0, 0.0), (45.0, 0.0), (75.0, 90.0))
"""Polar angles and azimuths in degrees."""
_LEAST = 160
"""Pixels that a picture's width is enlarged to, about."""


def sheet(btf: Btf, repeats: int = 2) -> npt.NDArray[np.floating]:
    """Linear values of pictures at four lights (columns) and three views (rows), tiled.

    Each is of the pair nearest to what is wanted, under a lamp of the same power throughout, which
    makes most of the first picture nearly white: reflectance times the light's cosine.

    Returns
    -------
    array
        Shape (rows, columns, 3).
    """
    wi, wo = _directions(_LIGHTS), _directions(_VIEWS)
    score = (btf.wi @ wi.T)[:, None, :] + (btf.wo @ wo.T)[:, :, None]  # (n, views, lights)
    chosen = score.argmax(0).ravel()
    pictures = btf.images(chosen) * btf.wi[chosen, 2][:, None, None, None]
    bright = np.quantile(pictures[0].max(-1), 0.9)
    pictures = np.tile(pictures * (0.8 / max(bright, 1e-3)), (1, repeats, repeats, 1))
    pictures = pictures.repeat(enlarged := max(1, _LEAST // pictures.shape[2]), 1).repeat(
        enlarged, 2
    )
    framed = np.pad(pictures, ((0, 0), (1, 1), (1, 1), (0, 0)), constant_values=1.0)
    rows = framed.reshape(len(wo), len(wi), *framed.shape[1:])
    return np.concatenate([np.concatenate(list(row), 1) for row in rows], 0)


def _directions(angles: tuple[tuple[float, float], ...]) -> Floats:
    theta, phi = np.radians(np.array(angles)).T
    return join(from_spherical(theta, phi))
