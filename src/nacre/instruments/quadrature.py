"""Nodes and weights of integrals over peaks: Gauss-Legendre panels that shrink toward a point."""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np

from nacre.array import Doubles


class Rule(NamedTuple):
    """How dense the nodes of instruments are."""

    finest: float  # width of the panels beside a peak, in radians
    around: int  # azimuths of a hemisphere
    views: tuple[int, int]  # directions in the cone of a receptor, from its axis and around it
    slit: tuple[int, int]  # directions in the image of a slit, in the plane of incidence and across


EXACT = Rule(5e-5, 64, (3, 8), (4, 6))
"""For any material: panels are about a quarter of the lobe of the smoothest surface that float32
half vectors resolve, as an 85-degree receptor sees it across."""
SMOOTH = Rule(3e-3, 24, (2, 4), (2, 3))
"""For small networks, which cannot mirror sharply."""

_RATIO = 3.0  # of the widths of two neighbors
_NODES = 5  # per panel: the error of a GGX lobe is then about 1e-6


@functools.cache
def gauss(count: int) -> tuple[Doubles, Doubles]:
    """Nodes in (-1, 1) and weights, shape (count,) each, of the Gauss-Legendre rule."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes, weights


def on_interval(low: float, high: float, count: int) -> tuple[Doubles, Doubles]:
    """The Gauss-Legendre rule on an interval: nodes and weights, shape (count,) each."""
    nodes, weights = gauss(count)
    half = 0.5 * (high - low)
    return 0.5 * (low + high) + half * nodes, half * weights


def graded(low: float, high: float, peak: float, finest: float) -> tuple[Doubles, Doubles]:
    """A rule on [low, high] for functions that may be sharp at `peak`, (n,) each.

    Panels on both sides of the peak are three times as wide as the next one closer to it, down to
    `finest`. A peak outside of the interval is taken at its nearer end.
    """
    peak = min(max(peak, low), high)
    panels = []
    for end in (low, high):
        length = abs(end - peak)
        if length > 0.0:
            count = max(0, math.ceil(math.log(length / finest) / math.log(_RATIO)))
            distances = [0.0, *(length * _RATIO**-k for k in range(count, -1, -1))]
            sign = math.copysign(1.0, end - peak)
            for near, far in itertools.pairwise(distances):
                a, b = sorted((peak + sign * near, peak + sign * far))
                panels.append(on_interval(a, b, _NODES))
    nodes, weights = (np.concatenate(part) for part in zip(*panels, strict=True))
    return nodes, weights


def circle(count: int) -> tuple[Doubles, float]:
    """Angles in radians, (count,), evenly around a circle, and the weight of each."""
    step = 2.0 * math.pi / count
    return np.asarray((np.arange(count) + 0.5) * step, np.float64), step
