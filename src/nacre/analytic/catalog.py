"""Every analytic model, by the name it has in files and on the command line."""

from __future__ import annotations

from nacre.analytic.model import AnalyticBrdf
from nacre.registry import Registry

_PLACES = {
    "lambert": "lambert:Lambert",
    "blinn-phong": "phong:BlinnPhong",
    "lafortune": "phong:Lafortune",
    "ward": "gaussian:Ward",
    "ward-duer": "gaussian:WardDuer",
    "ashikhmin-shirley": "phong:AshikhminShirley",
    "ashikhmin-shirley-dielectric": "phong:DielectricAshikhminShirley",
    "cook-torrance": "gaussian:CookTorrance",
    "cook-torrance-schlick": "gaussian:SchlickCookTorrance",
    "ggx": "ggx:Ggx",
    "ggx-anisotropic": "ggx:AnisotropicGgx",
    "abc-microfacet": "abc:AbcMicrofacet",
    "abc-smooth": "abc:AbcSmooth",
    "sgd": "sgd:Sgd",
    "tabulated-microfacets": "power_iteration:TabulatedMicrofacets",
    "npf": "npf:Npf",
}

MODELS: Registry[type[AnalyticBrdf]] = Registry(
    "nacre.models", "model", {name: f"nacre.analytic.{place}" for name, place in _PLACES.items()}
)
"""Classes of models by their `model`; packages add theirs by an entry point of the group
`nacre.models`.
"""
