"""What a sampler draws against what it says: weights, densities, areas."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.geometry import dot, from_spherical, half_vector, join, reflect, split
from nacre.soundness.cells import count_cells
from nacre.soundness.directions import VIEWS, Plan, stratified, views
from nacre.soundness.result import NotApplicableError, Outcome
from nacre.soundness.subject import Drawn, Subject

_WEIGHTS = 8192  # samples of each view whose weights are compared
_WEIGHT = 0.02  # largest relative difference of 99 % of the weights
_LOG_P = 4.0  # -log10 of the chance below which samples are not of the density
_AREA = 0.01  # largest relative difference of an area
_SIGMAS = 5.0
_SHARES = 0.1, 0.5, 0.9  # of the samples, in the cones whose area is taken
_RARE = 0.05  # share of the samples in a cone with the lowest densities
_CONE = 40_000  # points for the area of a cone


def weights(subject: Subject, plan: Plan) -> Outcome:
    """A sample's weight is f_r cos(theta_i) / pdf, and its density is what `pdf` gives for it.

    The size is the relative difference that 99 % of the samples stay below.
    """
    lights, shown, differences = [], [], []
    compared: set[str] = set()
    for index, wo in enumerate(views()):
        drawn, view = _drawn(subject, plan, wo, index, _WEIGHTS)
        worst = np.zeros(len(drawn.wi))
        try:
            again = subject.pdf(drawn.wi, view)
            worst = np.abs(again / drawn.pdf - 1.0)
            compared.add("densities")
        except NotApplicableError:
            pass
        if drawn.weight is not None:
            f = subject.eval(drawn.wi, view)
            expected = f * drawn.wi[:, 2:] / drawn.pdf[:, None]
            mean = 0.01 * float(np.abs(expected).mean()) + 1e-12
            off = np.abs(drawn.weight - expected) / (np.abs(expected) + mean)
            worst = np.maximum(worst, off.max(axis=1))
            compared.add("weights")
        lights.append(drawn.wi)
        shown.append(view)
        differences.append(np.nan_to_num(worst, nan=math.inf))
    if not compared:
        raise NotApplicableError("its samples have neither weights nor a density to compare")
    worst = np.concatenate(differences)
    size = float(np.quantile(worst, 0.99, method="higher")) if len(worst) else 0.0
    what = " and ".join(sorted(compared))
    found = f"99 % of the {what} of samples are within {size:.2g} of what eval and pdf give."
    return Outcome(size, _WEIGHT, found, np.concatenate(lights), np.concatenate(shown), worst)


def chi_square(subject: Subject, plan: Plan) -> Outcome:
    """Samples have the density that is said, by a chi-square test in cells of the half vector.

    Cells with few samples are pooled, and the smallest of five views' p-values is corrected for
    there being five (Sidak). The size is -log10 of it.
    """
    chances, cells = [], []
    for index, wo in enumerate(views()):
        drawn, _ = _drawn(subject, plan, wo, 10 + index, plan.samples)
        counted = count_cells(subject.pdf, wo, drawn.wi, plan.samples)
        chances.append(counted.p_value())
        cells.append(counted)
    worst = int(np.argmin(chances))
    corrected = -math.expm1(len(chances) * math.log1p(-min(chances[worst], 1.0 - 1e-12)))
    size = -math.log10(max(corrected, 1e-300)) + 0.0
    found = f"Samples have the density that is said: p = {corrected:.2g}."
    if size > _LOG_P:
        found = f"Samples do not have the density that is said: p = {corrected:.2g}."
    wi = cells[worst].wi
    wo = np.broadcast_to(views()[worst], wi.shape)
    return Outcome(size, _LOG_P, found, wi, wo, np.abs(cells[worst].scores()[:-1]))


def area(subject: Subject, plan: Plan) -> Outcome:
    """The mean of 1 / pdf over samples in a cone about the mirror direction is the cone's area.

    A chi-square test sees one cell where a lobe is narrower than that. Here cones hold a tenth, a
    half and nine tenths of the samples, however narrow that makes them. The rarest twentieth of
    each is left out, where 1 / pdf is large. The size is the largest relative difference less five
    standard errors.
    """
    sizes, lights, shown, texts = [], [], [], []
    for index, wo in enumerate(views()):
        drawn, view = _drawn(subject, plan, wo, 20 + index, plan.samples)
        angle, middle = _half_angle(drawn.wi, view), len(drawn.wi) // 2
        if middle < 100:
            continue
        for share in _SHARES:
            cone = float(np.quantile(angle[:middle], share))
            if cone < 1e-6:  # single precision has no such angles
                continue
            rare = float(np.quantile(drawn.pdf[:middle][angle[:middle] <= cone], _RARE))
            counted = (angle[middle:] <= cone) & (drawn.pdf[middle:] >= rare)
            inverse = np.where(counted, 1.0 / drawn.pdf[middle:], 0.0)
            count = (plan.samples * (len(angle) - middle)) / len(angle)
            mean = float(inverse.sum()) / count
            error = math.sqrt(float(np.square(inverse).sum()) / count / count)
            truth, its_error = _cone_area(subject, plan, wo, cone, rare)
            off = abs(mean / truth - 1.0) - _SIGMAS * math.hypot(error, its_error) / truth
            sizes.append(max(off, 0.0))
            lights.append(drawn.wi[int(np.abs(angle - cone).argmin())])
            shown.append(wo)
            texts.append(f"{mean / truth:.4g} in a cone of {math.degrees(cone):.2g}")
    if not sizes:
        raise NotApplicableError("it draws next to nothing")
    worst = int(np.argmax(sizes))
    theta = VIEWS[int(np.argmin([np.linalg.norm(v - shown[worst]) for v in views()]))]
    found = f"The mean of 1 / pdf is the area times {texts[worst]} degrees, viewed at {theta:g}."
    return Outcome(sizes[worst], _AREA, found, np.stack(lights), np.stack(shown), np.array(sizes))


def _drawn(
    subject: Subject, plan: Plan, wo: Floats, which: int, count: int
) -> tuple[Drawn, Floats]:
    """Samples of a view that were drawn above the horizon, and the view for each."""
    u = plan.random(11, which).random((count, 3))
    drawn = subject.sample(np.broadcast_to(wo, u.shape), u)
    good = (drawn.pdf > 0.0) & np.isfinite(drawn.pdf) & np.isfinite(drawn.wi).all(axis=1)
    good &= drawn.wi[:, 2] > 0.0
    weight = None if drawn.weight is None else drawn.weight[good]
    kept = Drawn(drawn.wi[good], drawn.pdf[good], weight)
    return kept, np.broadcast_to(wo, kept.wi.shape)


def _half_angle(wi: Floats, wo: Floats) -> Floats:
    """Angles of half vectors from the normal, shape (n,)."""
    half = half_vector(split(wi), split(wo))
    return np.asarray(np.arctan2(np.hypot(half[0], half[1]), half[2]))


def _cone_area(
    subject: Subject, plan: Plan, wo: Floats, cone: float, rare: float
) -> tuple[float, float]:
    """Solid angle in sr that half vectors within an angle give, and its standard error.

    Only where the density is at least `rare` counts.
    """
    u = stratified(plan.random(12), _CONE)
    near = 2.0 * math.sin(0.5 * cone) ** 2
    # The first number orders three copies of a lattice, whose jitter differs.
    theta = 2.0 * np.arcsin(np.sqrt(0.5 * near * u[:, 1]))
    half = from_spherical(theta, 2.0 * math.pi * u[:, 2])
    view = split(wo)
    wi = join(reflect(view, half))
    area = 2.0 * math.pi * near * 4.0 * dot(view, half)
    seen = wi[:, 2] > 0.0
    drawn = np.zeros(len(wi), bool)
    drawn[seen] = subject.pdf(wi[seen], np.broadcast_to(wo, wi[seen].shape)) >= rare
    values = np.where(drawn, area, 0.0)
    return float(values.mean()), float(values.std()) / math.sqrt(len(values))
