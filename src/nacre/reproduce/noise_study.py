"""Every sampler in every picture of a scene, kept from one run to the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.reproduce.cache import Cache, cache_key, code_digest
from nacre.reproduce.noise import (
    MEASURES,
    Convergence,
    Describe,
    NoiseSettings,
    Picture,
    converge,
    reference,
)
from nacre.runtime.progress import Progress


@dataclass
class NoiseStudy:
    """What came of a scene: converged pictures by what they show, and others by sampler, too."""

    settings: NoiseSettings
    references: dict[str, Picture] = field(default_factory=dict)
    found: dict[tuple[str, str], Convergence] = field(default_factory=dict)

    def mean(self, sampler: str, measure: str) -> Floats:
        """Mean error over the pictures at each count of samples."""
        values = [self.found[name, sampler].errors[measure] for name in self.references]
        return np.asarray(np.mean(values, axis=0))

    def seconds(self, sampler: str) -> Floats:
        """The same of seconds."""
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
    """Render what is not in the cache yet.

    Parameters
    ----------
    describe
        The scene.
    groups
        The materials of each picture, by its name.
    samplers
        What gives a material its sampler, by name. References use the material's own.
    fingerprints
        By the name of a sampler, what else than the material and the code decides it.
    """
    study = NoiseStudy(settings)
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
    """What was kept; None where there is nothing whole."""
    arrays = cache.find(key, ["picture", "seconds", *MEASURES])
    if arrays is None:
        return None
    picture, *figures = arrays.values()
    if any(len(values) != counts for values in figures):
        return None
    seconds, *errors = (values.tolist() for values in figures)
    return Convergence(seconds, dict(zip(MEASURES, errors, strict=True)), picture)
