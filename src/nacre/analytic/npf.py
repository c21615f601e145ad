"""The non-parametric factor microfacet model of Bagher, Snyder and Nowrouzezahrai 2016, "A
Non-Parametric Factor Microfacet Model for Isotropic BRDFs".
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nacre.analytic.factor import NODES, FactoredBrdf, half_angles, locate, lookup
from nacre.analytic.factorization import Channel, Factors, draw
from nacre.analytic.gaussian import cosine_product
from nacre.analytic.model import DIFFUSE, Parameter, TableParameter, Values, lambertian
from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress

SPECULAR = Parameter("specular", 0.0, 1e12, (0.01, 1.0), color=True)
"""Scale of the product; far from 1 where F or G are largest at angles that hardly occur."""


class Npf(FactoredBrdf):
    """specular D(theta_h) F(theta_d) G(theta_i) G(theta_o) / (cos theta_i cos theta_o) over a
    Lambertian base, each per channel.

    Two colors and three tables of 90 nodes are 816 numbers, 3264 bytes: the paper's 3.2 KB. The
    nodes are the paper's too; between them D and F are linear here, constant there. D cos theta_h
    integrates to 1, F and G have a largest value of 1.
    """

    model = "npf"
    parameters = (DIFFUSE, SPECULAR)
    tables = (
        TableParameter("distribution", 3, NODES, 1e12),
        TableParameter("fresnel", 3, NODES, 1.0),
        TableParameter("masking", 3, NODES, 1.0),
    )

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        cells = locate(wi, wo)
        scale = 1.0 / cosine_product(wi, wo)
        base, masking = lambertian(values), values["masking"]

        def channel(k: int) -> Array:
            seen = lookup(masking, k, cells.light) * lookup(masking, k, cells.view)
            facets = lookup(values["distribution"], k, cells.half) * seen * scale
            fresnel = lookup(values["fresnel"], k, cells.difference)
            return base[k] + values["specular"][k] * fresnel * facets

        return channel(0), channel(1), channel(2)

    @classmethod
    def extract(
        cls, brdf: Brdf, samples: DirectionSamples, gain: float, seed: int, report: Progress
    ) -> tuple[dict[str, Any], dict[str, float]]:
        weights = np.ones(len(samples))
        if brdf.scattered() is None:
            samples, weights = draw(brdf, samples, seed)

        def fitted(channel: int) -> Factors:
            with np.errstate(all="ignore"):  # the setting belongs to a thread
                return Channel(samples, channel, weights, gain).fit()

        channels = []
        for factors in thread_map(fitted, range(3)):
            channels.append(factors)
            report("fitting", len(channels), 3, "")
        return _normalised(channels), {}


def _normalised(channels: list[Factors]) -> dict[str, Any]:
    """Values of the model; what tables lose in size, `specular` gains."""
    theta = half_angles()
    weights = (
        2.0 * math.pi * np.sin(theta) * np.cos(theta) * np.gradient(theta)
    )  # the trapezoidal rule; the ends have no solid angle
    rows: dict[str, list[Any]] = {p.name: [] for p in Npf.numbers()}
    for base, distribution, fresnel, masking in channels:
        density, reflected, seen = weights @ distribution, fresnel.max(), masking.max()
        rows["diffuse"].append(min(math.pi * base, DIFFUSE.high))
        rows["specular"].append(min(density * reflected * seen**2, SPECULAR.high))
        rows["distribution"].append(distribution / density)
        rows["fresnel"].append(fresnel / reflected)
        rows["masking"].append(masking / seen)
    return rows
