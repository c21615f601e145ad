"""The variance that a sampler would have on a reflectance, from one set of directions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nacre.array import Array, Components, Floats
from nacre.brdf import Brdf
from nacre.geometry import cosine_hemisphere, half_vector, join, reflect, split, uniform_hemisphere
from nacre.sampling.mixture import in_frame, lobe_frame
from nacre.sampling.sequence import even_points
from nacre.sampling.visible_normals import sample_visible, visible_density

_VIEWS = 8
_PER_VIEW = 512
_ROUGHNESSES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)  # of the proposal, for highlights of every width
_DARK = 0.1  # albedo of a channel, relative to the brightest, below which its noise counts less


@dataclass(frozen=True)
class Moment:
    """Directions that estimate the second moment of f cos(theta_i) / p for any density p.

    Views `wo`, at all azimuths, and lights `wi` have shape (v, n, 3), float64; the cosine of the
    view is the same along n. The sum of the weights (v, n), each divided by the density p of its
    light in 1/sr, is the second moment relative to the squared albedo: averaged over the channels,
    and over views as an orthographic picture of a sphere has them. It is about 1 where nothing
    varies.
    """

    wo: Floats
    wi: Floats
    weights: Floats


@dataclass(frozen=True)
class Proposal:
    """Directions that do not depend on a material: the same for all that are compared.

    Views and lights are as in :class:`Moment`, the normal where a light was drawn below the
    horizon. The density with which lights were drawn is in 1/sr, shape (v, n), infinite below the
    horizon; `fractions` (v,) weigh the views in the mean.
    """

    wo: Floats
    wi: Floats
    density: Floats
    fractions: Floats

    def single(self) -> Proposal:
        """The same in float32, which takes half the time."""
        arrays = self.wo, self.wi, self.density, self.fractions
        return Proposal(*(array.astype(np.float32) for array in arrays))

    def weights(self, f_r: Floats) -> Floats:
        """The weights of :class:`Moment`, (..., v, n), for f_r in 1/sr, shape (..., v, n, 3)."""
        with np.errstate(all="ignore"):  # a wild reflectance may overflow
            value = f_r * self.wi[..., 2:]
            value = np.where(np.isfinite(value), value, 0.0)
            albedo = (value / self.density[..., None]).mean(axis=-2, keepdims=True)
            scale = albedo**2 + (_DARK * albedo.max(axis=-1, keepdims=True)) ** 2
            square = (value**2 / scale).mean(axis=-1)
            weights = self.fractions[:, None] / self.wi.shape[1] * square / self.density
        return np.where(np.isfinite(weights), weights, 0.0)


class Pairs(NamedTuple):
    """Directions of v views and n lights each, as densities of lobes need them; shapes (v, n)."""

    half: Components  # half vectors, in the frame of the lobes; see lobe_frame
    view: Components  # views, likewise
    cosine: Array  # cos(theta_i)


def view_pairs(wo: Floats, wi: Floats, angle: float | None = None) -> Pairs:
    """Pairs of directions of shape (v, n, 3), for lobes that turn with the view or stay."""
    light, eye = split(wi), split(wo)
    axis, view = lobe_frame(eye, angle)
    return Pairs(in_frame(half_vector(light, eye), *axis), view, light[2])


def second_moment(brdf: Brdf, seed: int = 0) -> Moment:
    """Evaluate a reflectance where samplers are compared; values that are not finite count as 0."""
    proposal = propose(seed)
    with np.errstate(all="ignore"):  # a wild reflectance may overflow
        f_r = brdf.eval(proposal.wi, proposal.wo)
    return Moment(proposal.wo, proposal.wi, proposal.weights(f_r))


def propose(seed: int = 0, per_view: int = _PER_VIEW) -> Proposal:
    """Views, and `per_view` lights for each from a broad mixture of lobes."""
    # Every view of a sphere counts alike: squared sines are uniform.
    nodes, view_weights = np.polynomial.legendre.leggauss(_VIEWS)
    wo, wi, density = propose_lights(0.5 * (1.0 + nodes), per_view, seed)
    return Proposal(wo, wi, density, 0.5 * view_weights)


def propose_lights(squared_sines: Floats, count: int, seed: int) -> tuple[Floats, Floats, Floats]:
    """Lights for views: diffuse and about the mirror directions of normals of all roughnesses.

    Views have polar angles of these squared sines (v,), and `count` lights each; the seed chooses
    the lights' directions and the views' azimuths, which differ from light to light. Returns views
    and lights (v, count, 3), float64, and the density of the lights in 1/sr, (v, count): infinite
    where one fell below the horizon, which the normal stands in for.
    """
    offset = np.random.default_rng(seed).random(4)
    u = even_points(len(squared_sines) * count, 4, offset).reshape(len(squared_sines), count, 4)
    sine2 = squared_sines[:, None]
    phi, sine = 2.0 * math.pi * u[..., 3], np.sqrt(sine2)
    wo = join((sine * np.cos(phi), sine * np.sin(phi), np.sqrt(1.0 - sine2)))
    view = split(wo)
    wi = np.empty_like(wo)
    parts = len(_ROUGHNESSES) + 2
    part = (u[..., 0] * parts).astype(int)
    for k in range(parts):
        here = part == k
        first, second = u[here, 1], u[here, 2]
        if k < 2:
            drawn = (cosine_hemisphere, uniform_hemisphere)[k](first, second)
        else:
            alpha = (_ROUGHNESSES[k - 2],) * 2
            seen = split(wo[here])
            drawn = reflect(seen, sample_visible(seen, first, second, alpha))
        wi[here] = join(drawn)
    h = half_vector(split(wi), view)
    lobes = sum(visible_density(h, view, (a, a)) for a in _ROUGHNESSES)
    density = (wi[..., 2] / math.pi + 0.5 / math.pi + lobes) / parts
    below = wi[..., 2] <= 0.0
    wi[below], density[below] = (0.0, 0.0, 1.0), np.inf
    return wo, wi, density
