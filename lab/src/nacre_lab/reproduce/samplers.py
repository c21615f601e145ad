"""Samplers of reflectances that figures 13 to 16 compare, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from nacre.analytic.labels import fitted_lobes
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.errors import NacreError
from nacre.latent.predicting import BY_LABELS, PredictingBasis
from nacre.measured.microfacet_warp import microfacet_sampler
from nacre.measured.rgl import RglBrdf, tabulate
from nacre.sampling import UniformSampler, fit_blinn_phong, fit_lobes

FITTED: Mapping[str, Callable[[Brdf], Sampler]] = {
    "uniform": lambda brdf: UniformSampler(),
    "cosine": lambda brdf: CosineSampler(),
    "blinn-phong-fitted": lambda brdf: fitted_lobes(brdf, "blinn-phong"),
    "ggx-fitted": lambda brdf: fitted_lobes(brdf, "ggx"),
    "blinn-phong": fit_blinn_phong,
    "power-iterations": microfacet_sampler,
    "rgl": lambda brdf: (brdf if isinstance(brdf, RglBrdf) else tabulate(brdf)).sampler,
    "nacre": fit_lobes,
    "own": lambda brdf: brdf.sampler,
}
"""Samplers that need only the reflectance. Those ending in "-fitted" are lobes of the most similar
analytic model, the paper's labels; "blinn-phong" and "nacre" have the least variance. "rgl" is the
warp of its table, or of a table made from it; "own" is the reflectance's own sampler."""


class Predicted(NamedTuple):
    """A kind of basis, and the name of its predictor."""

    kind: str
    predictor: str


PREDICTED: Mapping[str, Predicted] = {
    "paper-blinn-phong": Predicted("autoencoder", f"blinn-phong{BY_LABELS}"),
    "paper-ggx": Predicted("autoencoder", f"ggx{BY_LABELS}"),
    "autoencoder-blinn-phong": Predicted("autoencoder", "blinn-phong"),
    "autoencoder-ggx": Predicted("autoencoder", "ggx"),
    "blinn-phong-predicted": Predicted("neural", "blinn-phong"),
    "ggx-predicted": Predicted("neural", "ggx"),
    "nacre-predicted": Predicted("neural", "mixture"),
}
"""Samplers predicted from codes. The first two are the paper's pipeline: a network, the encoder,
parameters learned from labels; the next two minimize variance for the same codes; the others are
nacre's."""

DEFAULT = (
    *("uniform", "blinn-phong-fitted", *PREDICTED),
    *("blinn-phong", "power-iterations", "rgl", "nacre"),
)
"""The samplers compared by default."""
SAMPLERS = tuple(dict.fromkeys((*DEFAULT, *FITTED)))
"""All names."""


def find_sampler(
    name: str, basis_of: Callable[[Brdf, str], PredictingBasis] | None = None
) -> Callable[[Brdf], Sampler]:
    """A function that gives a reflectance its sampler.

    Parameters
    ----------
    name
        One of :data:`FITTED` or :data:`PREDICTED`.
    basis_of
        Gives the basis of a kind that predicts for a reflectance; needed for the latter, which must
        then be isotropic.

    Raises
    ------
    NacreError
        If a basis is needed and not given; when called, if it predicts no such lobes.
    """
    if name in FITTED:
        return FITTED[name]
    if basis_of is None:
        raise NacreError(f"{name}: needs a basis")
    kind, predictor = PREDICTED[name]

    def predicted(brdf: Brdf) -> Sampler:
        basis = basis_of(brdf, kind)
        predict = basis.predictors.get(predictor)
        if predict is None:
            raise NacreError(f"{name}: the basis has no predictor {predictor!r}")
        # An encoder's code is used unrefined, as in section 3.3.
        return predict(basis.encode(brdf, refine=not basis.projects))

    return predicted
