"""A space of materials: few values that stand for a whole reflectance."""

from nacre.latent.pca import Basis, PcaBrdf
from nacre.latent.refine import optimised
from nacre.latent.training import train

__all__ = ["Basis", "PcaBrdf", "optimised", "train"]
