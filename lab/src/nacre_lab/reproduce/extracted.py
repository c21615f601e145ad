"""Microfacets found by power iteration: 540 numbers from which f_r and samples both come.

Dupuy, Heitz, Iehl, Poulin and Ostromoukhov 2015; Table 3 of the NBRDF paper counts 2.16 KB. Beside
the tables of :class:`nacre.analytic.power_iteration.TabulatedMicrofacets` there are 90 sums of the
density of normals, about which the view is mirrored.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre import analytic
from nacre.analytic.factor import NODES, half_angles
from nacre.analytic.power_iteration import TabulatedMicrofacets
from nacre.array import Array, Components, Table, namespace
from nacre.brdf import Brdf, Sampler
from nacre.geometry import dot, from_spherical, half_vector, reflect, to_spherical
from nacre.measured.axis import bisect, zero_index

_UNIFORM = 0.01  # fraction of normals in any direction, so that all reflected light is sampled
_QUARTER = 0.5 * math.pi
_STEPS = NODES - 1
_TINY = 1e-30  # least divisor


class NormalSampler(Sampler):
    """The view, mirrored about normals h of density D(h) cos(theta_h).

    Over x = sqrt(2 theta_h / pi) the density is linear between nodes, so its sums can be inverted
    in closed form. Directions below the horizon do not count: the density integrates to less than
    one.

    Parameters
    ----------
    distribution
        D at the nodes of :func:`nacre.analytic.factor.half_angles`, shape (90,), not all 0.
    """

    def __init__(self, distribution: npt.ArrayLike) -> None:
        theta = half_angles()
        area = 2.0 * math.pi * np.sin(theta) * math.pi * np.linspace(0.0, 1.0, NODES)

        def scaled(density: npt.ArrayLike) -> npt.NDArray[np.float64]:
            mass = np.asarray(density, np.float64) * np.cos(theta) * area
            return np.asarray(mass / (0.5 * (mass[1:] + mass[:-1])).sum())

        mass = (1.0 - _UNIFORM) * scaled(distribution) + _UNIFORM * scaled(np.ones(NODES))
        sums = np.concatenate([[0.0], np.cumsum(0.5 * (mass[1:] + mass[:-1]))])
        self._mass, self._sums = Table(mass), Table(sums)

    def __str__(self) -> str:
        return "normals by power iteration"

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; uses the last two numbers."""
        xp = namespace(*wo, *u)
        value = u[1] + 0.0 * wo[2]
        index = bisect(lambda i: xp.take(self._sums, i), value, zero_index(value), _STEPS)
        low, high = xp.take(self._mass, index), xp.take(self._mass, index + 1)
        left = value - xp.take(self._sums, index)
        root = xp.sqrt(xp.maximum(low * low + 2.0 * (high - low) * left, 0.0))
        part = xp.minimum(2.0 * left / xp.maximum(low + root, _TINY), 1.0)
        x = (xp.to_float(index, part) + part) / _STEPS
        h = from_spherical(x * x * _QUARTER, 2.0 * math.pi * u[2])
        wi = reflect(wo, h)
        return wi, self._density(low + part * (high - low), x, h, wi, wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        xp, h = namespace(*wi, *wo), half_vector(wi, wo)
        x = xp.sqrt(to_spherical(h)[0] / _QUARTER)
        place = xp.minimum(xp.maximum(x, 0.0), 1.0) * _STEPS
        index = xp.maximum(xp.minimum(xp.to_index(place), _STEPS - 1), 0)
        low, high = xp.take(self._mass, index), xp.take(self._mass, index + 1)
        part = place - xp.to_float(index, place)
        return self._density(low + part * (high - low), x, h, wi, wo)

    @staticmethod
    def _density(mass: Array, x: Array, h: Components, wi: Components, wo: Components) -> Array:
        """Density of a direction from that of x, given per step between two nodes."""
        xp = namespace(mass)
        # sin(theta_h) is like x^2: both vanish at the pole, where the density is cut off.
        area = 2.0 * math.pi**2 * x * xp.sqrt(h[0] * h[0] + h[1] * h[1])
        facing = dot(wo, h)
        value = _STEPS * mass / (xp.maximum(area, 1e-9) * 4.0 * xp.maximum(facing, 1e-6))
        return xp.where((wi[2] > 0.0) & (facing > 0.0), value, 0.0 * value)


class ExtractedMicrofacets(Brdf):
    """Tables of D, its projected area and F, and the sums of D for sampling."""

    isotropy_known = True

    def __init__(self, brdf: Brdf) -> None:
        self._tables = analytic.fit(brdf, TabulatedMicrofacets)
        (distribution,) = np.asarray(self._tables.values["distribution"])
        super().__init__(name=brdf.name, source=brdf.source, sampler=NormalSampler(distribution))

    def eval_components(self, wi: Components, wo: Components) -> Components:
        return self._tables.eval_components(wi, wo)

    @property
    def nbytes(self) -> int:
        """Bytes of the tables and the sums, as counted in the paper: 2,160."""
        return self._tables.nbytes + 4 * NODES
