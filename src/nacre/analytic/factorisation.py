"""Fit of a product of tables by alternating weighted least squares.

After Bagher, Snyder and Nowrouzezahrai 2016: one table after the other is solved for while the
others stay, and weights compress the range of f_r. Their objective weighs squared differences of
f_r; here the weights also make them absolute differences of log(1 + k f cos), which every model of
this package is fitted by.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.analytic.factor import NODES, Cell, locate
from nacre.brdf import Brdf, DirectionSamples
from nacre.geometry import join, split, uniform_rusinkiewicz

Vector = npt.NDArray[np.float64]

SWEEPS = 60
"""How often every table is solved for."""

_SOFTENING = 0.05
"""Residuals below this share of the mean count as squares."""
_DAMPING = 1e-4
"""Pull of a step to 0, relative to the curvature of each number, and of their mean."""
_CLOSE = 1e-6
"""Relative difference below which the slope of the logarithm stands for its secant."""
_SHORTEST, _LONGEST = 0.3, 3.0
"""Factors by which a number changes in one step."""
_LEAST = 1e-9
"""Added to numbers before their logarithm is taken."""


class Factors(NamedTuple):
    """A channel of the model: base + D F G(theta_i) G(theta_o) / (cos theta_i cos theta_o)."""

    base: float
    distribution: Vector
    fresnel: Vector
    masking: Vector


class Channel:
    """What the tables of one channel are fitted to.

    Parameters
    ----------
    samples
        Pairs of directions, n of them, and f_r.
    channel
        Which of its channels.
    weights
        Of each sample, shape (n,).
    gain
        k.
    """

    def __init__(
        self, samples: DirectionSamples, channel: int, weights: Vector, gain: float
    ) -> None:
        light, view = (split(np.asarray(w, np.float64)) for w in (samples.wi, samples.wo))
        self._cells = locate(light, view)
        self._scale = 1.0 / (light[2] * view[2])
        self._cosine = gain * light[2]
        self._values = np.maximum(np.asarray(samples.rgb[:, channel], np.float64), 0.0)
        self._logs = np.log1p(self._cosine * self._values)
        self._weights = weights

    def fit(self, sweeps: int = SWEEPS) -> Factors:
        """The tables after some sweeps over all of them."""
        found = self._start()
        for _ in range(sweeps):
            for name in ("distribution", "fresnel", "masking"):
                found = self._improve(found, name)
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

    def _improve(self, found: Factors, name: str) -> Factors:
        """Solve for one table and the base; every number changes by a factor near 1."""
        half, difference, light, view = self._cells
        d, f = _at(found.distribution, half), _at(found.fresnel, difference)
        g_light, g_view = _at(found.masking, light), _at(found.masking, view)
        factors = {
            "distribution": [(half, f * g_light * g_view)],
            "fresnel": [(difference, d * g_light * g_view)],
            "masking": [(light, d * f * g_view), (view, d * f * g_light)],
        }[name]
        error = found.base + self._scale * d * f * g_light * g_view - self._values
        rows = [(cell, self._scale * rest) for cell, rest in factors]
        table: Vector = getattr(found, name)
        step = _solve(rows, table, found.base, error, self._compressive(error))
        change = np.clip(1.0 + step, _SHORTEST, _LONGEST)
        return found._replace(**{name: table * change[:-1]}, base=found.base * float(change[-1]))

    def _compressive(self, error: Vector) -> Vector:
        """Weights with which squared errors of f_r add up to absolute ones of its logarithm."""
        logs = np.log1p(self._cosine * (self._values + error)) - self._logs
        slope = self._cosine / (1.0 + self._cosine * self._values)
        near = np.abs(error) < _CLOSE * (1.0 + self._values)
        secant = np.where(near, slope, logs / np.where(near, 1.0, error))
        softening = _SOFTENING * np.average(np.abs(logs), weights=self._weights) + 1e-12
        weights: Vector = self._weights * secant**2 / np.sqrt(logs**2 + softening**2)
        return weights


def draw(brdf: Brdf, samples: DirectionSamples, seed: int) -> tuple[DirectionSamples, Vector]:
    """Samples uniform in the Rusinkiewicz angles and as many dense near the mirror direction.

    These have theta_h = u^2 pi / 2, like the nodes of D, which the uniform ones hardly reach.

    Parameters
    ----------
    brdf
        Where the dense ones come from.
    samples
        The uniform ones.
    seed
        Of the dense ones.

    Returns
    -------
    samples
        All of them.
    weights
        By which they count as if all were uniform, shape (n,).
    """
    u = np.random.default_rng((seed, 3)).random((4, 2 * len(samples)))
    u[0], u[1] = u[0] ** 2, 0.0
    wi, wo = (join(w) for w in uniform_rusinkiewicz(u))
    visible = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
    wi, wo = wi[visible], wo[visible]
    known = brdf.valid(wi, wo)
    wi, wo = wi[known][: len(samples)], wo[known][: len(samples)]
    rgb = brdf.eval(wi, wo)
    finite = np.isfinite(rgb).all(axis=1)
    parts = (samples, DirectionSamples(wi[finite], wo[finite], rgb[finite]))
    light, view, colour = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("wi", "wo", "rgb")
    )
    whole = DirectionSamples(light, view, colour)
    place = locate(split(light), split(view)).half
    root = (place.node + place.part) / (NODES - 1)
    share = len(parts[1]) / len(samples)
    density = 1.0 + share * 0.5 / np.maximum(root, 1e-6)
    return whole, np.asarray(1.0 / density, np.float64)


def _at(table: Vector, cell: Cell) -> Vector:
    values: Vector = table[cell.node] + cell.part * (table[cell.node + 1] - table[cell.node])
    return values


def _solve(
    rows: Sequence[tuple[Cell, Vector]], table: Vector, base: float, error: Vector, weights: Vector
) -> Vector:
    """Relative changes of a table and of the base with the least weighted squares, (nodes + 1,).

    Parameters
    ----------
    rows
        Where a sample takes values of the table, and what each is multiplied by.
    table, base
        Their values now.
    error
        Model less data of every sample.
    weights
        Of its square.
    """
    size = NODES + 1
    terms: list[tuple[npt.NDArray[np.int64], Vector]] = [
        (np.full(len(error), NODES), np.full(len(error), base))
    ]
    for (node, part), rest in rows:
        terms += [
            (node, rest * (1.0 - part) * table[node]),
            (node + 1, rest * part * table[node + 1]),
        ]
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
    damping = _DAMPING * (curvature + curvature.mean()) + 1e-300
    return np.asarray(np.linalg.solve(normal + np.diag(damping), -slope), np.float64)
