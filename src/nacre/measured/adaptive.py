"""The adaptive parametrization of the RGL database, as a map and as a sampler.

A measurement is conditioned on one direction, here `wo`; for each, a density of visible half
vectors (`vndf`) maps the unit square to half vectors, so that samples lie densest where the
material reflects (Dupuy and Jakob 2018, section 3). Evaluation runs the map backwards; sampling
draws a point of the square by luminance, then runs it forwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.geometry import dot, from_spherical, half_vector, reflect, to_spherical
from nacre.measured.axis import Axis, Blend, outer
from nacre.measured.rgl_tables import RglTables
from nacre.measured.warp import Warp

_MIN_JACOBIAN = 1e-6  # bounds the density at the pole, where the map from the square degenerates
_MIN_COSINE = 1e-6  # and where directions are opposite: rounding may turn the product negative


class View(NamedTuple):
    """What depends on `wo` alone."""

    wo: Components  # mirrored into the measured range of azimuths
    signs: tuple[Array, Array]  # 1 or -1, by which x and y are multiplied to get there and back
    theta: Array
    phi: Array
    blend: Blend  # slices of the tables


class Point(NamedTuple):
    """Where a pair of directions lies in the tables."""

    u: Array
    v: Array  # point of the measured square
    x: Array  # sqrt(2 theta / pi) of the half vector
    y: Array  # azimuth of the half vector / (2 pi) + 1/2, from `wo` if isotropic
    density: Array  # density of `wi` over solid angle if (u, v) is uniform


class AdaptiveWarp(Sampler):
    """The map between the unit square, half vectors and `wi` for a given `wo`; a sampler."""

    def __init__(self, tables: RglTables, about: str = "the table's own warp") -> None:
        self._about = about
        self.isotropic = tables.isotropic
        self.reduction = tables.reduction
        self._phi = Axis(tables.phi_i)
        self._theta = Axis(tables.theta_i)
        self._vndf = Warp(tables.vndf.reshape(-1, *tables.vndf.shape[2:]))
        self._luminance = Warp(tables.luminance.reshape(-1, *tables.luminance.shape[2:]))

    def __str__(self) -> str:
        return self._about

    def view(self, wo: Components) -> View:
        """Mirror `wo` into the measured range of azimuths and find its slices.

        With a reduction of 2 the material is unchanged by a rotation of 180 degrees, with 4 also by
        mirroring; the tables then start at azimuth -pi.
        """
        xp = namespace(*wo)
        one = 0.0 * wo[0] + 1.0
        signs = one, one
        if self.reduction >= 2:
            sign_y = xp.where(wo[1] >= 0.0, -one, one)
            signs = (xp.where(wo[0] >= 0.0, -one, one) if self.reduction == 4 else sign_y), sign_y
            wo = _mirrored(wo, signs)
        theta, phi = to_spherical(wo)
        if self.reduction >= 2:
            phi = -xp.abs(phi)  # a zero may have come out as +pi
        blend = outer(self._phi.blend(phi), self._theta.blend(theta), len(self._theta))
        return View(wo, signs, theta, phi, blend)

    def invert(self, wi: Components, view: View) -> Point:
        """The point of the measured square that belongs to `wi`."""
        m = half_vector(_mirrored(wi, view.signs), view.wo)
        xp = namespace(*m)
        theta, phi = to_spherical(m)
        x = unit_elevation(theta)
        y = unit_azimuth(phi - view.phi if self.isotropic else phi)
        y = y - xp.floor(y)
        u, v, density = self._vndf.invert(x, y, view.blend)
        return Point(u, v, x, y, density / _jacobian(x, m, view.wo))

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; uses the last two numbers."""
        view = self.view(wo)
        s, t, luminance = self._luminance.sample(u[2], u[1], view.blend)
        x, y, density = self._vndf.sample(s, t, view.blend)
        phi = (2.0 * y - 1.0) * math.pi
        m = from_spherical(x * x * (0.5 * math.pi), phi + view.phi if self.isotropic else phi)
        wi = _mirrored(reflect(view.wo, m), view.signs)
        pdf = luminance * density / _jacobian(x, m, view.wo)
        xp = namespace(pdf)
        return wi, xp.where(wi[2] > 0.0, pdf, 0.0 * pdf)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        view = self.view(wo)
        point = self.invert(wi, view)
        return self._luminance.eval(point.u, point.v, view.blend) * point.density


def _mirrored(w: Components, signs: tuple[Array, Array]) -> Components:
    return w[0] * signs[0], w[1] * signs[1], w[2]


def unit_elevation(theta: Array) -> Array:
    """Coordinate of a polar angle: sqrt(2 theta / pi)."""
    return namespace(theta).sqrt(theta * (2.0 / math.pi))


def unit_azimuth(phi: Array) -> Array:
    """Coordinate of an azimuth: phi / (2 pi) + 1/2."""
    return phi * (0.5 / math.pi) + 0.5


def _jacobian(x: Array, m: Components, wo: Components) -> Array:
    """Solid angle of `wi` per area of the square around the half vector `m`."""
    xp = namespace(x)
    sin_theta = xp.sqrt(m[0] * m[0] + m[1] * m[1])
    return xp.maximum(2.0 * math.pi**2 * x * sin_theta, _MIN_JACOBIAN) * (
        4.0 * xp.maximum(dot(wo, m), _MIN_COSINE)
    )
