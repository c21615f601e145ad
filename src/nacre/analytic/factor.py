"""Microfacet models with tables for factors: functions of one angle, linear between nodes."""

from __future__ import annotations

import abc
import math
from typing import Any, NamedTuple

import numpy as np

from nacre.analytic.model import AnalyticBrdf
from nacre.array import Array, Components, Floats, Table, namespace
from nacre.brdf import Brdf
from nacre.geometry import dot, half_vector, to_spherical
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import Progress

NODES = 90  # nodes of every table, as in both papers


_QUARTER = 0.5 * math.pi


class FactoredBrdf(AnalyticBrdf):
    """An analytic model with tables; a subclass computes them from a reflectance."""

    @classmethod
    @abc.abstractmethod
    def extract(
        cls, brdf: Brdf, samples: DirectionSamples, gain: float, seed: int, report: Progress
    ) -> tuple[dict[str, Any], dict[str, float]]:
        """Values of a model for a reflectance, and facts about the fit.

        `samples` are those of `brdf` that the model will be judged by; `gain` and `seed` are those
        of :func:`nacre.analytic.fit`.
        """


class Cell(NamedTuple):
    """Where an angle lies between the nodes of a table."""

    node: Array  # the node before it
    part: Array  # its position from there to the next, in [0, 1]


class Cells(NamedTuple):
    """Where a pair of directions lies in tables of three angles."""

    half: Cell  # theta_h; nodes stand evenly in its square root, densely about the mirror direction
    difference: Cell  # theta_d; nodes stand evenly
    light: Cell  # theta_i; nodes stand evenly
    view: Cell  # theta_o; likewise


def locate(wi: Components, wo: Components) -> Cells:
    """Cells of pairs of directions; angles end at the horizon."""
    xp = namespace(*wi, *wo)
    apart = wi[0] - wo[0], wi[1] - wo[1], wi[2] - wo[2]
    along = wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]
    sine, cosine = (xp.sqrt(dot(v, v)) for v in (apart, along))
    theta_h = to_spherical(half_vector(wi, wo))[0]
    return Cells(
        _cell(xp.sqrt(theta_h / _QUARTER)),
        _cell(xp.arctan2(sine, cosine) / _QUARTER),
        _cell(to_spherical(wi)[0] / _QUARTER),
        _cell(to_spherical(wo)[0] / _QUARTER),
    )


def half_angles() -> Floats:
    """theta_h of the nodes, radians, shape (nodes,)."""
    return np.linspace(0.0, 1.0, NODES) ** 2 * _QUARTER


def even_angles() -> Floats:
    """Any other angle of the nodes, radians, shape (nodes,)."""
    return np.linspace(0.0, _QUARTER, NODES)


def lookup(table: Table, row: int, cell: Cell) -> Array:
    """Value of a row of a table."""
    xp = namespace(cell.part)
    first = row * NODES + cell.node
    low, high = xp.take(table, first), xp.take(table, first + 1)
    return low + cell.part * (high - low)


def _cell(position: Array) -> Cell:
    xp = namespace(position)
    place = xp.minimum(xp.maximum(position, 0.0), 1.0) * (NODES - 1)
    # A direction that is NaN makes an invalid index: keep it inside.
    node = xp.maximum(xp.minimum(xp.to_index(place), NODES - 2), 0)
    return Cell(node, place - xp.to_float(node, place))
