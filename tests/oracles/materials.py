"""Materials of every kind that exports have to hold, fitted when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

import nacre
from nacre import Recipe
from nacre.analytic.ggx import Ggx
from nacre.array import Components, namespace
from nacre.brdf import Brdf
from nacre.geometry import cosine_hemisphere, half_vector, join
from nacre.measured import ScatteredBrdf
from nacre.neural import NeuralBrdf
from tests.oracles.reflectances import Beckmann, Glossy

_DRAFT = Recipe(epochs=20, samples=100_000)


class _Flake(Glossy):
    """Gloss whose color turns with the angle between light and view, as pearl flakes have it."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        f = super().eval_components(wi, wo)[0]
        h = half_vector(wi, wo)
        hue = 6.0 * (h[0] * wi[0] + h[1] * wi[1] + h[2] * wi[2])
        return f * (0.6 + 0.4 * xp.cos(hue)), f * (0.5 + 0.3 * xp.sin(hue)), 0.7 * f


def _scan() -> Brdf:
    """Some thousand samples of a gloss, as a gonioreflectometer takes them."""
    random = np.random.default_rng(0)
    wi, wo = (join(cosine_hemisphere(*random.random((2, 6000)))) for _ in range(2))
    high = (wi[:, 2] > 0.17) & (wo[:, 2] > 0.17)
    wi, wo = wi[high], wo[high]
    return ScatteredBrdf(wi, wo, Glossy(0.4, 0.05, 0.25).eval(wi, wo), "scan")


TRUTHS: Mapping[str, tuple[Callable[[], Brdf], Recipe]] = {
    "diffuse": (lambda: Glossy(0.6, 0.0, 0.5), Recipe(epochs=20, samples=100_000, inputs="paper")),
    "glossy": (lambda: Glossy(0.3, 0.04, 0.2), _DRAFT),
    "metal": (lambda: Beckmann(0.0, 0.9, 0.15), _DRAFT),
    "near mirror": (lambda: Glossy(0.02, 0.9, 0.02), _DRAFT),
    "flake": (lambda: _Flake(0.2, 0.3, 0.12), _DRAFT),
    "anisotropic": (lambda: Glossy(0.05, 0.7, 0.1, 0.4), _DRAFT),
    "physical": (
        lambda: Glossy(0.3, 0.1, 0.2),
        Recipe(epochs=20, samples=100_000, physical=True),
    ),
    "scan": (_scan, Recipe(epochs=20)),
}
"""What each material is fitted to, and how."""

GGX = "ggx"
"""The analytic model that speeds are compared with."""

MATERIALS = (*TRUTHS, GGX)


@cache
def material(name: str) -> Brdf:
    """One of :data:`MATERIALS`: a fitted network with its sampler, or the analytic model."""
    if name == GGX:
        return Ggx(diffuse=(0.2, 0.1, 0.05), specular=(0.04, 0.04, 0.04), roughness=0.3)
    truth, recipe = TRUTHS[name]
    fitted: NeuralBrdf = nacre.fit(truth(), recipe)
    return fitted.replaced(name=name)
