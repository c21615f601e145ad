"""Every analytic model, by the name it has in files and on the command line."""

from __future__ import annotations

from nacre.analytic.abc import AbcMicrofacet, AbcSmooth
from nacre.analytic.ashikhmin_shirley import AshikhminShirley, DielectricAshikhminShirley
from nacre.analytic.cook_torrance import CookTorrance, SchlickCookTorrance
from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.analytic.lambert import Lambert
from nacre.analytic.model import AnalyticBrdf
from nacre.analytic.npf import Npf
from nacre.analytic.phong import BlinnPhong, Lafortune
from nacre.analytic.power_iteration import TabulatedMicrofacets
from nacre.analytic.sgd import Sgd
from nacre.analytic.ward import Ward, WardDuer

_CLASSES: tuple[type[AnalyticBrdf], ...] = (
    Lambert,
    BlinnPhong,
    Lafortune,
    Ward,
    WardDuer,
    AshikhminShirley,
    DielectricAshikhminShirley,
    CookTorrance,
    SchlickCookTorrance,
    Ggx,
    AnisotropicGgx,
    AbcMicrofacet,
    AbcSmooth,
    Sgd,
    TabulatedMicrofacets,
    Npf,
)

MODELS: dict[str, type[AnalyticBrdf]] = {kind.model: kind for kind in _CLASSES}
