"""The fit of a model to pictures: views of a material under lights, as a display shows them.

A picture is what is judged in the end, and the parameters of a standard are too few to match
everywhere at once: the fit spends them where pictures show it. Two kinds of pictures count alike,
by the logarithm of their mean squared error (that is, by their PSNR): views under an even sky and
lamps of many sizes, and spheres under directional lights.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from nacre.analytic.model import CHANNELS, AnalyticBrdf, Parameter, between
from nacre.array import Doubles, Floats
from nacre.brdf import Brdf
from nacre.color import GAMMA, displayed
from nacre.compile.adjustable import AdjustableFunction
from nacre.errors import NacreError
from nacre.numerics.levenberg_marquardt import minimize
from nacre.runtime.progress import Progress
from nacre.sampling.lit_views import LAMPS, SHARPNESS, lit_spheres, lit_views

_ANGLES = (0.0, 20.0, 45.0, 70.0, 100.0)  # between light and view; degrees
_DARK = 1e-4  # added to what is seen: at black, the gamma curve has no derivative
_STEP = 1e-2  # of differences, on the whole line
_LIMIT = 12.0  # of parameters on the whole line: beyond it they are at their bounds
_EDGE = 1e-3  # distance of a start from the bounds, as a fraction of the range
_FLOOR = 1e-6  # mean squared error, 60 dB, below which a picture is not weighted up any more
_FEW, _MORE, _ALL = 20, 15, 40  # steps of a start, of the best eighth and of the best


class Pictures:
    """What pictures show of a material, for models to be compared with.

    All views may have azimuth 0 if `isotropic`; the seed chooses lamps and directions; `rough`
    takes a tenth of the directions, for many starts. Raises NacreError if hardly any of the
    material is known.
    """

    def __init__(self, brdf: Brdf, isotropic: bool, seed: int, *, rough: bool = False) -> None:
        views, size = ((16, 128, 4), 12) if rough else ((48, 384, 8), 24)
        self._lit = lit_views(seed, *views, SHARPNESS, LAMPS, isotropic)
        pairs = lit_spheres(_ANGLES, size, isotropic)
        self._shape = self._lit.wi.shape
        self._count = math.prod(self._shape[:2])
        self.wi, self.wo = (
            np.concatenate([lit.reshape(-1, 3), single])
            for lit, single in zip((self._lit.wi, self._lit.wo), pairs, strict=True)
        )
        self._cosine = self.wi[self._count :, 2:] * np.float32(math.pi)
        known = brdf.valid(self.wi, self.wo)
        if known.mean() < 0.01:
            raise NacreError(f"{brdf.name or 'reflectance'}: hardly any of it is known")
        self._known = None if known.all() else known.astype(np.float32)[:, None]
        self.target = self.shown(brdf.eval(self.wi, self.wo))

    def shown(self, f_r: Floats) -> tuple[Floats, Floats]:
        """What displays show of both kinds of pictures, for f_r in 1/sr, shape (n, 3)."""
        f_r = np.maximum(f_r, 0.0)
        if self._known is not None:
            f_r = f_r * self._known
        lit = self._lit.radiance(f_r[: self._count].reshape(self._shape))
        return _shown(lit), _shown(f_r[self._count :] * self._cosine)


def _shown(radiance: Floats) -> Floats:
    return displayed(radiance.reshape(-1).astype(np.float64), _DARK)[0]


class _Problem:
    """Differences of a model's pictures from those of a material."""

    def __init__(self, model: type[AnalyticBrdf], pictures: Pictures) -> None:
        self.numbers, self.pictures = model.numbers(), pictures
        self._function = AdjustableFunction(model.formula, {p.name: p.shape for p in self.numbers})
        ends = np.cumsum([p.size for p in self.numbers])
        self._parts = [slice(end - p.size, end) for p, end in zip(self.numbers, ends, strict=True)]
        self._low = np.concatenate([np.full(p.size, p.low) for p in self.numbers])
        self._high = np.concatenate([np.full(p.size, p.high) for p in self.numbers])
        seen = np.mean(pictures.target[1].reshape(-1, CHANNELS) ** GAMMA, axis=0)
        self._tint = seen / seen.max()
        self.weigh((1.0, 1.0))

    def values(self, free: Doubles) -> dict[str, Any]:
        # All parameters at once: one after another they take as long as small pictures.
        numbers = between(free, self._low, self._high).clip(self._low, self._high)
        return {
            p.name: numbers[part].reshape(p.shape)
            for p, part in zip(self.numbers, self._parts, strict=True)
        }

    def start(self, random: np.random.Generator) -> Doubles:
        """Parameters to start from; every other color has the tint of the material."""
        free = []
        for p in self.numbers:
            value = p.at(random.random()) if isinstance(p, Parameter) else 0.5 * (p.low + p.high)
            if p.shape == (CHANNELS,) and random.random() < 0.5:
                value = value * self._tint
            edge = _EDGE * (p.high - p.low)
            inside = np.clip(np.broadcast_to(value, p.shape), p.low + edge, p.high - edge)
            free.append(p.to_free(inside).reshape(-1))
        return np.concatenate(free)

    def point(self, values: Mapping[str, Any]) -> Doubles:
        """Given parameters on the whole line, as far out as fits go."""
        free = [p.to_free(np.asarray(values[p.name])).reshape(-1) for p in self.numbers]
        return np.concatenate(free).clip(-_LIMIT, _LIMIT)

    def weigh(self, errors: Iterable[float]) -> None:
        """Weight both kinds of pictures by these mean squared errors of theirs."""
        self._weights = [
            1.0 / math.sqrt((error + _FLOOR) * len(target))
            for error, target in zip(errors, self.pictures.target, strict=True)
        ]

    def _differences(self, free: Doubles) -> list[Floats]:
        f_r = self._function(self.values(free), self.pictures.wi, self.pictures.wo)
        f_r[~np.isfinite(f_r)] = 0.0
        shown = self.pictures.shown(f_r)
        return [s - t for s, t in zip(shown, self.pictures.target, strict=True)]

    def residuals(self, free: Doubles) -> Doubles:
        """Weighted differences, shape (n,)."""
        parts = zip(self._weights, self._differences(free), strict=True)
        return np.concatenate([weight * part for weight, part in parts])

    def jacobian(self, free: Doubles, _: Doubles) -> Doubles:
        """Derivatives of the residuals, shape (parameters, n), by differences."""
        steps = _STEP * np.eye(len(free))
        rows = [self.residuals(free + step) - self.residuals(free - step) for step in steps]
        return np.stack(rows) / (2.0 * _STEP)

    def errors(self, free: Doubles) -> tuple[float, float]:
        """Mean squared errors of both kinds of pictures."""
        first, second = (float(np.mean(part * part)) for part in self._differences(free))
        return first, second

    def minimum(self, start: Doubles, steps: int) -> tuple[Doubles, float]:
        """Parameters near a start with the smallest errors, and the sum of their logarithms."""
        found, _ = minimize(self.residuals, self.jacobian, start, steps, _LIMIT, squares=True)
        return found, sum(math.log(error + _FLOOR) for error in self.errors(found))


def fit_pictures(
    brdf: Brdf,
    model: type[AnalyticBrdf],
    starts: int,
    seed: int,
    report: Progress,
    near: Sequence[Mapping[str, Any]] = (),
) -> tuple[dict[str, Any], dict[str, float]]:
    """Values of a model whose pictures are closest to those of a reflectance, and facts about them.

    Each start takes some steps on rough pictures; the best eighth of them goes on with all, and the
    best of these to the end. Values that are given as `near` a solution go on with the best eighth;
    with these, there may be 0 starts.
    """
    isotropic = brdf.isotropic and model.isotropic
    rough = _Problem(model, Pictures(brdf, isotropic, seed + 1, rough=True))
    problem = _Problem(model, Pictures(brdf, isotropic, seed))
    going = min(starts, max(1, starts // 8))
    done, total = 0, starts + going + len(near) + 1

    def reported(found: tuple[Doubles, float]) -> tuple[Doubles, float]:
        nonlocal done
        done += 1
        report("fitting", done, total, f"{_decibels(math.exp(0.5 * found[1])):.1f} dB")
        return found

    random = np.random.default_rng((seed, 2))
    found = [reported(rough.minimum(rough.start(random), _FEW)) for _ in range(starts)]
    best = [x for x, _ in sorted(found, key=lambda each: each[1])[:going]]
    found = []
    for x in (*best, *map(problem.point, near)):
        problem.weigh(problem.errors(x))
        found.append(reported(problem.minimum(x, _MORE)))
    x = min(found, key=lambda each: each[1])[0]
    problem.weigh(problem.errors(x))
    x, _ = reported(problem.minimum(x, _ALL))
    errors = problem.errors(x)
    facts = {"views_psnr": _decibels(errors[0]), "directional_psnr": _decibels(errors[1])}
    return {name: value.tolist() for name, value in problem.values(x).items()}, facts


def _decibels(squared_error: float) -> float:
    return -10.0 * math.log10(squared_error + 1e-12)
