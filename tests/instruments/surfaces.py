"""Surfaces whose readings are known: GGX and Beckmann facets as formulas of their own."""

from __future__ import annotations

import math

import numpy as np

from nacre.analytic import Ggx
from nacre.brdf import Brdf

BLACK = (0.0, 0.0, 0.0)
WHITE = (1.0, 1.0, 1.0)


def ggx(roughness: float) -> Ggx:
    """GGX facets that reflect everything."""
    return Ggx(diffuse=BLACK, specular=WHITE, roughness=roughness)


def ggx_values(wi: np.ndarray, wo: np.ndarray, roughness: float) -> np.ndarray:
    """f_r of the same at pairs of directions, by angles of the half vector (Heitz 2014)."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    tangent = (1.0 - h[..., 2] ** 2) / h[..., 2] ** 2
    d = roughness**2 / (math.pi * h[..., 2] ** 4 * (roughness**2 + tangent) ** 2)
    first, second = (
        0.5 * (np.sqrt(1.0 + roughness**2 * (1.0 / w[..., 2] ** 2 - 1.0)) - 1.0) for w in (wi, wo)
    )
    return d / (1.0 + first + second) / (4.0 * wi[..., 2] * wo[..., 2])


class Polished(Brdf):
    """Beckmann facets of roughness 0.001 with the Fresnel term of glass: all of the light stays in
    the receptor of a glossmeter.
    """

    def __init__(self, index: float) -> None:
        super().__init__(name="polished")
        self.index = index

    def eval_components(self, wi, wo):
        h = np.stack(wi, axis=-1) + np.stack(wo, axis=-1)
        h = h / np.linalg.norm(h, axis=-1, keepdims=True)
        cosine = (np.stack(wi, axis=-1) * h).sum(axis=-1)
        tangent = (1.0 - h[..., 2] ** 2) / h[..., 2] ** 2
        d = np.exp(-tangent / 1e-6) / (math.pi * 1e-6 * h[..., 2] ** 4)
        inside = np.sqrt(1.0 - (1.0 - cosine**2) / self.index**2)
        s = (cosine - self.index * inside) / (cosine + self.index * inside)
        p = (inside - self.index * cosine) / (inside + self.index * cosine)
        value = 0.5 * (s * s + p * p) * d / (4.0 * wi[2] * wo[2])
        return value, value, value
