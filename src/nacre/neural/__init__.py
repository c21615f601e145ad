"""Neural reflectance: the NBRDF, its files, and its fit."""

from nacre.neural.nbrdf import Layer, NeuralBrdf
from nacre.neural.recipe import Recipe
from nacre.neural.training import fit

__all__ = ["Layer", "NeuralBrdf", "Recipe", "fit"]
