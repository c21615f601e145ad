"""Values of f_r by themselves: finite and not negative."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.soundness.directions import Plan, extreme_pairs, pairs
from nacre.soundness.result import NotApplicableError, Outcome
from nacre.soundness.subject import Subject

_PAIRS = 20_000
_ROUNDING = 1e-6  # of the largest value, below 0, that rounding may leave


def looked_at(subject: Subject, plan: Plan) -> tuple[Floats, Floats, Floats]:
    """Extreme pairs and random ones, and f_r at them."""
    wi, wo, _ = pairs(subject, plan, _PAIRS, 1)
    first, second = extreme_pairs()
    wi, wo = np.concatenate([first, wi]), np.concatenate([second, wo])
    return wi, wo, subject.eval(wi, wo)


def finite(subject: Subject, plan: Plan) -> Outcome:
    """f_r, densities and drawn directions are numbers, at the normal and next to the horizon too.

    The size is the share of pairs where one is not.
    """
    wi, wo, values = looked_at(subject, plan)
    bad = ~np.isfinite(values).all(axis=1)
    what = ["f_r"] if bad.any() else []
    try:
        unknown = ~np.isfinite(subject.pdf(wi, wo))
        what += ["the density"] if unknown.any() else []
        bad |= unknown
    except NotApplicableError:
        pass
    try:
        drawn = subject.sample(wo, plan.random(2).random(wo.shape))
        lost = ~np.isfinite(drawn.pdf)
        lost |= ~np.isfinite(drawn.wi).all(axis=1) & (drawn.pdf > 0.0)
        what += ["what it draws"] if lost.any() else []
        bad |= lost
    except NotApplicableError:
        pass
    share = float(bad.mean())
    found = "All values are finite."
    if what:
        found = f"At {bad.sum():,} of {len(wi):,} pairs {' and '.join(what)} is not finite."
    return Outcome(share, 0.0, found, wi, wo, bad.astype(float))


def positive(subject: Subject, plan: Plan) -> Outcome:
    """f_r is not negative.

    The size is how far it goes below 0, as a share of its mean.
    """
    wi, wo, values = looked_at(subject, plan)
    values = np.where(np.isfinite(values), values, 0.0)
    below = np.maximum(-values.min(axis=1), 0.0)
    mean = float(np.abs(values).mean()) or 1.0
    size = float(below.max()) / mean
    found = "f_r is nowhere negative."
    if size > _ROUNDING:
        share = (below > _ROUNDING * mean).mean()
        found = f"f_r is negative at {share:.2%} of the pairs, down to {-below.max():.3g} 1/sr."
    return Outcome(size, _ROUNDING, found, wi, wo, below / mean)
