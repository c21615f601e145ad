"""Analytic reflectance: one module a model, their fit, and their files."""

from nacre.analytic.catalogue import MODELS
from nacre.analytic.file import FORMAT
from nacre.analytic.fit import fit
from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.analytic.model import AnalyticBrdf, Parameter

FORMATS = (FORMAT,)

__all__ = ["FORMATS", "MODELS", "AnalyticBrdf", "AnisotropicGgx", "Ggx", "Parameter", "fit"]
