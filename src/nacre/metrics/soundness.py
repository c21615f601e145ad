"""Whether a reflectance is sound, in words: what its physical figures mean, and what to do.

No standard says how unphysical a measurement may be, so the limits are set by what real ones are:
the 127 networks published with the NBRDF paper and seven RGL tables (`docs/reference/measures.md`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nacre.numerics.albedo import USUAL_ALBEDO

USUAL_RECIPROCITY, LARGE_RECIPROCITY = 0.1, 0.5
"""Reciprocity errors that 114 and 132 of these 134 stay below; beyond are paints whose color
changes with the angle, and files with light and view mixed up."""

_RECIPROCAL = 1e-3
_GRAZING = 75.0  # degrees from the normal, from which measurements are known to be noisy
_UNITS = 3.0  # albedo beyond which the unit of the values is the likely reason
_SHARE = 0.05  # of unknown directions, or of values below 0, that is worth a word
_BELOW = ("values below 0", "points with a negative channel")
_CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True)
class Finding:
    """One thing to know about a reflectance."""

    words: str  # a sentence
    wrong: bool = False  # whether it is more than real measurements show
    notable: bool = False  # whether it looks wrong and is not


def findings(
    facts: Mapping[str, Any], file: str = "FILE", *, formula: bool = False
) -> list[Finding]:
    """What physical figures mean: first what is wrong, then what only looks so.

    Parameters
    ----------
    facts
        From :func:`nacre.metrics.physical_facts`, perhaps among others.
    file
        What to call the file in commands to type.
    formula
        Whether the reflectance is an analytic model, which has no noise.
    """
    found = [_energy(facts, file, formula), *_reciprocity(facts, formula), *_gaps(facts)]
    return sorted(found, key=lambda one: (not one.wrong, not one.notable))


def conclusion(found: Sequence[Finding]) -> str:
    """All findings, after whether anything is wrong."""
    wrong = any(one.wrong for one in found)
    first = "Something looks wrong." if wrong else "Nothing is wrong."
    return " ".join([first, *(one.words for one in found)])


def _energy(facts: Mapping[str, Any], file: str, formula: bool) -> Finding:
    albedos, angles = facts["largest albedo"], facts["largest albedo at"]
    if None in albedos:
        return Finding("It reflects without bound.", wrong=True)
    most = max(albedos)
    if not most:
        return Finding("It reflects nothing.", wrong=True)
    if not facts["energy"].startswith("exceeds 1"):
        certified = ", which is certified" if "certified" in facts["energy"] else ""
        return Finding(f"It reflects at most {percent(min(most, 1.0))} of the light{certified}.")
    channel = albedos.index(most)
    color = "" if most - min(albedos) < 5e-4 else f"{_CHANNELS[channel]}, "
    angle = angles[channel]
    times = f"up to {most:.3g} times the light it receives ({color}{angle:g} degrees)"
    if most > _UNITS and not formula:
        hint = "Check the unit of its values: f_r in 1/sr, without the cosine."
        return Finding(f"It reflects {times}. {hint}", wrong=True)
    if most > USUAL_ALBEDO:
        hint = f"nacre fit {file} --physical makes a network that does not."
        return Finding(f"It reflects {times}; {hint}", wrong=True)
    if formula:
        reason = "some formulas do"
    elif angle >= _GRAZING:
        reason = f"usual for measurements near the horizon, which reach {USUAL_ALBEDO:g}"
    else:
        reason = f"within the error of measurements, which reach {USUAL_ALBEDO:g}"
    return Finding(f"It reflects {times}: {reason}.", notable=True)


def _reciprocity(facts: Mapping[str, Any], formula: bool) -> Iterator[Finding]:
    error = facts["reciprocity error"]
    if facts["reciprocity"] == "by construction":
        yield Finding("It is reciprocal by construction.")
    elif error is not None and error < _RECIPROCAL:
        yield Finding("It is reciprocal.")
    elif error is not None:
        share = f"It changes by {percent(error)} when light and viewer change places"
        if formula:
            yield Finding(f"{share}: some formulas do.", notable=True)
        elif error <= USUAL_RECIPROCITY:
            yield Finding(f"{share}: usual for measurements.")
        elif error <= LARGE_RECIPROCITY:
            yield Finding(f"{share}: usual for measured paints and foils.", notable=True)
        else:
            unusual = "If its color does not change with the angle"
            hint = f"{unusual}, check that light and viewer are not mixed up."
            yield Finding(f"{share}. {hint}", wrong=True)


def _gaps(facts: Mapping[str, Any]) -> Iterator[Finding]:
    if (unknown := facts["unknown pairs"]) > _SHARE:
        known = percent(1.0 - unknown)
        yield Finding(
            f"It is known at {known} of pairs of directions, and black at others.", notable=True
        )
    below = max((facts.get(name) or 0.0 for name in _BELOW), default=0.0)
    if below > _SHARE:
        yield Finding(f"{percent(below)} of its values are below 0, and count as 0.", notable=True)


def percent(share: float) -> str:
    """A share for people: 0.037 is "3.7 %"."""
    number = 100.0 * share
    if number < 10.0:
        return f"{number:.2g} %"
    return f"{number:.3g} %" if 99.0 <= number < 100.0 else f"{number:.0f} %"
