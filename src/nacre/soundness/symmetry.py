"""Pairs that must have the same f_r: light and viewer swapped, and the surface turned."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.geometry import join, rotate, split
from nacre.soundness.directions import Plan, pairs
from nacre.soundness.result import NotApplicableError, Outcome
from nacre.soundness.subject import Subject

_PAIRS = 20_000
_LIMIT = 2e-3  # of the mean change, as a share of the light
_FLOOR = 1e-2  # of the mean of f_r: changes of less than a share of it do not count
_OBLIQUE = 0.2  # least difference of the logarithms of cosines that tells a power
_CLOSE = 0.1  # how near to 1 a power, and to the others the power of a pair, has to be
_EXPLAINED = 0.8  # share of pairs that has to agree on a power


def reciprocity(subject: Subject, plan: Plan) -> Outcome:
    """f_r is the same when light and viewer change places.

    The size is the integral of the change over both hemispheres with both cosines, as a share of
    that of f_r: from 0 to 2.
    """
    wi, wo, weight = pairs(subject, plan, _PAIRS, 3)
    f, g = subject.eval(wi, wo), subject.eval(wo, wi)
    size, change = _change(f, g, weight)
    found = f"f_r changes by {size:.3g} when light and viewer change places."
    if size <= _LIMIT:
        found = "f_r is the same when light and viewer change places."
    elif power := cosine_power(f, g, wi, wo):
        found += f" The factor {_factor(power)} explains it."
    return Outcome(size, _LIMIT, found, wi, wo, change)


def no_cosine(subject: Subject, plan: Plan) -> Outcome:
    """f_r does not hold the cosine of one of its directions.

    A reciprocal f_r times cos(theta_i) has f_r(wi, wo) / f_r(wo, wi) = cos(theta_i) / cos(theta_o):
    the size is the share of pairs with that power of the ratio of cosines, or its inverse. A
    product of both cosines is reciprocal, and is not found.
    """
    wi, wo, _ = pairs(subject, plan, _PAIRS, 3)
    f, g = subject.eval(wi, wo), subject.eval(wo, wi)
    found = "f_r holds no cosine of a single direction."
    agreed, power = _agreement(f, g, wi, wo)
    if agreed > _EXPLAINED:
        found = f"f_r holds the factor {_factor(power)}: eval has to leave the cosine out."
    ratio = np.exp(-np.abs(np.log(wi[:, 2] / wo[:, 2])))
    return Outcome(agreed, _EXPLAINED, found, wi, wo, agreed * (1.0 - ratio))


def isotropy(subject: Subject, plan: Plan) -> Outcome:
    """f_r is the same when the surface turns about its normal, if the material claims it.

    The size is as for `reciprocity`.
    """
    if not subject.isotropic:
        raise NotApplicableError("it does not claim to be isotropic")
    wi, wo, weight = pairs(subject, plan, _PAIRS, 4)
    angle = plan.random(5).random(len(wi)) * 2.0 * math.pi
    turned = [join(rotate(split(w), angle)) for w in (wi, wo)]
    size, change = _change(subject.eval(wi, wo), subject.eval(*turned), weight)
    found = f"f_r changes by {size:.3g} when the surface turns, but it is said to be isotropic."
    if size <= _LIMIT:
        found = "f_r is the same however the surface is turned."
    return Outcome(size, _LIMIT, found, wi, wo, change)


def _change(f: Floats, g: Floats, weight: Floats) -> tuple[float, Floats]:
    """The mean change as a share of f_r, and that at each pair as a share of the larger value."""
    with np.errstate(all="ignore"):
        f, g = (np.nan_to_num(x, posinf=0.0, neginf=0.0).sum(axis=1) for x in (f, g))
        whole = float((0.5 * np.abs(f + g) * weight).sum())
        size = float((np.abs(f - g) * weight).sum()) / whole if whole > 0.0 else 0.0
        floor = _FLOOR * float(np.abs(f).mean())
        change = np.abs(f - g) / (np.maximum(np.abs(f), np.abs(g)) + floor + 1e-300)
    return size, change


def cosine_power(f: Floats, g: Floats, wi: Floats, wo: Floats) -> float:
    """1 if cos(theta_i) / cos(theta_o) explains the ratio of swapped values, -1 for its inverse.

    0 if neither does.
    """
    agreed, power = _agreement(f, g, wi, wo)
    return power if agreed > _EXPLAINED else 0.0


def _agreement(f: Floats, g: Floats, wi: Floats, wo: Floats) -> tuple[float, float]:
    """The share of pairs whose values have a ratio that is the power 1 or -1 of the cosines'."""
    f, g = f.sum(axis=1), g.sum(axis=1)
    cosines = np.log(wi[:, 2] / wo[:, 2])
    told = (np.abs(cosines) > _OBLIQUE) & (f > 0.0) & (g > 0.0) & np.isfinite(f) & np.isfinite(g)
    if told.sum() < 100:
        return 0.0, 0.0
    powers = np.log(f[told] / g[told]) / cosines[told]
    power = math.copysign(1.0, float(np.median(powers)))
    return float((np.abs(powers - power) < _CLOSE).mean()), power


def _factor(power: float) -> str:
    first, second = ("theta_i", "theta_o") if power > 0.0 else ("theta_o", "theta_i")
    return f"cos({first}), or 1 / cos({second})"
