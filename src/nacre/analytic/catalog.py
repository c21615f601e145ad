"""Every analytic model, by the name it has in files and on the command line."""

from __future__ import annotations

from nacre.analytic.model import AnalyticBrdf
from nacre.registry import Registry

MODELS: Registry[type[AnalyticBrdf]] = Registry(
    "nacre.models",
    "model",
    {
        "lambert": "nacre.analytic.lambert:Lambert",
        "blinn-phong": "nacre.analytic.phong:BlinnPhong",
        "lafortune": "nacre.analytic.phong:Lafortune",
        "ward": "nacre.analytic.gaussian:Ward",
        "ward-duer": "nacre.analytic.gaussian:WardDuer",
        "ashikhmin-shirley": "nacre.analytic.phong:AshikhminShirley",
        "ashikhmin-shirley-dielectric": "nacre.analytic.phong:DielectricAshikhminShirley",
        "cook-torrance": "nacre.analytic.gaussian:CookTorrance",
        "cook-torrance-schlick": "nacre.analytic.gaussian:SchlickCookTorrance",
        "ggx": "nacre.analytic.ggx:Ggx",
        "ggx-anisotropic": "nacre.analytic.ggx:AnisotropicGgx",
        "abc-microfacet": "nacre.analytic.abc:AbcMicrofacet",
        "abc-smooth": "nacre.analytic.abc:AbcSmooth",
        "sgd": "nacre.analytic.sgd:Sgd",
        "tabulated-microfacets": "nacre.analytic.power_iteration:TabulatedMicrofacets",
        "npf": "nacre.analytic.npf:Npf",
    },
)
"""Classes of models by their `model`. Entry points in the group `nacre.models` add others: those of
other packages, and :mod:`nacre.standard`, which stands above."""
