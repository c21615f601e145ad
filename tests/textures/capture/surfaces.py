"""Surfaces and directions that the tests of the tracer share."""

from __future__ import annotations

import numpy as np

from nacre.geometry import from_spherical, join
from tests.oracles.mitsuba_capture import CELLS, bumps

__all__ = ["CELLS", "bumps", "directions"]


def directions(*angles: tuple[float, float]) -> np.ndarray:
    """Unit vectors of polar angles and azimuths in degrees, shape (n, 3)."""
    theta, phi = np.radians(angles).T
    return join(from_spherical(theta, phi)).astype(np.float32)
