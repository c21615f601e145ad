"""The closest reflectance to another that is reciprocal and reflects no more light than it gets."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Array, Components, Floats
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join, split
from nacre.sampling.energy import elevation, half_vector_rule, views

LIMIT = 0.95
"""Largest albedo of what a fit is made to: what is left below 1 is for its errors."""

_POLAR, _AZIMUTHS = 48, 16  # views at which a projection is darkened
_STEPS = 200
_ORDERS = 24, 12  # of the integrals at each: of isotropic and of other materials
_RIM = 0.01  # cosine of the light below which tables, which divide by it, count less
_LOWEST = 1e-20  # a cosine that is not 0


class Projection(Brdf):
    """A reflectance made reciprocal and limited in energy.

    f'(wi, wo) = s(wi) s(wo) (f(wi, wo) + f(wo, wi)) / 2, or f in one order where it is not known in
    the other. The factors s of each channel are 1 where the albedo allows it, and elsewhere keep it
    at the limit, in (0, 1]: linear between nodes in the logarithm of cos theta + 0.01 and in the
    azimuth.
    """

    traceable = False
    isotropy_known = True
    physical = True

    def __init__(self, brdf: Brdf, limit: float = LIMIT) -> None:
        super().__init__(name=brdf.name, source=brdf.source, sampler=brdf.sampler)
        self.isotropic = brdf.isotropic
        self._brdf = brdf
        self.factors: Floats | None = None
        """Factors s at the nodes, shape (polar angles, azimuths, 3); None where all are 1."""
        self.factors = self._solved(limit)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        brdf = self._brdf
        total: list[Array] = [0.0, 0.0, 0.0]
        weights: Array = 0.0
        for light, view in ((wi, wo), (wo, wi)):
            cosine = np.maximum(light[2], _LOWEST)
            known = brdf.valid_components(light, view)
            weight = np.where(known, cosine / (cosine + _RIM), 0.0)
            weights = weights + weight
            values = brdf.eval_components(light, view)
            total = [
                t + np.where(known, np.maximum(v, 0.0) * weight, 0.0)
                for t, v in zip(total, values, strict=True)
            ]
        red, green, blue = (t / np.maximum(weights, _LOWEST) for t in total)
        if self.factors is None:
            return red, green, blue
        s = self._factor(wi) * self._factor(wo)
        return red * s[..., 0], green * s[..., 1], blue * s[..., 2]

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return self._brdf.valid_components(wi, wo) | self._brdf.valid_components(wo, wi)

    def _factor(self, w: Components) -> Floats:
        assert self.factors is not None
        table = self.factors.reshape(-1, 3)
        total: Floats = sum(f[..., None] * table[k] for k, f in _nodes(w, self.factors.shape[1]))
        return total.astype(np.result_type(*w), copy=False)

    def _solved(self, limit: float) -> Floats | None:
        """Factors from a damped fixed point of s(o) = min(1, limit / sum over i of A(o,
        i) s(i)).
        """
        theta, phi = views(_POLAR, 1 if self.isotropic else _AZIMUTHS)
        count, order = theta.size, _ORDERS[not self.isotropic]
        reflected = np.empty((count, count, 3))
        for view in range(count):
            one = theta.ravel()[view : view + 1], phi.ravel()[view : view + 1]
            wi, weights = half_vector_rule(*one, order)
            f_r = self.eval(wi[0], join(from_spherical(*one))).astype(float)
            parts = _nodes(split(wi[0]), theta.shape[1])
            for c in range(3):
                value = weights[0] * f_r[:, c]
                reflected[view, :, c] = sum(
                    np.bincount(node, fraction * value, count) for node, fraction in parts
                )
        if reflected.sum(axis=1).max() <= limit:
            return None
        s = np.ones((count, 3))
        for _ in range(_STEPS):
            most = limit / np.maximum(np.einsum("oic,ic->oc", reflected, s), 1e-30)
            s = np.sqrt(s * np.minimum(most, 1.0))
        return s.reshape(*theta.shape, 3)


def _nodes(w: Components, azimuths: int) -> list[tuple[Array, Array]]:
    """Flat indices of the nodes of a projection about a direction, and their fractions."""
    row = np.minimum(elevation(w[2]), 1.0) * (_POLAR - 1)
    phi = np.arctan2(w[1], w[0])
    column = phi * (azimuths / (2.0 * math.pi)) if azimuths > 1 else 0.0 * phi
    i, j = np.floor(row).astype(int), np.floor(column).astype(int)
    u, v = row - i, column - j
    upper = np.minimum(i + 1, _POLAR - 1)
    nodes = [(i * azimuths + j % azimuths, (1.0 - u) * (1.0 - v))]
    nodes.append((upper * azimuths + j % azimuths, u * (1.0 - v)))
    if azimuths > 1:
        beside = (j + 1) % azimuths
        nodes += [(i * azimuths + beside, (1.0 - u) * v), (upper * azimuths + beside, u * v)]
    return nodes
