"""Every sampler in every picture of a scene, kept from one run to the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf, Sampler
from nacre.io.files import atomic_path
from nacre.reproduce.cache import DAMAGED, code_digest, facts_digest
from nacre.reproduce.noise import (
    MEASURES,
    Convergence,
    Describe,
    NoiseSettings,
    Picture,
    converge,
    reference,
    resampled,
)
from nacre.runtime.progress import Progress

Samplers = Mapping[str, Callable[[Brdf], Sampler]]


@dataclass
class NoiseStudy:
    """What came of a scene.

    Parameters
    ----------
    settings
        Of the pictures.
    references
        Converged pictures, by what is shown in them.
    found
        By what is shown, and sampler.
    """

    settings: NoiseSettings
    references: dict[str, Picture] = field(default_factory=dict)
    found: dict[tuple[str, str], Convergence] = field(default_factory=dict)

    def mean(self, sampler: str, measure: str) -> Floats:
        """Mean error over the pictures at each count of samples."""
        values = [self.found[name, sampler].errors[measure] for name in self.references]
        return np.asarray(np.mean(values, axis=0))

    def seconds(self, sampler: str) -> Floats:
        """Mean seconds over the pictures at each count of samples."""
        values = [self.found[name, sampler].seconds for name in self.references]
        return np.asarray(np.mean(values, axis=0))


def run_noise(
    describe: Describe,
    groups: Mapping[str, Sequence[Brdf]],
    samplers: Samplers,
    settings: NoiseSettings,
    folder: Path,
    progress: Progress,
    *,
    marks: Mapping[str, str] | None = None,
    fresh: bool = False,
) -> NoiseStudy:
    """Render what is not in the folder yet.

    Parameters
    ----------
    describe
        The scene.
    groups
        The materials of each picture, by its name.
    samplers
        What gives a material its sampler, by name. References use the material's own.
    settings
        Of the pictures.
    folder
        Where finished pictures are kept; made if it is not there.
    progress
        Called as the work goes on.
    marks
        By the name of a sampler, what else than the material and the code decides it.
    fresh
        Whether to render again what is in the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
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
        path = _path(folder, [*facts, "reference"])
        kept = None if fresh else _arrays(path, "picture")
        if kept:
            (truth,) = kept
        else:
            truth = reference(describe, brdfs, settings, step(f"{name}, reference"))
            with atomic_path(path, internal=True) as temporary:
                np.savez_compressed(temporary, picture=truth)
        study.references[name] = truth
        done += 1
        for sampler, make in samplers.items():
            mark = (marks or {}).get(sampler)
            path = _path(folder, [*facts, sampler, *([mark] if mark else [])])
            found = None if fresh else _read(path, len(settings.counts))
            if found is None:
                sampled = [resampled(brdf, make(brdf)) for brdf in brdfs]
                found = converge(describe, sampled, truth, settings, step(f"{name}, {sampler}"))
                _write(path, found)
            study.found[name, sampler] = found
            done += 1
    return study


def _path(folder: Path, facts: Sequence[object]) -> Path:
    return folder / f"noise-{facts_digest(facts)}.npz"


def _arrays(path: Path, *names: str) -> list[Any] | None:
    """Arrays that were kept; None where there is no file, or a damaged one."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return [arrays[name] for name in names]
    except DAMAGED:
        return None


def _read(path: Path, counts: int) -> Convergence | None:
    """What was kept; None where there is nothing whole."""
    arrays = _arrays(path, "picture", "seconds", *MEASURES)
    if arrays is None:
        return None
    picture, *figures = arrays
    if any(len(values) != counts for values in figures):
        return None
    seconds, *errors = (values.tolist() for values in figures)
    return Convergence(seconds, dict(zip(MEASURES, errors, strict=True)), picture)


def _write(path: Path, found: Convergence) -> None:
    arrays: dict[str, Any] = {name: np.asarray(v) for name, v in found.errors.items()}
    with atomic_path(path, internal=True) as temporary:
        np.savez_compressed(
            temporary, picture=found.picture, seconds=np.asarray(found.seconds), **arrays
        )
