"""Neural reflectance: the NBRDF, its files, and its fit."""

from nacre.neural.fitting import fit, fit_many
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.recipe import Recipe
from nacre.neural.spectral import SpectralBrdf
from nacre.neural.spectral_fit import fit_spectral
from nacre.numerics.mlp import Layer

__all__ = ["Layer", "NeuralBrdf", "Recipe", "SpectralBrdf", "fit", "fit_many", "fit_spectral"]
