"""How plausible a code is: the density of codes, samples of it, and the way back to it.

A code is like that of a training material, or like that of one with its channels in another order,
or, seldom, anything. About each training material the density is normal, twice, close and wide,
with a covariance of its own: that of the codes nearest to it, between which materials lie. Two
normal distributions about 0, narrow and wide, cover what is like no training material. So the whole
is a mixture of normal distributions, in closed form, with derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles

NEAREST = 24  # codes that the covariance about a training material comes from
ROUND = 0.5
"""Weight of a round covariance of the same trace beside it, which makes it invertible."""
SCALES = 0.2, 0.8
"""Scales of the covariances about the training materials, close and wide."""
ANYWHERE = 1.0, 4.0  # variances of the normal distributions about 0
WEIGHTS = 0.15, 0.55, 0.23, 0.07
"""Weights of the scales, then of the normal distributions. With these constants, the mean log
density of codes that are left out is within 0.5 of what weights found for these very codes reach.
"""
PLAUSIBLE = 0.05
"""Fraction of the training materials that are less plausible than what is called plausible."""

_FLOOR = 1e-4  # least variance: keeps the density finite where all materials are the same
_ROUNDS, _HALVINGS = 60, 30  # of a projection
_CLOSE = 1e-6  # change of a code at which a projection has settled


class Blobs(NamedTuple):
    """Normal distributions about the training materials, with their channels in every order."""

    centers: Doubles  # shape (n, k)
    whitening: Doubles
    """W, shape (n, k, k), lower triangular: the covariance is the inverse of W^T W."""
    logarithms: Doubles  # of the density at the center, shape (n,)


@dataclass(frozen=True, eq=False)
class Prior:
    """The density of codes."""

    orders: Doubles
    """Codes of the training materials with their channels in all orders, the material's own order
    first, shape (m, orders, k). m may be 0."""
    blobs: Blobs  # about each of them, in the same order

    def __post_init__(self) -> None:
        if not np.isfinite(self.orders).all():
            raise ValueError("codes are not finite")

    @classmethod
    def about(cls, orders: npt.ArrayLike) -> Prior:
        """The density from codes (m, orders, k) of the training materials; see the class."""
        codes = np.asarray(orders, np.float64)
        k = codes.shape[-1]
        every = codes.reshape(-1, k)
        whitening, logarithms = np.empty((len(every), k, k)), np.empty(len(every))
        for index, center in enumerate(every):
            root = _root(every, center, own=1)
            whitening[index] = np.linalg.inv(root)
            half = np.log(np.diag(root)).sum()
            logarithms[index] = -half - 0.5 * k * math.log(2.0 * math.pi)
        return cls(codes, Blobs(every, whitening, logarithms))

    @property
    def code_dim(self) -> int:
        return int(self.orders.shape[-1])

    def log_density(self, codes: npt.ArrayLike) -> Doubles:
        """Natural logarithm of the density at codes (..., k), shape (...)."""
        values = np.asarray(codes, np.float64)
        flat = values.reshape(-1, self.code_dim)
        parts = [_log_sum(self._logs(code)) for code in flat]
        return np.array(parts).reshape(values.shape[:-1])

    def slope(self, codes: npt.ArrayLike) -> Doubles:
        """Derivatives of the log density by the values of codes (..., k), in that shape."""
        values = np.asarray(codes, np.float64)
        flat = values.reshape(-1, self.code_dim)
        found = [pull - hold @ code for code in flat for hold, pull in [self._spring(code)]]
        return np.array(found).reshape(values.shape)

    def left_out(self) -> Doubles:
        """Log densities of the training materials, each in the density without itself, shape (m,).

        Raises ValueError if there are fewer than two.
        """
        count, orders, _ = self.orders.shape
        if count < 2:
            raise ValueError("what is plausible takes two training materials or more")
        logs = np.empty(count)
        for index, code in enumerate(self.orders[:, 0]):
            parts = self._logs(code)
            others = parts[: -len(ANYWHERE)].reshape(len(SCALES), count, orders)
            left = np.delete(others, index, axis=1) + math.log(count / (count - 1))
            logs[index] = _log_sum(np.concatenate([left.reshape(-1), parts[-len(ANYWHERE) :]]))
        return logs

    def level(self, fraction: float = PLAUSIBLE) -> float:
        """Log density below which a fraction of the training materials lies."""
        return float(np.quantile(self.left_out(), fraction))

    def sample(
        self, count: int, seed: int = 0, like: Sequence[int] | npt.NDArray[np.int64] | None = None
    ) -> Doubles:
        """Codes drawn from the density, shape (count, k); the same seed gives the same codes.

        `like` are indices of training materials: codes are then drawn about these alone, their
        channels as they are. Without it the whole density is used, which is the same for all orders
        of the channels. Raises ValueError if `like` is empty, or there is nothing to draw about.
        """
        random = np.random.default_rng((seed, 7))
        materials, orders, k = self.orders.shape
        weights = np.array(WEIGHTS)
        if like is not None:
            weights[len(SCALES) :] = 0.0
        if not materials:
            weights[: len(SCALES)] = 0.0
        if not weights.any() or (like is not None and not len(like)):
            raise ValueError("there is no training material to draw codes about")
        kinds = random.choice(len(weights), count, p=weights / weights.sum())
        noise = random.normal(size=(count, k))
        found = np.empty((count, k))
        for index, kind in enumerate(kinds):
            if kind >= len(SCALES):
                found[index] = math.sqrt(ANYWHERE[kind - len(SCALES)]) * noise[index]
                continue
            if like is None:
                blob = random.integers(materials * orders)
            else:
                blob = int(random.choice(np.asarray(like))) * orders
            offset = np.linalg.solve(self.blobs.whitening[blob], noise[index])
            found[index] = self.blobs.centers[blob] + math.sqrt(SCALES[kind]) * offset
        return found

    def around(self, code: npt.ArrayLike, count: int, seed: int = 0) -> Doubles:
        """Codes drawn as if a code (k,) were that of a training material, shape (count, k).

        The same seed gives the same codes. Raises ValueError if there is no training material.
        """
        random = np.random.default_rng((seed, 8))
        center = np.asarray(code, np.float64)
        if not self.orders.size:
            raise ValueError("there is no training material to draw codes about")
        root = _root(self.blobs.centers, center, own=0)
        chances = np.array(WEIGHTS[: len(SCALES)])
        scales = random.choice(SCALES, count, p=chances / chances.sum())
        noise = random.normal(size=(count, self.code_dim))
        return np.asarray(center + np.sqrt(scales)[:, None] * (noise @ root.T), np.float64)

    def project(self, code: npt.ArrayLike, fraction: float = PLAUSIBLE) -> Doubles:
        """The closest code to another one (k,) that is as plausible as most training materials.

        It has the log density :meth:`level`; a code that has it already stays. The distance is
        Euclidean; the result is the closest in the valleys of the density that lead there, which
        need not be the closest of all. Raises ValueError if there are fewer than two training
        materials.
        """
        start = np.asarray(code, np.float64)
        level = self.level(fraction)
        if self.log_density(start) >= level:
            return start.copy()
        low, high = -12.0, 12.0  # of the logarithm of what density weighs beside distance
        best = self._settled(start, math.exp(high))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            found = self._settled(start, math.exp(middle))
            if self.log_density(found) >= level:
                high, best = middle, found
            else:
                low = middle
        return best

    def _settled(self, start: Doubles, weight: float) -> Doubles:
        """Where the log density times a weight, less half the squared distance, is at a maximum."""
        code = start.copy()
        for _ in range(_ROUNDS):
            hold, pull = self._spring(code)
            stiffness = np.eye(len(code)) + weight * hold
            moved = np.asarray(np.linalg.solve(stiffness, start + weight * pull), np.float64)
            change = np.abs(moved - code).max()
            code = moved
            if change < _CLOSE:
                break
        return code

    def _logs(self, code: Doubles) -> Doubles:
        """Log densities of the parts at one code: by scale about the materials, then anywhere."""
        k, blobs = len(code), self.blobs
        lengths = np.square(self._whitened(code)).sum(axis=1)
        chance = math.log(len(lengths)) if len(lengths) else 0.0
        about = [
            math.log(w) - chance + blobs.logarithms - 0.5 * (lengths / s + k * math.log(s))
            for w, s in zip(WEIGHTS, SCALES, strict=False)
        ]
        square = code @ code
        anywhere = [
            math.log(w) - 0.5 * (square / v + k * math.log(2.0 * math.pi * v))
            for w, v in zip(WEIGHTS[len(SCALES) :], ANYWHERE, strict=True)
        ]
        return np.concatenate([*about, anywhere])

    def _whitened(self, code: Doubles) -> Doubles:
        """A code seen from each blob, in its standard deviations, shape (n, k)."""
        away = (code - self.blobs.centers)[..., None]
        return np.asarray((self.blobs.whitening @ away)[..., 0])

    def _spring(self, code: Doubles) -> tuple[Doubles, Doubles]:
        """H (k, k) and g (k,) with g - H c the slope of the log density at a code c.

        They are means of what holds the parts at their centers, by how likely each is here.
        """
        logs = self._logs(code)
        chances = np.exp(logs - _log_sum(logs))
        about, anywhere = np.split(chances, [len(logs) - len(ANYWHERE)])
        each = (about.reshape(len(SCALES), -1) / np.array(SCALES)[:, None]).sum(axis=0)
        likely = np.flatnonzero(each > 1e-12)
        roots = self.blobs.whitening[likely]
        holds = roots.swapaxes(1, 2) @ roots * each[likely, None, None]
        pull = (holds @ self.blobs.centers[likely][..., None]).sum(axis=(0, 2))
        round_part = float((anywhere / np.array(ANYWHERE)).sum()) * np.eye(len(code))
        return holds.sum(axis=0) + round_part, pull


def _root(codes: Doubles, center: Doubles, own: int) -> Doubles:
    """Lower triangular root of the covariance of the codes nearest to a center, seen from there.

    The nearest `own` of the codes (n, k) are the center itself.
    """
    k, away = codes.shape[1], codes - center
    near = np.argsort(np.square(away).sum(axis=1), kind="stable")[own : own + NEAREST]
    covariance = away[near].T @ away[near] / max(len(near), 1)
    even = max(np.trace(covariance) / k, _FLOOR) * np.eye(k)
    return np.linalg.cholesky((1.0 - ROUND) * covariance + ROUND * even)


def _log_sum(logs: Doubles) -> float:
    top = logs.max()
    return float(top + np.log(np.exp(logs - top).sum()))
