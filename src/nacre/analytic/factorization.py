"""Fit of a product of tables by alternating weighted least squares.

After Bagher, Snyder and Nowrouzezahrai 2016: one table after the other is solved for while the
others stay, with weights that compress the range of f_r. We could not establish which weights they
used. Here the weights turn squares into absolute differences of log(1 + k f cos), by which every
model of this package is fitted. Steps of all tables at once follow, which are not in the paper:
alternating alone gets stuck far from tables that made the data.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.analytic.factor import NODES, Cell, locate
from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.geometry import join, split, uniform_rusinkiewicz
from nacre.numerics.direction_samples import DirectionSamples

TABLES = ("distribution", "fresnel", "masking")
SWEEPS = 8  # how often every table is solved for alone
STEPS = 40  # how often all are solved for together

_SOFTENING = 0.05  # residuals below this fraction of the mean count as squares
_DAMPING = 1e-4  # of the first steps
_CLOSE = 1e-6  # relative difference below which the slope of the logarithm stands for its secant
_SHORTEST, _LONGEST = 0.3, 3.0  # factors by which a number changes in one step
_LEAST = 1e-9  # added to numbers before their logarithm is taken


class Factors(NamedTuple):
    """A channel of the model: base + D F G(theta_i) G(theta_o) / (cos theta_i cos theta_o)."""

    base: float
    distribution: Doubles
    fresnel: Doubles
    masking: Doubles


class Channel:
    """What the tables of one channel are fitted to: samples, their weights (n,), and the gain k."""

    def __init__(
        self, samples: DirectionSamples, channel: int, weights: Doubles, gain: float
    ) -> None:
        light, view = (split(np.asarray(w, np.float64)) for w in (samples.wi, samples.wo))
        self._cells = locate(light, view)
        self._scale = 1.0 / (light[2] * view[2])
        self._cosine = gain * light[2]
        self._values = np.maximum(np.asarray(samples.rgb[:, channel], np.float64), 0.0)
        self._logs = np.log1p(self._cosine * self._values)
        self._weights = weights

    def fit(self, sweeps: int = SWEEPS, steps: int = STEPS) -> Factors:
        """The tables after sweeps over one after the other, then steps of all at once."""
        found = self._start()
        for _ in range(sweeps):
            for name in TABLES:
                found = self._step(found, [name], _DAMPING)
        damping, loss = _DAMPING, self._loss(found)
        for _ in range(steps):
            tried = self._step(found, TABLES, damping)
            if (lower := self._loss(tried)) < loss:
                found, loss, damping = tried, lower, 0.3 * damping
            else:
                damping *= 10.0
        return found

    def _start(self) -> Factors:
        """A dim base, no Fresnel effect, no masking, and D from geometric means about its nodes."""
        values = np.log(self._values / self._scale + _LEAST)
        place = self._cells.half.node + self._cells.half.part
        nearest = np.rint(place).astype(np.int64)
        count = np.bincount(nearest, minlength=NODES)
        mean = np.bincount(nearest, values, NODES) / np.maximum(count, 1)
        nodes = np.arange(NODES)
        mean = np.interp(nodes, nodes[count > 0], mean[count > 0])
        ones = np.ones(NODES)
        return Factors(0.1 * float(np.median(self._values)) + _LEAST, np.exp(mean), ones, ones)

    def _step(self, found: Factors, names: Sequence[str], damping: float) -> Factors:
        """Solve for some tables and the base; every number changes by a factor near 1."""
        half, difference, light, view = self._cells
        d, f = _at(found.distribution, half), _at(found.fresnel, difference)
        g_light, g_view = _at(found.masking, light), _at(found.masking, view)
        uses = {
            "distribution": [(half, f * g_light * g_view)],
            "fresnel": [(difference, d * g_light * g_view)],
            "masking": [(light, d * f * g_view), (view, d * f * g_light)],
        }
        error = self._error(found)
        terms = [(np.zeros(len(error), np.int64), np.full(len(error), found.base))]
        for k, name in enumerate(names):
            table, first = getattr(found, name), 1 + k * NODES
            for (node, part), rest in uses[name]:
                scaled = self._scale * rest
                terms += [
                    (first + node, scaled * (1.0 - part) * table[node]),
                    (first + node + 1, scaled * part * table[node + 1]),
                ]
        size = 1 + len(names) * NODES
        step = _solve(terms, size, error, self._compressive(error), damping)
        change = np.clip(1.0 + step, _SHORTEST, _LONGEST)
        rows = change[1:].reshape(len(names), NODES)
        tables = {name: getattr(found, name) * row for name, row in zip(names, rows, strict=True)}
        return found._replace(base=found.base * float(change[0]), **tables)

    def _error(self, found: Factors) -> Doubles:
        """Model less data."""
        half, difference, light, view = self._cells
        masking = _at(found.masking, light) * _at(found.masking, view)
        facets = _at(found.distribution, half) * _at(found.fresnel, difference) * masking
        return np.asarray(found.base + self._scale * facets - self._values)

    def _loss(self, found: Factors) -> float:
        logs = np.log1p(self._cosine * (self._values + self._error(found))) - self._logs
        return float(np.average(np.abs(logs), weights=self._weights))

    def _compressive(self, error: Doubles) -> Doubles:
        """Weights with which squared errors of f_r add up to absolute ones of its logarithm."""
        logs = np.log1p(self._cosine * (self._values + error)) - self._logs
        slope = self._cosine / (1.0 + self._cosine * self._values)
        near = np.abs(error) < _CLOSE * (1.0 + self._values)
        secant = np.where(near, slope, logs / np.where(near, 1.0, error))
        softening = _SOFTENING * np.average(np.abs(logs), weights=self._weights) + 1e-12
        return np.asarray(self._weights * secant**2 / np.sqrt(logs**2 + softening**2))


def draw(brdf: Brdf, samples: DirectionSamples, seed: int) -> tuple[DirectionSamples, Doubles]:
    """Samples uniform in the Rusinkiewicz angles and as many that are dense near the mirror
    direction.

    The latter are drawn from `brdf` with theta_h = u^2 pi / 2, like the nodes of D, which the
    uniform ones hardly reach. Weights (n,) make all of them count as if all were uniform.
    """
    u = np.random.default_rng((seed, 3)).random((4, 2 * len(samples)))
    u[0] **= 2
    if brdf.isotropic:
        u[1] = 0.0
    wi, wo = (join(w) for w in uniform_rusinkiewicz(u))
    visible = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    wi, wo = wi[visible], wo[visible]
    known = brdf.valid(wi, wo)
    wi, wo = wi[known][: len(samples)], wo[known][: len(samples)]
    rgb = brdf.eval(wi, wo)
    finite = np.isfinite(rgb).all(axis=1)
    parts = (samples, DirectionSamples(wi[finite], wo[finite], rgb[finite]))
    light, view, color = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("wi", "wo", "rgb")
    )
    whole = DirectionSamples(light, view, color)
    place = locate(split(light), split(view)).half
    root = (place.node + place.part) / (NODES - 1)
    ratio = len(parts[1]) / len(samples)
    density = 1.0 + ratio * 0.5 / np.maximum(root, 1e-6)
    return whole, np.asarray(1.0 / density, np.float64)


def _at(table: Doubles, cell: Cell) -> Doubles:
    return np.asarray(table[cell.node] + cell.part * (table[cell.node + 1] - table[cell.node]))


def _solve(
    terms: Sequence[tuple[npt.NDArray[np.int64], Doubles]],
    size: int,
    error: Doubles,
    weights: Doubles,
    damping: float,
) -> Doubles:
    """The step of the numbers that minimizes the weighted squares of the remaining error, (size,).

    Terms are which number each sample depends on, and its derivative, each of shape (n,). Damping
    is the pull of the step to 0, relative to the curvature of each number and a little of their
    mean.
    """
    products, slope = np.zeros(size * size), np.zeros(size)
    for k, (column, value) in enumerate(terms):
        weighted = weights * value
        slope += np.bincount(column, weighted * error, size)
        products += np.bincount((size + 1) * column, 0.5 * weighted * value, size * size)
        for other, factor in terms[:k]:
            products += np.bincount(size * column + other, weighted * factor, size * size)
    half = products.reshape(size, size)
    normal = half + half.T
    curvature = np.diag(normal)
    pull = damping * (curvature + 0.01 * curvature.mean()) + 1e-300
    return np.asarray(np.linalg.solve(normal + np.diag(pull), -slope), np.float64)
