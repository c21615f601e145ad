"""Pairs of directions, and random numbers, at which exports are compared."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.geometry import from_spherical, join, normalize, split

COUNT = 1_000_000
_EXACT = 1000  # pairs of each special kind


def pairs(count: int = COUNT, seed: int = 0) -> tuple[Floats, Floats]:
    """Unit directions to the light and to the viewer, float32, shapes (count, 3).

    Half lie near the mirror direction, at distances of all magnitudes from 1e-5 rad on; a tenth of
    all has a direction beyond 85 degrees. Among the last are exact mirrors, directions at the
    horizon and below it, the normal itself, light and view that are one, and opposites.
    """
    random = np.random.default_rng(seed)
    wi, wo = (_hemisphere(random.random((2, count))) for _ in range(2))
    near = np.arange(count) % 2 == 0
    mirror = wo * (-1.0, -1.0, 1.0)
    offset = 10.0 ** random.uniform(-5.0, 0.0, (count, 1)) * random.normal(size=(count, 3))
    wi = np.where(near[:, None], _unit(mirror + offset), wi)
    wi[:, 2] = np.abs(wi[:, 2])
    grazing = np.arange(count) % 20
    for w, which in ((wi, 1), (wo, 2)):
        theta = np.radians(85.0 + 5.0 * random.random(count))
        low = join(from_spherical(theta, 2.0 * math.pi * random.random(count)))
        w[:] = np.where((grazing == which)[:, None], low, w)
    for k, special in enumerate(_special(random, min(_EXACT, count // 20))):
        stop = count - k * len(special[0])
        wi[stop - len(special[0]) : stop], wo[stop - len(special[0]) : stop] = special
    return wi.astype(np.float32), wo.astype(np.float32)


def numbers(count: int = COUNT, seed: int = 1) -> Floats:
    """Random numbers in [0, 1), float32, shape (count, 3); the last are 0, and the largest."""
    u = np.random.default_rng(seed).random((count, 3), np.float32)
    u[-1], u[-2] = 0.0, np.nextafter(np.float32(1.0), np.float32(0.0))
    return u


def _special(random: np.random.Generator, count: int) -> list[tuple[Floats, Floats]]:
    w = _hemisphere(random.random((2, count)))
    flat = _unit(w * (1.0, 1.0, 0.0))
    normal = np.broadcast_to((0.0, 0.0, 1.0), w.shape)
    return [
        (w * (-1.0, -1.0, 1.0), w),
        (flat, w),
        (w, flat),
        (w * (1.0, 1.0, -1.0), w),
        (normal, w),
        (w, normal),
        (normal, normal),
        (w, w),
        (-w, w),
        (-flat, flat),
    ]


def _hemisphere(u: Floats) -> Floats:
    """Directions whose density is uniform over the hemisphere."""
    radius = np.sqrt(1.0 - u[0] ** 2)
    phi = 2.0 * math.pi * u[1]
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), u[0]], axis=-1)


def _unit(v: Floats) -> Floats:
    return join(normalize(split(v)))
