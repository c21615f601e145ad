"""Directions at which materials are checked; the same seed gives the same ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.geometry import dot, from_spherical, half_vector, join, reflect, split
from nacre.soundness.result import NotApplicableError
from nacre.soundness.subject import Subject

VIEWS = (0.0, 30.0, 60.0, 75.0, 85.0)
"""Polar angles of views in degrees at which integrals are taken."""

_FINEST = 1e-7  # of 1 - cos theta_h: half vectors closer to the normal are spread evenly
_RANGE = math.log((1.0 + _FINEST) / _FINEST)
_EXTREME = 0.0, 1e-6, 1e-4, 1e-2, 1.0, 30.0, 60.0, 85.0, 89.0, 89.9, 89.99, 89.999
_AZIMUTHS = (0.0, 90.0, 180.0, -90.0, 17.0, 197.0)


@dataclass(frozen=True)
class Plan:
    """How hard to look."""

    samples: int = 1 << 17
    """Directions drawn for each view where densities are compared with samples."""
    seed: int = 0

    def random(self, *which: int) -> np.random.Generator:
        """Numbers for one use, which do not change when others draw more."""
        return np.random.default_rng((self.seed, *which))


def view(theta: float, phi: float = 0.0) -> Floats:
    """A direction from angles in degrees, shape (3,)."""
    return join(from_spherical(np.float64(math.radians(theta)), np.float64(math.radians(phi))))


def views() -> list[Floats]:
    """The directions of :data:`VIEWS`, each at an azimuth of its own."""
    return [view(theta, 34.0 + 109.0 * index) for index, theta in enumerate(VIEWS)]


def extreme_pairs() -> tuple[Floats, Floats]:
    """All pairs of directions from the pole to next to the horizon, mirrored and equal ones too."""
    theta, phi = (np.radians(x).ravel() for x in np.meshgrid(_EXTREME, _AZIMUTHS, indexing="ij"))
    w = np.unique(join(from_spherical(theta, phi)).round(15), axis=0)
    first, second = np.meshgrid(np.arange(len(w)), np.arange(len(w)), indexing="ij")
    return w[first.ravel()], w[second.ravel()]


def spread(wo: Floats, u: Floats) -> tuple[Floats, Floats]:
    """Directions to the light that resolve highlights of any width, and their densities.

    A third each is drawn by the cosine, evenly over the hemisphere, and by half vectors that are
    spread evenly in the logarithm of their distance from the normal.

    Parameters
    ----------
    wo
        A view, shape (3,), or one for each direction, shape (n, 3).
    u
        Numbers in [0, 1), shape (n, 3).

    Returns
    -------
    wi, density
        Shapes (n, 3) and (n,); a density of 0 for what fell below the horizon.
    """
    wo = np.broadcast_to(wo, u.shape)
    part = np.minimum((3.0 * u[:, 0]).astype(int), 2)
    phi = 2.0 * math.pi * u[:, 2]
    cosine = np.where(part == 0, np.sqrt(1.0 - u[:, 1]), 1.0 - u[:, 1])
    near = np.minimum(_FINEST * (np.exp(_RANGE * u[:, 1]) - 1.0), 1.0)  # 1 - cos theta_h
    cosine = np.where(part == 2, 1.0 - near, cosine)
    sine = np.sqrt(np.where(part == 2, near * (2.0 - near), 1.0 - cosine * cosine))
    w = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)
    mirrored = join(reflect(split(wo), split(w)))
    wi = np.where((part == 2)[:, None], mirrored, w)
    return wi, spread_density(wi, wo)


def spread_density(wi: Floats, wo: Floats) -> Floats:
    """Density of :func:`spread` in 1/sr, shape (n,); 0 below the horizon."""
    a, b = split(wi), split(wo)
    with np.errstate(all="ignore"):
        half = half_vector(a, b)
        near = (half[0] ** 2 + half[1] ** 2) / (1.0 + np.abs(half[2]))
        facing = np.maximum(dot(b, half), 1e-12)
        sharp = 1.0 / ((near + _FINEST) * _RANGE * 2.0 * math.pi * 4.0 * facing)
    density = (np.maximum(wi[:, 2], 0.0) / math.pi + 0.5 / math.pi + sharp) / 3.0
    return np.where(wi[:, 2] > 0.0, density, 0.0)


def stratified(random: np.random.Generator, count: int) -> Floats:
    """Numbers in [0, 1), shape (n, 3), one in each cell of a lattice of at least `count` cells."""
    side = max(2, math.ceil((count / 3.0) ** 0.5))
    a, b, c = (x.ravel() for x in np.meshgrid(np.arange(3), *[np.arange(side)] * 2, indexing="ij"))
    jitter = random.random((3, len(a)))
    return np.stack(
        [(a + jitter[0]) / 3.0, (b + jitter[1]) / side, (c + jitter[2]) / side], axis=-1
    )


def pairs(subject: Subject, plan: Plan, count: int, which: int) -> tuple[Floats, Floats, Floats]:
    """Pairs of directions above the horizon where light is reflected, and weights for integrals.

    Views are as dense as the cosine; lights are those of :func:`spread` and, where the material has
    a sampler, of that.

    Returns
    -------
    wi, wo, weight
        Shapes (n, 3), (n, 3) and (n,): both cosines over the density of the pair, for lights of
        `spread`, and 0 for others.
    """
    random = plan.random(which)
    u = random.random((count, 5))
    radius, phi = np.sqrt(u[:, 0]), 2.0 * math.pi * u[:, 1]
    height = np.sqrt(np.maximum(1.0 - u[:, 0], 1e-8))
    wo = np.stack([radius * np.cos(phi), radius * np.sin(phi), height], axis=-1)
    wi, density = spread(wo, u[:, 2:])
    # Views have the density cos / pi: of the pair's two cosines one stays.
    weight = math.pi * np.maximum(wi[:, 2], 0.0) / np.where(density > 0.0, density, math.inf)
    try:
        drawn = subject.sample(wo[: count // 2], random.random((count // 2, 3)))
    except NotApplicableError:
        drawn = None
    if drawn is not None:
        good = (drawn.pdf > 0.0) & np.isfinite(drawn.wi).all(axis=1) & (drawn.wi[:, 2] > 0.0)
        wi = np.concatenate([wi, drawn.wi[good]])
        wo = np.concatenate([wo, wo[: count // 2][good]])
        weight = np.concatenate([weight, np.zeros(good.sum())])
    seen = wi[:, 2] > 1e-4
    return wi[seen], wo[seen], weight[seen]
