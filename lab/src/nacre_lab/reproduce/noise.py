"""Noise of path-traced pictures against samples per pixel, by sampler.

Results for every sampler and picture of a scene are cached between runs.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.color import tone_map
from nacre.mitsuba import bsdf
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.passes import accumulate, pass_sizes
from nacre.runtime.progress import Progress
from nacre_lab.reproduce.cache import Cache, cache_key, code_digest

Picture = npt.NDArray[np.float32]
Describe = Callable[[Sequence[Any], tuple[int, int]], dict[str, Any]]
"""A scene with some BSDFs, at a size in pixels."""

MEASURES = ("MAE", "RMSE", "MAPE", "PSNR")
_DARK = 0.01
"""Added to the divisor of MAPE, which black pixels would dominate."""


@dataclass(frozen=True)
class NoiseSettings:
    """Settings of the pictures.

    Parameters
    ----------
    size
        Width and height in pixels.
    counts
        Increasing numbers of samples per pixel at which errors are computed.
    shown
        Samples per pixel of the picture shown; one of `counts`.
    reference
        Samples per pixel of the reference picture.
    """

    size: tuple[int, int] = (360, 240)
    counts: tuple[int, ...] = (1, 4, 16, 64, 256, 1024)
    shown: int = 64
    reference: int = 4096
    seed: int = 0


@dataclass(frozen=True)
class Convergence:
    """How the noise of a picture decreased.

    Parameters
    ----------
    seconds
        Time until each count, without compiling.
    errors
        By measure, at each count.
    picture
        Picture at the count `shown`: linear RGB, shape (height, width, 3).
    """

    seconds: Sequence[float]
    errors: Mapping[str, Sequence[float]]
    picture: Picture


def reference(
    describe: Describe, brdfs: Sequence[Brdf], settings: NoiseSettings, progress: Progress
) -> Picture:
    """The converged picture, with samples of its own."""
    scene = _scene(describe, brdfs, settings)
    sizes = pass_sizes([settings.reference])
    picture: Any = None
    for done, picture in accumulate(scene, sizes, settings.seed + 1):  # noqa: B007
        progress("reference", done, settings.reference, "")
    return np.asarray(picture.astype(np.float32))


def converge(
    describe: Describe,
    brdfs: Sequence[Brdf],
    truth: Picture,
    settings: NoiseSettings,
    progress: Progress,
) -> Convergence:
    """Errors of a picture as samples are added."""
    scene = _scene(describe, brdfs, settings)
    sizes = pass_sizes(settings.counts)
    for _ in accumulate(scene, sorted(set(sizes)), settings.seed):
        pass  # compile for passes of every size
    seconds: list[float] = []
    found: dict[str, list[float]] = {measure: [] for measure in MEASURES}
    shown: Any = None
    spent = 0.0
    start = time.perf_counter()
    for done, picture in accumulate(scene, sizes, settings.seed):
        spent += time.perf_counter() - start
        if done in settings.counts:
            seconds.append(spent)
            for measure, value in errors(truth, picture).items():
                found[measure].append(value)
            if done == settings.shown:
                shown = picture.astype(np.float32)
        progress("rendering", done, settings.counts[-1], "")
        start = time.perf_counter()
    return Convergence(seconds, found, shown)


def errors(truth: npt.NDArray[np.floating], other: npt.NDArray[np.floating]) -> Mapping[str, float]:
    """MAE, RMSE, MAPE and PSNR (dB) of linear pictures after clipping and a gamma of 2.2.

    MAPE is the mean of |b - a| / (a + 0.01), as a fraction.
    """
    a, b = tone_map(truth).astype(np.float64), tone_map(other).astype(np.float64)
    rmse = math.sqrt(float(np.mean((b - a) ** 2)))
    return {
        "MAE": float(np.mean(np.abs(b - a))),
        "RMSE": rmse,
        "MAPE": float(np.mean(np.abs(b - a) / (a + _DARK))),
        "PSNR": -20.0 * math.log10(max(rmse, 1e-12)),
    }


def _scene(describe: Describe, brdfs: Sequence[Brdf], settings: NoiseSettings) -> Any:
    mi = mitsuba()
    return mi.load_dict(describe([bsdf(brdf) for brdf in brdfs], settings.size))


@dataclass
class NoiseStudy:
    """The results for a scene: the materials of each picture by its name, converged pictures, and
    runs by picture and sampler.
    """

    settings: NoiseSettings
    groups: Mapping[str, Sequence[Brdf]] = field(default_factory=dict)
    references: dict[str, Picture] = field(default_factory=dict)
    found: dict[tuple[str, str], Convergence] = field(default_factory=dict)

    def mean(self, sampler: str, measure: str) -> Floats:
        """Mean error over the pictures at each count of samples."""
        values = [self.found[name, sampler].errors[measure] for name in self.references]
        return np.asarray(np.mean(values, axis=0))

    def seconds(self, sampler: str) -> Floats:
        """Mean seconds at each count of samples."""
        values = [self.found[name, sampler].seconds for name in self.references]
        return np.asarray(np.mean(values, axis=0))


def run_noise(
    describe: Describe,
    groups: Mapping[str, Sequence[Brdf]],
    samplers: Mapping[str, Callable[[Brdf], Sampler]],
    settings: NoiseSettings,
    cache: Cache,
    progress: Progress,
    *,
    fingerprints: Mapping[str, str] | None = None,
) -> NoiseStudy:
    """Render what is not in the cache.

    Parameters
    ----------
    describe
        The scene.
    groups
        The materials of each picture, by its name.
    samplers
        Functions that give a material its sampler, by name. References use its own.
    fingerprints
        By name of a sampler, what determines it besides the material and the code.
    """
    study = NoiseStudy(settings, groups)
    total, done = len(groups) * (len(samplers) + 1), 0

    def step(what: str) -> Progress:
        return lambda stage, part, whole, note: progress(
            "rendering", 100 * done + 100 * part // whole, 100 * total, what
        )

    for name, brdfs in groups.items():
        facts = [
            describe.__name__,
            [(brdf.source or {}).get("sha256") for brdf in brdfs],
            asdict(settings),
            code_digest(),
        ]
        key = cache_key("noise", [*facts, "reference"])
        kept = cache.find(key, ["picture"])
        if kept is None:
            kept = {"picture": reference(describe, brdfs, settings, step(f"{name}, reference"))}
            cache.keep(key, kept)
        truth = kept["picture"]
        study.references[name] = truth
        done += 1
        for sampler, make in samplers.items():
            other = (fingerprints or {}).get(sampler)
            key = cache_key("noise", [*facts, sampler, *([other] if other else [])])
            found = _find(cache, key, len(settings.counts))
            if found is None:
                sampled = [brdf.replaced(sampler=make(brdf)) for brdf in brdfs]
                found = converge(describe, sampled, truth, settings, step(f"{name}, {sampler}"))
                errors = {measure: np.asarray(v) for measure, v in found.errors.items()}
                cache.keep(key, {"picture": found.picture, "seconds": found.seconds, **errors})
            study.found[name, sampler] = found
            done += 1
    return study


def _find(cache: Cache, key: str, counts: int) -> Convergence | None:
    """The cached results; None if there are none or they are incomplete."""
    arrays = cache.find(key, ["picture", "seconds", *MEASURES])
    if arrays is None:
        return None
    picture, *figures = arrays.values()
    if any(len(values) != counts for values in figures):
        return None
    seconds, *errors = (values.tolist() for values in figures)
    return Convergence(seconds, dict(zip(MEASURES, errors, strict=True)), picture)
