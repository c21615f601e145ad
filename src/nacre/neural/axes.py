"""The axes of an anisotropic material."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.geometry import half_vector, split
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.numerics.direction_samples import DirectionSamples

_COUNT = 1 << 15  # samples that are looked at
_GAIN = 32.0  # of the logarithm that is explained, as in the loss
_STEP = 3  # degrees between the angles that are tried first; then whole ones about the best
_WORTH = 0.98  # fraction of the error left along x and y below which the axes are others


def main_axis(samples: DirectionSamples) -> float:
    """Azimuth in radians, in [0, pi/2), of the axis to which enhanced inputs should turn x.

    The whole degree at which a linear function of what depends on the axes best explains log(1 + 32
    f cos theta_i), by least squares: logarithms of h along and across, and the difference of their
    squares. That finds one lobe as well as two that cross; inputs treat both axes alike, so a right
    angle is a whole turn. 0 unless another angle is clearly better. Samples may have any
    distribution; the first 32,768 are looked at.
    """
    wi, wo = (split(np.asarray(w[:_COUNT], np.float64)) for w in (samples.wi, samples.wo))
    rgb = np.maximum(samples.rgb[:_COUNT], 0.0).mean(axis=1)
    target = np.log1p(_GAIN * rgb * wi[2])
    x, y, _ = half_vector(wi, wo)
    square = x * x + y * y

    def error(degrees: int) -> float:
        angle = math.radians(degrees % 90)
        _, _, along, across, light, view, *_ = network_inputs(wi, wo, False, ENHANCED, angle)
        difference = math.cos(2 * angle) * (x * x - y * y) + 2 * math.sin(2 * angle) * x * y
        even = np.ones_like(x), square, np.log(square + 1e-4), light, view
        return _left(np.stack([*even, along, across, difference], axis=-1), target)

    coarse = min(range(0, 90, _STEP), key=error)
    best = min(range(coarse - _STEP + 1, coarse + _STEP), key=error)
    return math.radians(best % 90) if error(best) < _WORTH * error(0) else 0.0


def _left(terms: Floats, target: Floats) -> float:
    """Mean square of what no linear combination of the terms, shape (n, k), explains."""
    found = np.linalg.lstsq(terms.T @ terms, terms.T @ target, rcond=None)[0]
    return float(np.square(terms @ found - target).mean())
