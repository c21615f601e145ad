"""Importance sampling: lobe mixtures with exact densities, and their fit to a material."""

from nacre.sampling.fit import fit_lobes
from nacre.sampling.fitted import LobeSampledBrdf
from nacre.sampling.lobes import BlinnPhongMixture

__all__ = ["BlinnPhongMixture", "LobeSampledBrdf", "fit_lobes"]
