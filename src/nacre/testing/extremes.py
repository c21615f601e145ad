"""Directions and numbers at the ends of what there is."""

from __future__ import annotations

import functools
import math

import numpy as np

from nacre.array import Floats

_HEIGHTS = (
    *(1.0, 0.9, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-20, 1e-38, 1e-45),
    *(0.0, -0.0, -1e-7, -1.0),
)
_AZIMUTHS = (0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi, 0.3, math.pi + 0.3)


@functools.cache
def extreme_directions() -> Floats:
    """From the pole through the horizon, as near to it as float32 has numbers, shape (96, 3).

    Among them are mirror directions and opposite ones, to the last bit.
    """
    z, phi = (x.ravel() for x in np.meshgrid(_HEIGHTS, _AZIMUTHS, indexing="ij"))
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1)


def extreme_numbers() -> Floats:
    """Triples of the ends of [0, 1) and what is next to them, shape (125, 3)."""
    below_one = float(np.nextafter(np.float32(1.0), np.float32(0.0)))
    numbers = (0.0, 1e-45, 1e-8, 0.3, below_one)
    return np.stack(np.meshgrid(*[numbers] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def views(count: int) -> Floats:
    """Views from the pole to near the horizon, at azimuths of their own, shape (count, 3)."""
    theta = np.radians(np.linspace(0.0, 85.0, count))
    phi = 0.6 + 1.9 * np.arange(count)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], -1).astype(np.float32)
