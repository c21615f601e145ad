"""Microfacets of any reflectance: which normals it has, and which of them a direction sees.

Light sent straight back tells the density of microfacet normals D: with G the fraction that a
direction sees, f_r(o, o) cos(o) = F D(o) / (4 sigma(o)), where sigma(o), the projected area of all
facets, is the integral of D(m) max(m . o, 0) over normals m. So D is an eigenvector of a linear
operator, and power iteration finds it (Dupuy, Heitz, Iehl, Poulin and Ostromoukhov 2015,
"Extracting Microfacet-based BRDF Parameters from Arbitrary Materials with Power Iterations").
"""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats, Mask
from nacre.brdf import Brdf
from nacre.geometry import from_half_difference, from_spherical, join, split

GRAZING = math.radians(89.9)  # polar angle that stands for the horizon, at which f_r is not defined

_DIFFERENCE_AZIMUTHS = 16  # azimuths of the difference vector that a highlight is averaged over
_ITERATIONS = 100
_CONVERGED = 1e-5
_TINY_DENSITY = 1e-30


def polar_nodes(count: int) -> Floats:
    """Polar angles of `count` nodes that are even in sqrt(2 theta / pi), shape (count,)."""
    return np.linspace(0.0, 1.0, count) ** 2 * (0.5 * math.pi)


def azimuth_nodes(count: int) -> Floats:
    return np.linspace(-math.pi, math.pi, count)


class NormalGrid:
    """Functions of a direction on the unit square of an adaptive table, and their integrals.

    Values have the shape (azimuths, polars); nodes, two or more each way, are those of
    :func:`azimuth_nodes` and :func:`polar_nodes`. Isotropic functions do not depend on the azimuth.
    Densities D are in 1/sr.
    """

    def __init__(self, azimuths: int, polars: int, isotropic: bool) -> None:
        self.shape = azimuths, polars
        phi, theta = np.meshgrid(azimuth_nodes(azimuths), polar_nodes(polars), indexing="ij")
        self.normals = join(from_spherical(theta, phi))
        x = np.linspace(0.0, 1.0, polars)
        self.jacobian: Floats = 2.0 * math.pi**2 * x * np.sin(theta)
        """Solid angle per area of the square, shape (azimuths, polars)."""
        weights = _trapezoid(azimuths)[:, None] * _trapezoid(polars) * self.jacobian
        self._weights: Floats = weights
        rows = slice(0, 1) if isotropic else slice(None)  # one row stands for all
        low = np.minimum(theta[rows], GRAZING)
        self._views = join(from_spherical(low, phi[rows]))
        facing = self._views.reshape(-1, 3) @ self.normals.reshape(-1, 3).T
        self._facing = np.maximum(facing, 0.0).astype(np.float32)

    def projected_area(self, density: Floats) -> Floats:
        """sigma: the integral of D(m) max(m . o, 0) over normals, for directions o at the nodes."""
        area = self._facing @ (self._weights * density).ravel()
        return np.broadcast_to(area.reshape(self._views.shape[:2]), self.shape)

    def visible(self, density: Floats, theta: float, phi: float) -> Floats:
        """What a direction (radians) sees of normals of density D, per area of the square."""
        view = np.stack(from_spherical(theta, phi))
        return np.asarray(density * self.jacobian * np.maximum(self.normals @ view, 0.0))

    def normalized(self, density: Floats) -> Floats:
        """`density` scaled so that D(m) cos(m) integrates to 1; uniform where all is 0."""
        total = float(np.sum(self._weights * self.normals[..., 2] * density))
        if not total > 0.0:
            return np.full(self.shape, 1.0 / math.pi)
        return density / total

    def density(self, brdf: Brdf, correlated: bool = False) -> Floats:
        """Density of microfacet normals D of a reflectance, normalized.

        The eigenvector of f_r(o, o) cos(o) sigma(o) for the largest eigenvalue. Where f_r is not
        known it is interpolated along the polar angle. If `correlated`, light sent straight back is
        shadowed as in models that correlate heights and not directions (Heitz 2014, equation 99), 2
        sigma(o) - cos(o) standing for sigma(o); else what the viewer sees is lit.
        """
        back = _mended(*_known(brdf, self._views, self._views)) * self._views[..., 2]
        shadowed = self._views[..., 2] if correlated else 0.0
        density = self.normalized(np.zeros(self.shape))
        for _ in range(_ITERATIONS):
            previous = density
            area = self.projected_area(density)
            density = self.normalized(back * (2.0 * area - shadowed if correlated else area))
            if np.abs(density - previous).max() <= _CONVERGED * density.max():
                break
        return density

    def ggx_roughness(self, density: Floats) -> float:
        """Alpha of the isotropic GGX distribution with the mean slope of a normalized D.

        Dupuy et al. 2015: the mean of |tan theta| over slopes is pi alpha / 2.
        """
        sine = np.sqrt(1.0 - self.normals[..., 2] ** 2)
        return 2.0 / math.pi * float(np.sum(self._weights * density * sine))

    def beckmann_roughness(self, density: Floats) -> float:
        """Alpha of the isotropic Beckmann distribution with the variance of slopes of a normalized
        D.

        Dupuy et al. 2015: the mean of tan(theta)^2 over slopes is alpha^2.
        """
        cosine = self.normals[..., 2]
        above = cosine > math.cos(GRAZING)
        square = np.where(above, (1.0 - cosine**2) / np.where(above, cosine, 1.0), 0.0)
        return math.sqrt(float(np.sum(self._weights * density * square)))

    def highlight(self, brdf: Brdf, theta_d: float) -> Floats:
        """Mean of f_r, normalized, over pairs of directions at an angle (radians) from their half
        vector.

        At grazing angles it shows the normals of a coat that sends hardly anything straight back.
        """
        phi_d = 2.0 * math.pi * (np.arange(_DIFFERENCE_AZIMUTHS) + 0.5) / _DIFFERENCE_AZIMUTHS
        half = split(self._views[..., None, :])
        wi, wo = map(join, from_half_difference(half, from_spherical(theta_d + 0.0 * phi_d, phi_d)))
        value, known = _known(brdf, wi, wo)
        counts = known.sum(axis=-1)
        mean = value.sum(axis=-1) / np.maximum(counts, 1)
        return self.normalized(np.broadcast_to(_mended(mean, counts > 0), self.shape))


def _known(brdf: Brdf, wi: Floats, wo: Floats) -> tuple[Floats, Mask]:
    """Mean of the channels of f_r, 0 where it is not known, and where it is known."""
    value = brdf.eval(wi, wo).astype(np.float64).mean(axis=-1)
    known = brdf.valid(wi, wo) & np.isfinite(value)
    return np.where(known, value, 0.0), known


def _mended(values: Floats, known: Mask) -> Floats:
    """Values (rows, nodes) with what is not known interpolated along rows, at most 1."""
    nodes = np.arange(values.shape[1])
    mended = [
        np.interp(nodes, nodes[mask], row[mask]) if mask.any() else row
        for row, mask in zip(values, known, strict=True)
    ]
    return np.stack(mended) / max(float(values.max()), _TINY_DENSITY)


def _trapezoid(count: int) -> Floats:
    weights = np.full(count, 1.0 / (count - 1))
    weights[[0, -1]] *= 0.5
    return weights
