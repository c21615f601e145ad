"""Lobes that sample a material as the analytic model fitted to its appearance is sampled.

Blinn-Phong and GGX have closed-form samplers with two numbers, a share of the highlight and its
width. Section 3.3 of the NBRDF paper takes both from fits of the models, and its lobe predictors
learn from them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from nacre.analytic.fitting import fit
from nacre.analytic.ggx import Ggx
from nacre.analytic.model import DIFFUSE, AnalyticBrdf
from nacre.analytic.phong import BlinnPhong
from nacre.brdf import Brdf, Sampler
from nacre.sampling.lobes import MAX_EXPONENT, BlinnPhongMixture
from nacre.sampling.mixture import GgxLobe, GgxMixture
from nacre.sampling.mixture_parameters import MIN_COSINE, ROUGHNESSES

MODELS: Mapping[str, type[AnalyticBrdf]] = {"blinn-phong": BlinnPhong, "ggx": Ggx}
"""Models by the name of the parametrization of their lobes."""

_SAMPLES, _STARTS = 10_000, 8  # of a fit
_NODES = 4096  # of the integral over polar angles


def fitted_lobes(brdf: Brdf, family: str, seed: int = 0) -> Sampler:
    """The lobes (:func:`model_lobes`) of a model of :data:`MODELS`, fitted to an isotropic
    reflectance.

    Raises NacreError if the model cannot be fitted.
    """
    return model_lobes(fit(brdf, MODELS[family], samples=_SAMPLES, starts=_STARTS, seed=seed))


def model_lobes(model: AnalyticBrdf) -> Sampler:
    """The lobe of a :class:`BlinnPhong` or :class:`Ggx` beside the cosine.

    Its share is that of the highlight in the albedo at normal incidence, averaged over the
    channels; its width is the model's, within the bounds of samplers.
    """
    share = min(highlight_share(model), 1.0 - MIN_COSINE)
    if isinstance(model, Ggx):
        alpha = float(np.clip(model.values["roughness"], *ROUGHNESSES))
        return GgxMixture((GgxLobe((share,), (alpha,), (alpha,), (0.0,)),))
    return BlinnPhongMixture(share, float(np.clip(model.values["exponent"], 1.0, MAX_EXPONENT)))


def highlight_share(model: AnalyticBrdf) -> float:
    """Part of a model's albedo at normal incidence beside the Lambertian one; 0 for black."""
    base = float(np.mean(model.values[DIFFUSE.name]))
    # Nodes stand as the squares of even steps, densely about the mirror direction.
    step = (np.arange(_NODES) + 0.5) / _NODES
    theta = 0.5 * math.pi * step**2
    weights = 2.0 * math.pi**2 * step / _NODES * np.sin(theta) * np.cos(theta)
    wi = np.stack([np.sin(theta), 0.0 * theta, np.cos(theta)], axis=-1)
    total = float(model.eval(wi, np.array([0.0, 0.0, 1.0])).mean(axis=-1) @ weights)
    return max(1.0 - base / total, 0.0) if total > 0.0 else 0.0
