"""What physics demands of a reflectance: that it gives back no more light than it gets, and the
same when light and viewer change places; and how much it changes when the surface turns.

Integrals are taken over fixed points (scrambled Sobol sets), drawn by the reflectance's own sampler
and by the cosine with the balance heuristic: the same call gives the same figures. Standard errors
come from the spread of :data:`nacre.metrics.draws.REPLICATES` sets. Where f_r is not known it
counts as 0 in an albedo; reciprocity and anisotropy leave such pairs out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, Mask
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join, uniform_hemisphere
from nacre.metrics.draws import REPLICATES, Proposal, draw_pairs, pair_density, sobol_sets
from nacre.runtime.parallel import thread_map

_ROTATIONS = 16


@dataclass(frozen=True)
class Estimate:
    """An integral, and its standard error in the same shape.

    The error does not include a highlight that every set missed.
    """

    value: Floats
    error: Floats


def albedo(
    brdf: Brdf,
    theta: npt.ArrayLike,
    phi: npt.ArrayLike = 0.0,
    *,
    count: int = 1024,
    seed: int = 0,
    proposal: Proposal | None = None,
) -> Estimate:
    """Directional albedo: the integral of f_r(wi, wo) cos theta_i over all wi, for given wo.

    For a reciprocal material it is the part of the light from wo that is reflected at all.

    Parameters
    ----------
    brdf
        Any reflectance.
    theta, phi
        Polar angle and azimuth of wo in radians, shapes (...) that broadcast.
    count
        Points per set, a power of two.
    seed
        Chooses the points.
    proposal
        Where points are drawn; made from `brdf` where None.

    Returns
    -------
    Estimate
        Without a unit, linear RGB, shape (..., 3); from 0 up, above 1 if energy is gained.

    Examples
    --------
    >>> class Gray(Brdf):
    ...     def eval_components(self, wi, wo):
    ...         return (0.5 / math.pi + 0.0 * wi[2],) * 3
    >>> albedo(Gray(), [0.0, 1.0]).value.round(9).tolist()
    [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    """
    proposal = proposal or Proposal(brdf)
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    u = sobol_sets(3, count, seed)
    means = np.empty((*theta.shape, REPLICATES, 3))

    def at(view: tuple[int, ...]) -> Floats:
        wo = np.broadcast_to(join(from_spherical(theta[view], phi[view])), u.shape)
        wi = proposal.draw(wo, u)
        wo = np.concatenate([wo, wo], axis=-2)
        weight = _inverse(proposal.density(wi, wo)) * np.maximum(wi[..., 2], 0.0)
        with np.errstate(all="ignore"):
            reflected: Floats = (brdf.eval(wi, wo) * weight[..., None]).mean(axis=-2)
        return reflected

    views = list(np.ndindex(theta.shape))
    for view, mean in zip(views, thread_map(at, views), strict=True):
        means[view] = mean
    return _estimate(means.mean(axis=-2), means)


def reciprocity_error(
    brdf: Brdf, *, count: int = 1024, proposal: Proposal | None = None
) -> Estimate:
    """How much f_r changes when light and viewer change places.

    The integral of |f_r(wi, wo) - f_r(wo, wi)| cos theta_i cos theta_o over both hemispheres and
    the channels, divided by that of the mean of both: from 0, reciprocal, to 2. Only pairs known
    both ways count; NaN where there are none or nothing is reflected. Parameters are those of
    :func:`albedo`.
    """
    proposal = proposal or Proposal(brdf)
    wi, wo = draw_pairs(proposal, count)
    # Both integrands are symmetric: a pair may count as drawn in either order.
    density = 0.5 * (pair_density(proposal, wi, wo) + pair_density(proposal, wo, wi))
    weight = _pair_weight(wi, wo, density, brdf.valid(wi, wo) & brdf.valid(wo, wi))
    f, g = brdf.eval(wi, wo), brdf.eval(wo, wi)
    with np.errstate(all="ignore"):
        return _ratio(np.abs(f - g).sum(axis=-1), 0.5 * (f + g).sum(axis=-1), weight)


def anisotropy(brdf: Brdf, *, count: int = 256, proposal: Proposal | None = None) -> Estimate:
    """How much f_r changes when the surface turns about its normal.

    The integral of the mean absolute difference of f_r from its mean over 16 rotations of both
    directions, with both cosines, over both hemispheres and the channels, divided by that of the
    mean: from 0, isotropic, to below 2. The mean is the closest isotropic material in the least
    squares sense. Only pairs known at every rotation count; NaN where there are none or nothing is
    reflected. Parameters are those of :func:`albedo`.
    """
    proposal = proposal or Proposal(brdf)
    wi, wo = draw_pairs(proposal, count)
    turns = [(_turn(wi, k), _turn(wo, k)) for k in range(_ROTATIONS)]
    # Both integrands are the same for all turns of a pair: it may count as drawn at any of them.
    density = np.mean([pair_density(proposal, *pair) for pair in turns], axis=0)
    weight = _pair_weight(wi, wo, density, np.all([brdf.valid(*pair) for pair in turns], axis=0))
    f = np.stack([brdf.eval(*pair) for pair in turns])
    with np.errstate(all="ignore"):
        mean = f.mean(axis=0)
        spread = np.abs(f - mean).mean(axis=0)
        return _ratio(spread.sum(axis=-1), mean.sum(axis=-1), weight)


def known_fraction(brdf: Brdf) -> float:
    """Fraction of pairs of directions, by solid angle, at which f_r is known, in [0, 1]."""
    u = sobol_sets(4, 2048)
    wi, wo = (join(uniform_hemisphere(u[..., k], u[..., k + 1])) for k in (0, 2))
    return float(brdf.valid(wi, wo).mean())


def _turn(w: Floats, step: int) -> Floats:
    """Directions rotated about the normal by a number of steps of a full turn."""
    if not step:
        return w
    angle = 2.0 * math.pi * step / _ROTATIONS
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.asarray(w @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]))


def _inverse(density: Floats) -> Floats:
    """1 / density; 0 where nothing can be drawn."""
    return np.asarray(np.where(density > 0.0, 1.0 / np.maximum(density, 1e-300), 0.0))


def _pair_weight(wi: Floats, wo: Floats, density: Floats, known: Mask) -> Floats:
    """Both cosines over the density of a pair; 0 where it is not known."""
    return _inverse(density) * np.maximum(wi[..., 2] * wo[..., 2], 0.0) * known


def _ratio(part: Floats, whole: Floats, weight: Floats) -> Estimate:
    """A ratio of weighted sums, from one of each per set."""
    part, whole = ((values * weight).sum(axis=-1) for values in (part, whole))
    with np.errstate(all="ignore"):
        return _estimate(part.sum() / whole.sum(), (part / whole)[:, None])


def _estimate(value: Floats, sets: Floats) -> Estimate:
    """A value and its standard error from what each set gives, on the last axis but one."""
    with np.errstate(all="ignore"):
        error = sets.std(axis=-2, ddof=1) / math.sqrt(REPLICATES)
    return Estimate(np.asarray(value), error.reshape(np.shape(value)))
