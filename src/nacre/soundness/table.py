"""The table of properties, and the check itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from nacre.errors import NacreError, did_you_mean
from nacre.runtime.progress import Progress, silent
from nacre.soundness import agreement, drawing, energy, symmetry, values
from nacre.soundness.design import excuses
from nacre.soundness.directions import Plan
from nacre.soundness.result import NotApplicableError, Outcome, Report, Result, State
from nacre.soundness.subject import Subject

PROPERTIES: dict[str, Callable[[Subject, Plan], Outcome]] = {
    "finite": values.finite,
    "positive": values.positive,
    "energy": energy.energy,
    "reciprocity": symmetry.reciprocity,
    "no-cosine": symmetry.no_cosine,
    "isotropy": symmetry.isotropy,
    "weights": drawing.weights,
    "coverage": energy.coverage,
    "normalization": energy.normalization,
    "chi-square": drawing.chi_square,
    "area": drawing.area,
    "gradients": agreement.gradients,
    "variants": agreement.variants,
}
"""By name; each measures by how much a material violates it."""


def check_names(names: Iterable[str]) -> list[str]:
    """The names, all of properties. Raises NacreError for another."""
    found = list(names)
    for name in found:
        if name not in PROPERTIES:
            known = f"the properties are {', '.join(PROPERTIES)}"
            raise NacreError(f"{name}: is not a property{did_you_mean(name, PROPERTIES, known)}")
    return found


def check(
    subject: Subject,
    plan: Plan | None = None,
    only: Iterable[str] = (),
    progress: Progress | None = None,
) -> Report:
    """Check the properties of a material.

    Parameters
    ----------
    subject
        What to check.
    plan
        How hard to look; the same plan gives the same report.
    only
        Names of properties to check; all where empty.
    progress
        Called before each property.

    Raises
    ------
    NacreError
        If a name is not one of a property, or the material cannot be evaluated.
    """
    plan, tell = plan or Plan(), progress or silent
    names = check_names(only) or list(PROPERTIES)
    results = []
    for index, name in enumerate(names):
        tell("checking", index, len(names), name)
        results.append(_result(name, subject, plan))
    tell("checking", len(names), len(names), "")
    return Report(subject.name, tuple(results))


def _result(name: str, subject: Subject, plan: Plan) -> Result:
    try:
        found = PROPERTIES[name](subject, plan)
    except NotApplicableError as reason:
        return Result(name, "not applicable", f"Not applicable: {reason}.")
    sentence = found.sentence
    fails = not found.size <= found.limit
    excuse = subject.by_design.get(name)
    meant = fails and excuse is not None and excuses(excuse, found.size)
    if meant:
        sentence = f"{sentence} By design: {excuse}."
    state: State = "passed" if not fails else "by design" if meant else "failed"
    where = found.worst() if fails else None
    return Result(name, state, sentence, found.size, found.limit, where, found)
