"""Neural reflectance: the NBRDF, its files, and its fit."""

from nacre.neural.fit import Recipe, fit
from nacre.neural.nbrdf import Layer, NeuralBrdf

__all__ = ["Layer", "NeuralBrdf", "Recipe", "fit"]
