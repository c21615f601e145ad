"""The measurements for every pair of a material and a method."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from nacre.brdf import Brdf
from nacre.metrics.facts import physical_facts
from nacre.metrics.noise import sampling_variance
from nacre.runtime.parallel import one_blas_thread
from nacre_lab.reproduce.trial import ANGLES, LIGHTS, TRUTH, Method, Reference, Settings, attempt

VERSION = 1
"""Version of the protocol; results of different versions are not compared."""

PROTOCOLS: Mapping[str, Settings] = {
    "full": Settings(),
    "quick": Settings(64, directions=128, epochs=20, samples=160_000),
}
"""Pictures, directions, lengths of fits and seeds, by name; "quick" is for a first look.

Pictures are those of :mod:`nacre.mitsuba.sphere`, in the included studio and in directional light:
every pixel sees fixed directions, so nothing in them is random.
"""

GIVEN = "given"
"""Setting of a method that fits nothing here: the reason, reported instead of times."""

_FIT = "fit_s", "fit_cpu_s"
_PAIRS, _ROUNDS = 1 << 16, 5  # for one thread: from 100,000 pairs on, `eval` uses all cores


@dataclass(frozen=True)
class Measure:
    """One figure in a row.

    Parameters
    ----------
    title
        Head of its column.
    about
        Its description.
    digits
        Decimals in tables.
    fitted
        Whether it is an error of a representation or the cost of making it.
    """

    title: str
    about: str
    digits: int
    fitted: bool = False


def _errors(light: str) -> dict[str, Measure]:
    where = f"of the sphere, {light} light" if light == "directional" else f"of the sphere, {light}"
    return {
        f"{light}_psnr_db": Measure(f"{light} PSNR", f"{where}, in dB", 1, True),
        f"{light}_ssim": Measure(f"{light} SSIM", f"{where}", 4, True),
        f"{light}_flip": Measure(f"{light} FLIP", f"{where}, mean", 4, True),
        f"{light}_mae": Measure(f"{light} MAE", f"{where}, mean absolute error", 4, True),
    }


MEASURES: Mapping[str, Measure] = {
    "size_bytes": Measure("bytes", "of the numbers that f_r comes from; a basis is not counted", 0),
    **{name: measure for light in LIGHTS for name, measure in _errors(light).items()},
    "relative_error": Measure("relative error", "median of |g - f| / f over directions", 4, True),
    "log_cosine_error": Measure("log-cosine error", "the loss of the NBRDF paper", 4, True),
    "fit_s": Measure("fit s", "seconds of the fit, a basis not counted", 2, True),
    "fit_cpu_s": Measure("fit CPU s", "processor seconds of the same", 2, True),
    "eval_ns": Measure("eval ns", "processor time of one pair of directions on one core", 1),
    "noise": Measure("noise", "variance of one sample of its sampler over the squared albedo", 3),
    "reciprocity_error": Measure("reciprocity", "0 is reciprocal, 2 the most", 4),
    "max_albedo": Measure("largest albedo", "over views and channels; above 1 gains energy", 3),
}
"""The figures of a row, by key."""

Values = dict[str, float | None]
Reasons = dict[str, str]


def measure(reference: Reference, name: str, method: Method) -> tuple[Values, Reasons]:
    """Fit a method to a material, and measure the result.

    Parameters
    ----------
    reference
        The material, with the settings of a protocol.
    name, method
        The method; "truth" has no fit and no errors.

    Returns
    -------
    values
        Values by the keys of :data:`MEASURES`; None if there is none.
    reasons
        Why a value is None, by key.

    Raises
    ------
    NacreError
        If the method cannot represent this material.
    """
    spent = math.nan

    def timed(brdf: Brdf) -> Brdf:
        nonlocal spent
        start = time.process_time()
        fitted = method.fit(brdf)
        spent = time.process_time() - start
        return fitted

    with one_blas_thread():
        trial, _, fitted = attempt(reference, name, replace(method, fit=timed))
        facts = physical_facts(fitted)
        found: dict[str, float | None] = {
            "size_bytes": fitted.nbytes,
            **{
                f"{light}_{key}": trial.figures[f"{light} {figure}"]
                for light in LIGHTS
                for key, figure in _FIGURES.items()
            },
            **dict(zip(_ANGLES, (trial.figures[figure] for figure in ANGLES), strict=True)),
            "fit_s": trial.seconds,
            "fit_cpu_s": spent,
            "eval_ns": 1e9 * _eval_seconds(fitted),
            "noise": sampling_variance(fitted),
            "reciprocity_error": facts["reciprocity error"],
            "max_albedo": _largest(facts["largest albedo"]),
        }
    reasons = dict(_WHY)
    if fitted.nbytes is not None:
        del reasons["size_bytes"]
    if found["noise"] == math.inf:
        reasons["noise"] = "infinite: its sampler misses some of the reflected light"
    if GIVEN in method.settings:
        found |= dict.fromkeys(_FIT)
        reasons |= dict.fromkeys(_FIT, str(method.settings[GIVEN]))
    if name == TRUTH:
        fits = [key for key, entry in MEASURES.items() if entry.fitted]
        found |= dict.fromkeys(fits)
        reasons |= dict.fromkeys(fits, "is the material itself")
    values = {
        key: None if (value := found[key]) is None or not math.isfinite(value) else value
        for key in MEASURES
    }
    return values, {key: reasons[key] for key, value in values.items() if value is None}


_FIGURES = {"psnr_db": "PSNR", "ssim": "SSIM", "flip": "FLIP", "mae": "MAE"}
_ANGLES = "relative_error", "log_cosine_error"
_WHY = {
    **dict.fromkeys(MEASURES, "not finite"),
    "size_bytes": "f_r comes from a formula without stored numbers",
    **{f"{light}_psnr_db": "the pictures are equal" for light in LIGHTS},
    "noise": "reflects nothing",
    "reciprocity_error": "reflects nothing, or is not known at any pair both ways",
}
"""Default reasons why a measure has no value."""


def _largest(albedo: list[float | None]) -> float | None:
    known = [value for value in albedo if value is not None]
    return max(known) if len(known) == len(albedo) else None


def _eval_seconds(brdf: Brdf) -> float:
    """Processor time of `eval` per pair of directions, float32: the median of some rounds."""
    w = np.random.default_rng(0).normal(size=(2, _PAIRS, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    brdf.eval(*w)  # compiles
    rounds = []
    for _ in range(_ROUNDS):
        start = time.process_time()
        brdf.eval(*w)
        rounds.append((time.process_time() - start) / _PAIRS)
    return median(rounds)
