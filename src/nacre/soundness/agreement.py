"""What is said of f_r in more than one way: derivatives, and variants."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.soundness.directions import Plan, pairs
from nacre.soundness.result import NotApplicableError, Outcome
from nacre.soundness.subject import Subject

_PAIRS = 600
_SMOOTH = 0.9  # share of pairs whose derivatives have to agree: tables have edges
_SLOPE = 0.02  # largest relative difference of a derivative
_FLAT = 0.05  # derivatives below this share of f_r, per radian or unit of a parameter, are small
_SHARE = 0.99  # of pairs whose values have to agree in all variants


def gradients(subject: Subject, plan: Plan) -> Outcome:
    """Derivatives are what differences give, between those to either side.

    The size is the relative difference that 90 % of the pairs stay below: f_r may have edges.
    """
    slopes = subject.slopes()
    wi, wo, _ = pairs(subject, plan, _PAIRS, 13)
    worst, size, name = np.zeros(len(wi)), 0.0, ""
    for slope in slopes:
        middle = slope.value(wi, wo, 0.0)
        steps = np.array([1.0, -1.0, 0.5, -0.5]) * slope.step
        sides = np.stack([(slope.value(wi, wo, step) - middle) / step for step in steps.tolist()])
        found = slope.derivative(wi, wo)
        # Where the two sides differ, as they do at edges and bounds, all between them is right; and
        # where shorter steps change them, f_r is too curved to tell.
        low, high = sides.min(axis=0), sides.max(axis=0)
        bend = np.abs(sides[:2] - sides[2:]).max(axis=0)
        # Slopes that are small against f_r do not count, nor does rounding.
        scale = 0.25 * np.abs(low + high) + 0.5 * np.abs(found) + _FLAT * np.abs(middle)
        scale += 0.01 * float(np.abs(low + high).mean()) + 1e-9
        off = np.maximum(np.maximum(low - found, found - high) - bend, 0.0) / scale
        off = np.nan_to_num(off, nan=np.inf)
        worst = np.maximum(worst, off)
        here = float(np.quantile(off, _SMOOTH, method="higher"))
        if here >= size:
            size, name = here, slope.name
    off = f"by {size:.2g} of their size" if size > _SLOPE else f"by no more than {size:.2g}"
    words = f"Derivatives with respect to {name} differ {off} from differences."
    return Outcome(size, _SLOPE, words, wi, wo, worst)


def variants(subject: Subject, plan: Plan) -> Outcome:
    """f_r is the same in every way to evaluate it: other precisions, libraries and renderers.

    The size is the largest difference over variants that 99 % of the pairs stay below, as a
    multiple of what that variant's arithmetic is allowed.
    """
    wi, wo, _ = pairs(subject, plan, _PAIRS, 14)
    order = plan.random(15).permutation(len(wi))[:_PAIRS]
    wi, wo = wi[order], wo[order]
    expected = subject.eval(wi, wo)
    worst, size, name = np.zeros(len(wi)), 0.0, ""
    others = subject.variants()
    if not others:
        raise NotApplicableError("there is one way to evaluate it")
    for variant, evaluate in others.items():
        off = _difference(evaluate(wi, wo), expected) / subject.tolerance(variant)
        worst = np.maximum(worst, off)
        here = float(np.quantile(off, _SHARE, method="higher"))
        if here >= size:
            size, name = here, variant
    found = f"f_r is the same in {', '.join(others)}."
    if size > 1.0:
        found = f"f_r differs by {size * subject.tolerance(name):.2g} in {name}."
    return Outcome(size, 1.0, found, wi, wo, worst)


def _difference(values: Floats, expected: Floats) -> Floats:
    """Largest difference of a channel as a share of f_r, shape (n,)."""
    mean = float(np.abs(expected).mean())
    off = np.abs(values - expected).max(axis=1) / (np.abs(expected).max(axis=1) + 0.05 * mean)
    return np.asarray(np.nan_to_num(off, nan=np.inf))
