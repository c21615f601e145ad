"""Pictures of what is as plausible as a material that is known from few samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Image
from nacre.brdf import Brdf
from nacre.latent.intervals import FRACTION, interval
from nacre.render.lights import Light
from nacre.render.sphere import render_sphere

MATERIALS = 32
"""Plausible materials that are rendered."""
DIRECTIONS = 96
"""Of light from the environment: fewer than where errors are told, for many pictures."""


@dataclass(frozen=True)
class PlausibleViews:
    """The sphere under one light, of what is plausible.

    Parameters
    ----------
    low, high
        Linear pictures whose pixels are the ends of intervals of 90 %, shape (size, size, 3).
    inside
        Fraction of the covered pixels and channels of the reference that lie in the intervals.
    """

    low: Image
    high: Image
    inside: float


def plausible_views(
    truth: Brdf, plausible: Sequence[Brdf], light: Light, size: int, fraction: float = FRACTION
) -> PlausibleViews:
    """Intervals of pictures, and how often the reference lies inside.

    Parameters
    ----------
    truth
        The reference.
    plausible
        Materials that are as plausible as each other, one or more; :data:`MATERIALS` count.
    light
        See :func:`nacre.render.sphere.standard_lights`.
    size
        Pixels along an edge.
    fraction
        How often it should.
    """
    image, mask = render_sphere(truth, light, size)
    shown = np.stack([render_sphere(brdf, light, size)[0] for brdf in plausible[:MATERIALS]])
    low, high = (end.astype(np.float32) for end in interval(shown, fraction))
    inside: npt.NDArray[np.bool_] = (image >= low) & (image <= high)
    return PlausibleViews(low, high, float(inside[mask].mean()))
