"""Surfaces and directions that the tests of the tracer share."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.geometry import from_spherical, join
from nacre.textures.capture import Mesostructure

CELLS = 64


def bumps(
    amplitude: float,
    albedo: Any = 0.5,
    specular: Any = 0.0,
    roughness: tuple[float, float] = (0.3, 0.3),
) -> Mesostructure:
    """An egg carton with slanting ridges, twice a period, of one color or of one a cell."""
    y, x = np.mgrid[:CELLS, :CELLS] * (4.0 * np.pi / CELLS)
    height = amplitude * (np.sin(x) * np.sin(y) + 0.4 * np.sin(2.0 * x + y))
    shape = (CELLS, CELLS)
    return Mesostructure(
        height,
        np.broadcast_to(albedo, (*shape, 3)).astype(float),
        np.broadcast_to(specular, (*shape, 3)).astype(float),
        np.broadcast_to(roughness, (*shape, 2)).astype(float),
        np.zeros(shape),
    )


def directions(*angles: tuple[float, float]) -> np.ndarray:
    """Unit vectors of polar angles and azimuths in degrees, shape (n, 3)."""
    theta, phi = np.radians(angles).T
    return join(from_spherical(theta, phi)).astype(np.float32)
