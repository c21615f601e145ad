"""Analytic reflectance: one module a model, their fit, and their files."""

from nacre.analytic import file, tables
from nacre.analytic.catalogue import MODELS
from nacre.analytic.fitting import fit
from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.analytic.model import AnalyticBrdf, Parameter
from nacre.io.format import Format

FORMATS: tuple[Format, ...] = (file.FORMAT, tables.FORMAT)
"""Every format of analytic reflectance."""

__all__ = ["FORMATS", "MODELS", "AnalyticBrdf", "AnisotropicGgx", "Ggx", "Parameter", "fit"]
