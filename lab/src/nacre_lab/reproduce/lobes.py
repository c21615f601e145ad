"""Figure 8: lobes of methods drawn over those of the material."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.figures.plot import lobe_figure
from nacre.geometry import from_spherical, join, split
from nacre.runtime.progress import Progress
from nacre_lab.reproduce.study import Study
from nacre_lab.reproduce.trial import TRUTH

INCIDENCE = tuple(math.radians(degrees) for degrees in (15.0, 45.0, 75.0, 80.0))
"""Polar angles of the light."""

FIGURES = tuple(f"light at {math.degrees(angle):g}°" for angle in INCIDENCE)
"""Names of the values of :func:`lobe_errors`, one for each angle of incidence."""

_LAST = 89
"""Angle of the outermost viewer in degrees."""


def lobe_pages(study: Study, methods: Sequence[str]) -> dict[str, Any]:
    """A polar plot for each material, by name, with the truth and the methods."""
    pages = {}
    for material in study.materials:
        found = [m for m in methods if (material, m) in study.trials]
        lobes = {material: study.fitted(material, TRUTH)}
        lobes |= {method: study.fitted(material, method) for method in found}
        pages[material] = lobe_figure(lobes, INCIDENCE)
    return pages


def with_lobe_errors(study: Study, methods: Sequence[str], progress: Progress) -> Study:
    """The same trials with :func:`lobe_errors` instead of their figures."""
    trials = {}
    for index, material in enumerate(study.materials):
        truth = study.fitted(material, TRUTH)
        for pair in ((material, method) for method in methods):
            if pair in study.trials:
                errors = lobe_errors(truth, study.fitted(*pair))
                values = dict(zip(FIGURES, errors, strict=True))
                trials[pair] = replace(study.trials[pair], figures=values)
        progress("lobes", index + 1, len(study.materials), material)
    return replace(study, trials=trials)


def lobe_errors(truth: Brdf, other: Brdf) -> list[float]:
    """Mean of |log10 g - log10 f| over viewers in the plane of incidence, in decades.

    Viewers are one degree apart, up to 89 degrees from the normal on both sides; f and g are
    luminances of f_r. Viewers for which f is unknown or 0 do not count; g is clamped to at least a
    millionth of the largest f.

    Returns
    -------
    list of float
        One for each of :data:`INCIDENCE`.
    """
    theta = np.radians(np.arange(-_LAST, _LAST + 1.0))
    wo = join(from_spherical(theta, np.zeros_like(theta)))
    errors = []
    for angle in INCIDENCE:
        wi = np.broadcast_to([-math.sin(angle), 0.0, math.cos(angle)], wo.shape)
        f, g = (np.asarray(luminance(split(brdf.eval(wi, wo)))) for brdf in (truth, other))
        known = truth.valid(wi, wo) & (f > 0.0)
        floor = 1e-6 * f.max(initial=0.0)
        difference = np.log10(np.maximum(g[known], floor)) - np.log10(np.maximum(f[known], floor))
        errors.append(float(np.abs(difference).mean()) if known.any() else math.nan)
    return errors
