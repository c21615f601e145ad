"""From any reflectance to the parameters of an analytic model."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import numpy as np

from nacre.analytic.factor import FactoredBrdf
from nacre.analytic.model import AnalyticBrdf, Values
from nacre.array import Doubles
from nacre.brdf import Brdf, expect_brdf
from nacre.errors import NacreError
from nacre.geometry import join, rotate, split
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.levenberg_marquardt import minimize
from nacre.runtime.parallel import one_blas_thread, thread_map
from nacre.runtime.progress import Progress, silent
from nacre.sampling import check_isotropic, draw_samples

Model = TypeVar("Model", bound=AnalyticBrdf)

SAMPLES = 40_000  # samples drawn from a reflectance: a model has a dozen parameters, not hundreds
STARTS = 16

_LIMIT = 30.0  # of parameters on the whole line: beyond it they are at their bounds

_ROUNDS = ((2_000, 15), (5_000, 20), (None, 40))  # samples and iterations; a quarter goes on


def fit(
    brdf: Brdf,
    model: type[Model],
    *,
    gain: float = 1.0,
    samples: int = SAMPLES,
    starts: int = STARTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Model:
    """Fit an analytic model to a reflectance.

    The mean of |log(1 + k f cos) - log(1 + k g cos)| over samples and channels is minimized from
    several starts. With a gain k of 1 that is the loss of the NBRDF paper (equation 1), which a
    network is trained on; a larger one gives more weight to what is dark. A model with tables finds
    them in its own way (:mod:`nacre.analytic.factor`), and a model whose
    :attr:`AnalyticBrdf.fitted_on` says so is fitted to pictures instead
    (:mod:`nacre.analytic.picture_fit`).

    Parameters
    ----------
    brdf
        Any reflectance. One that offers scattered samples (:meth:`nacre.Brdf.scattered`) is fitted
        to all of these, any other to samples uniform in the Rusinkiewicz angles.
    model
        Class of the model.
    gain
        k.
    samples
        How many to draw.
    starts
        How many sets of parameters to start from; the best quarter of them goes on twice. A model
        with tables has one start.
    seed
        Chooses samples and starts: the same seed gives the same parameters.

    Returns
    -------
    AnalyticBrdf
        With the settings and the loss in its metadata.

    Raises
    ------
    NacreError
        If hardly any sample of the reflectance is valid, none is where the model has a value, or
        the reflectance is not isotropic although it says so.
    TypeError
        If `brdf` is no reflectance.
    """
    expect_brdf(brdf, "a fit")
    if not 0.0 < gain < math.inf:
        raise ValueError(f"gain must be positive, got {gain}")
    if min(samples, starts) < 1:
        raise ValueError("samples and starts must be positive")
    check_isotropic(brdf)
    scan = brdf.scattered()
    drawn = draw_samples(brdf, samples, seed) if scan is None else scan.samples
    drawn = drawn[np.random.default_rng((seed, 1)).permutation(len(drawn))]
    if brdf.isotropic and not model.isotropic:
        drawn = _rotated(drawn, seed)
    values: Values
    settings: dict[str, Any] = {"gain": gain, "samples": len(drawn), "starts": starts}
    report = progress or silent
    with one_blas_thread(), np.errstate(all="ignore"):
        if issubclass(model, FactoredBrdf):
            del settings["starts"]
            values, facts = model.extract(brdf, drawn, gain, seed, report)
            loss = _loss(model(**values), drawn, gain)
        elif model.fitted_on == "pictures":
            from nacre.analytic.picture_fit import fit_pictures  # with LLVM, 160 MB

            values, facts = fit_pictures(brdf, model, starts, seed, report)
            loss = _loss(model(**values), drawn, gain)
        else:
            facts = {}
            values, loss = _search(partial(_Problem, model, drawn, gain), starts, seed, report)
    settings |= facts
    if not math.isfinite(loss):
        raise NacreError(f"{brdf.name or 'reflectance'}: {model.model} cannot be fitted to it")
    metadata: dict[str, Any] = {"fit": settings | {"seed": seed, "loss": loss}}
    if brdf.source:
        metadata["source"] = dict(brdf.source)
    return model(name=brdf.name, metadata=metadata, **values)


def _rotated(samples: DirectionSamples, seed: int) -> DirectionSamples:
    """Samples of an isotropic material, each rotated about the normal by a random angle.

    They all lie at few azimuths; at others, an anisotropic model would do as it likes.
    """
    angle = np.random.default_rng((seed, 3)).uniform(0.0, 2.0 * math.pi, len(samples))
    wi, wo = (join(rotate(split(w), angle.astype(np.float32))) for w in (samples.wi, samples.wo))
    return DirectionSamples(wi, wo, samples.rgb)


class _Problem:
    """Residuals of a model at samples, as functions of its parameters on the whole line."""

    def __init__(
        self, model: type[AnalyticBrdf], samples: DirectionSamples, gain: float, count: int | None
    ) -> None:
        self.parameters, self.formula, self.gain = model.parameters, model.formula, gain
        pairs = (np.asarray(w[:count], np.float64) for w in (samples.wi, samples.wo))
        self.wi, self.wo = (tuple(np.ascontiguousarray(c) for c in split(w)) for w in pairs)
        self.targets = np.log1p(gain * np.maximum(samples.rgb[:count].T, 0.0) * self.wi[2])

    def values(self, free: Doubles) -> Values:
        values: dict[str, Any] = {}
        start = 0
        for p in self.parameters:
            numbers = p.from_free(free[start : start + p.size]).clip(p.low, p.high).tolist()
            values[p.name] = tuple(numbers) if p.color else numbers[0]
            start += p.size
        return values

    def start(self, random: np.random.Generator) -> Doubles:
        fractions = [(p, random.random()) for p in self.parameters]
        return np.concatenate([np.full(p.size, p.to_free(p.at(u))) for p, u in fractions])

    def residuals(self, free: Doubles) -> Doubles:
        """Differences of logarithms, shape (3, n)."""
        rgb = self.formula(self.values(free), self.wi, self.wo)  # type: ignore[arg-type]
        cosine = self.gain * self.wi[2]
        logs: Doubles = np.stack([np.log1p(cosine * np.maximum(c, 0.0)) for c in rgb])
        logs -= self.targets
        return logs

    def jacobian(self, free: Doubles, residuals: Doubles) -> Doubles:
        """Derivatives of the residuals, shape (sizes, 3, n), by differences.

        A color has one difference for its three parameters: each acts on its own channel.
        """
        step, start = 1e-6, 0
        rows = np.zeros((len(free), *residuals.shape))
        for p in self.parameters:
            moved = free.copy()
            moved[start : start + p.size] += step
            change = (self.residuals(moved) - residuals) / step
            if p.color:
                channels = np.arange(p.size)
                rows[start + channels, channels] = change
            else:
                rows[start] = change
            start += p.size
        rows[~np.isfinite(rows)] = 0.0
        return rows


def _loss(brdf: Brdf, samples: DirectionSamples, gain: float) -> float:
    cosine = gain * samples.wi[:, 2:].astype(np.float64)
    found, truth = (
        np.log1p(cosine * np.maximum(f, 0.0))
        for f in (brdf.eval(samples.wi, samples.wo), samples.rgb)
    )
    return float(np.abs(found - truth).mean())


def _minimum(problem: _Problem, iterations: int, free: Doubles) -> tuple[Doubles, float]:
    with np.errstate(all="ignore"):  # the setting belongs to a thread
        return minimize(problem.residuals, problem.jacobian, free, iterations, _LIMIT)


def _search(
    problem_of: Callable[[int | None], _Problem], starts: int, seed: int, report: Progress
) -> tuple[Values, float]:
    """The best parameters found, and their mean loss over all samples."""
    problem = problem_of(None)
    candidates = [problem.start(np.random.default_rng((seed, 2, k))) for k in range(starts)]
    counts = [max(1, starts // 4**k) for k in range(len(_ROUNDS))]
    done, total = 0, sum(counts)
    best: list[tuple[float, int, Doubles]] = []
    for (size, iterations), going in zip(_ROUNDS, counts, strict=True):
        best = []
        work = partial(_minimum, problem_of(size), iterations)
        for k, (found, loss) in enumerate(thread_map(work, candidates[:going])):
            best.append((loss if math.isfinite(loss) else math.inf, k, found))
            done += 1
            report("fitting", done, total, f"loss {loss:.5f}")
        candidates = [found for _, _, found in sorted(best, key=lambda x: x[:2])]
    return problem.values(candidates[0]), min(best, key=lambda x: x[:2])[0]
