"""How much light a reflectance gives back: deterministic integrals, and a bound over all views."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from nacre.array import Array, Floats
from nacre.brdf import Brdf
from nacre.geometry import dot, from_spherical, join, reflect
from nacre.runtime.parallel import thread_map

_FINEST = 1e-4  # sin^2 of the angle from the normal below which half vectors are spread evenly
_POINTS = 1 << 15  # that are evaluated at a time
_HORIZON = 0.01  # added to cosines before their logarithm
_RANGE = _HORIZON / (1.0 + _HORIZON)

VIEWS = 4096
"""Views at which :func:`certify` integrates the albedo."""
_SIDE = 64  # of them as a square, of which each row has one integral of twice the order
_ORDERS = 8, 16, 32  # of its integrals; the first is too coarse for unlike azimuths


def half_vector_rule(theta: Floats, phi: Floats, order: int) -> tuple[Floats, Floats]:
    """Directions to the light (v, 6 order^2, 3) and weights with the cosine in sr, (v, 6 order^2),
    that integrate f_r cos theta_i for each view.

    Gauss-Legendre points in the logarithm of 1 - cos theta_h and in phi_h, of exactly those half
    vectors h whose light is above the horizon. The logarithm opens up highlights of any width down
    to half a degree. The first of three parts with as many points each is the cone in which all
    azimuths of h count; the other two meet at 45 degrees, where h is if the light is at the normal
    and the view at the horizon.

    `theta` are polar angles below pi / 2 and `phi` azimuths of the views in radians, shape (v,);
    `order` is the number of points along each side of a part.
    """
    x, w = _legendre(order)
    start = np.log(np.full_like(theta, 0.5 * _FINEST))
    ends = [
        np.log(1.0 - np.cos(0.25 * math.pi + 0.5 * sign * theta) + 0.5 * _FINEST)
        for sign in (-1.0, 0.0, 1.0)
    ]
    parts = [(a[:, None], (b - a)[:, None]) for a, b in itertools.pairwise([start, *ends])]
    stretched = np.concatenate([a + length * x for a, length in parts], axis=1)
    radial = np.concatenate([length * w for _, length in parts], axis=1) * np.exp(stretched)
    cosine = 1.0 - (np.exp(stretched) - 0.5 * _FINEST)
    sine = np.sqrt(1.0 - cosine * cosine)
    view = np.cos(theta)[:, None], np.maximum(np.sin(theta), 1e-12)[:, None]
    # At larger azimuths from the plane of the view, the light is below the horizon.
    limit = view[0] * (0.5 / cosine - cosine) / (view[1] * sine)
    widest = np.arccos(np.clip(limit, -1.0, 1.0))
    y, v = _legendre(2 * order)
    around = (widest[..., None] * (2.0 * y - 1.0)).reshape(len(theta), -1)
    angular = 2.0 * widest[..., None] * v
    h = tuple(
        part.reshape(len(theta), -1)
        for part in np.broadcast_arrays(
            *from_spherical(np.arctan2(sine, cosine)[..., None], np.zeros((1, 1, 2 * order)))
        )
    )
    azimuth = around + phi[:, None]
    h = h[0] * np.cos(azimuth), h[0] * np.sin(azimuth), h[2]
    wo = tuple(c[:, None] for c in from_spherical(theta, phi))
    wi = reflect(wo, h)
    weights = (radial[..., None] * angular).reshape(len(theta), -1)
    return join(wi), weights * 4.0 * dot(wo, h) * np.maximum(wi[2], 0.0)


def albedos(brdf: Brdf, angles: Floats, order: int) -> Floats:
    """Directional albedos of a reflectance by :func:`half_vector_rule`: linear RGB, no unit, (v,
    3).

    Where f_r is not known it counts as what `eval` says. `angles` are polar angles and azimuths of
    the views in radians, shape (2, v). With order 16, errors are up to 0.002 at grazing views and
    0.0003 elsewhere.
    """
    step = max(1, _POINTS // (6 * order * order))

    def part(start: int) -> Floats:
        theta, phi = angles[:, start : start + step]
        wi, weights = half_vector_rule(theta, phi, order)
        wo = join(from_spherical(theta, phi))[:, None]
        f_r = brdf.eval(wi.astype(np.float32), wo.astype(np.float32))
        return np.asarray(np.einsum("vn,vnc->vc", weights, f_r.astype(float)))

    return np.concatenate(list(thread_map(part, range(0, angles.shape[1], step))))


@dataclass(frozen=True)
class Certificate:
    """How much light a reflectance gives back at most."""

    largest: float  # the largest albedo of a channel at the views that are looked at
    bound: float
    """What no view exceeds: the largest sum of the albedo at one of the views, its differences to
    neighboring views, and twice the error of the integral, taken from one of twice the order near
    it."""


def certify(brdf: Brdf) -> Certificate:
    """The largest albedo of any view and channel of a reflectance known at all directions.

    Views are :data:`VIEWS` polar angles for an isotropic material, for others 64 with 64 azimuths
    each. Between them, albedo is taken to change by no more than from one view to the next. Where
    the bound comes out above 1, integrals of higher orders make a closer one.
    """
    theta, phi = views(*((VIEWS, 1) if brdf.isotropic else (_SIDE, _SIDE)))
    angles = np.stack([theta.ravel(), phi.ravel()])
    found, error = np.zeros((2, _SIDE, _SIDE, 3))
    rows = np.arange(_SIDE)
    bound: Floats = np.zeros(0)
    change: Floats = np.zeros(0)
    for order in _ORDERS[0 if brdf.isotropic else 1 :]:
        index = rows[:, None] * _SIDE + np.arange(_SIDE)
        found[rows] = albedos(brdf, angles[:, index.ravel()], order).reshape(-1, _SIDE, 3)
        column = rows * 37 % _SIDE
        finer = albedos(brdf, angles[:, rows * _SIDE + column], 2 * order)
        error[rows] = 2.0 * np.abs(found[rows, column] - finer)[:, None]
        if not change.size:  # at views that are integrated alike
            change = _change(found.reshape(*theta.shape, 3)).reshape(found.shape)
        bound = found + error + change
        # Others cannot have the largest albedo, or need no closer look.
        rows = np.flatnonzero((bound > max(1.0, (found - error).max())).any(axis=(1, 2)))
        if not rows.size:
            break
    return Certificate(float(found.max()), float(bound.max()))


def _change(grid: Floats) -> Floats:
    """Largest differences to neighbors in polar angle, plus those in azimuth, on a grid of each."""
    step = np.abs(np.diff(grid, axis=0, prepend=grid[:1], append=grid[-1:]))
    around = np.abs(grid - np.roll(grid, 1, axis=1))
    change: Floats = np.maximum(step[1:], step[:-1])
    return change + np.maximum(around, np.roll(around, -1, axis=1))


def views(polar: int, azimuths: int) -> tuple[Floats, Floats]:
    """Polar angles and azimuths in radians, shape (polar, azimuths).

    Polar angles are even in :func:`elevation`, from the normal to a hundredth of a degree above the
    horizon.
    """
    cosine = (1.0 + _HORIZON) * _RANGE ** np.linspace(0.0, 1.0, polar) - _HORIZON
    theta = np.arccos(np.maximum(cosine, 2e-4))
    phi = np.arange(azimuths) * (2.0 * math.pi / azimuths)
    a, b = np.broadcast_arrays(theta[:, None], phi)
    return a, b


def elevation(cosine: Array) -> Array:
    """From 0 at the normal to 1 at the horizon: the logarithm of cos theta + .01, scaled."""
    return np.log((np.maximum(cosine, 0.0) + _HORIZON) / (1.0 + _HORIZON)) / math.log(_RANGE)


@cache
def _legendre(order: int) -> tuple[Floats, Floats]:
    """Points in (0, 1) and weights of the Gauss-Legendre rule."""
    x, w = np.polynomial.legendre.leggauss(order)
    return 0.5 * x + 0.5, 0.5 * w
