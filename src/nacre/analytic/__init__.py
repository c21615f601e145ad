"""Analytic reflectance: models, their fit, and their files."""

from nacre.analytic.catalog import MODELS
from nacre.analytic.fitting import fit
from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.analytic.model import AnalyticBrdf, Parameter

__all__ = ["MODELS", "AnalyticBrdf", "AnisotropicGgx", "Ggx", "Parameter", "fit"]
