"""Ways to sample a reflectance that figures 13 to 16 compare, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import NacreError
from nacre.latent.basis import LatentBasis
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.measured.rgl import RglBrdf, tabulate
from nacre.sampling import UniformSampler, fit_blinn_phong, fit_lobes

FITTED: Mapping[str, Callable[[Brdf], Sampler]] = {
    "uniform": lambda brdf: UniformSampler(),
    "cosine": lambda brdf: CosineSampler(),
    "blinn-phong": fit_blinn_phong,
    "power-iterations": microfacet_sampler,
    "rgl": lambda brdf: (brdf if isinstance(brdf, RglBrdf) else tabulate(brdf)).sampler,
    "nacre": fit_lobes,
    "own": lambda brdf: brdf.sampler,
}
"""What needs the reflectance only. "rgl" is the warp of its table, of one made of it where it is
none; "own" is the sampler that the reflectance has."""

PREDICTED: Mapping[str, str] = {
    "blinn-phong-predicted": "blinn-phong",
    "ggx-predicted": "ggx",
    "nacre-predicted": "mixture",
}
"""Names of what a basis predicts, and of its predictors."""

DEFAULT = ("uniform", "blinn-phong", *PREDICTED, "power-iterations", "rgl", "nacre")
"""What is compared where no names are given."""
SAMPLERS = tuple(dict.fromkeys((*DEFAULT, *FITTED)))
"""All names."""


def find_sampler(name: str, basis: LatentBasis | None = None) -> Callable[[Brdf], Sampler]:
    """What gives a reflectance its sampler.

    Parameters
    ----------
    name
        One of :data:`FITTED` or :data:`PREDICTED`.
    basis
        With predictors, for the latter; reflectances have to be isotropic then.

    Raises
    ------
    NacreError
        If a basis is needed and not given, or predicts no such lobes.
    """
    if name in FITTED:
        return FITTED[name]
    predict = basis.predictors.get(PREDICTED[name]) if basis is not None else None
    if basis is None or predict is None:
        raise NacreError(f"{name}: needs --basis with predictors, from nacre latent train")
    return lambda brdf: predict(basis.encode(brdf))
