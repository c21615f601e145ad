"""Trials of many materials with many methods; those in the cache are not repeated."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.formats import load_brdf, save
from nacre.io.files import digest
from nacre.runtime.parallel import core_count, one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre_lab.reproduce.cache import Cache, cache_key, code_digest
from nacre_lab.reproduce.trial import (
    FIGURES,
    LIGHTS,
    TRUTH,
    Method,
    Picture,
    Reference,
    Settings,
    Trial,
    attempt,
)

_ENDINGS = {"NeuralBrdf": ".safetensors", "AnalyticBrdf": ".json", "RglBrdf": ".bsdf"}
"""Endings of files that hold a class of reflectance exactly."""
_PARTS = [f"{light} {part}" for light in LIGHTS for part in Picture.__annotations__]


@dataclass(frozen=True)
class Study:
    """Trials of materials with methods.

    Parameters
    ----------
    trials
        By material and method.
    skipped
        Why a trial was skipped, by material and method.
    materials
        Files by names of materials, in the given order.
    methods
        Methods by name, in the requested order.
    settings
        Settings shared by all trials.
    keys
        Keys of the trials in the cache, by material and method.
    """

    trials: Mapping[tuple[str, str], Trial]
    skipped: Mapping[tuple[str, str], str]
    materials: Mapping[str, Path]
    methods: Mapping[str, Method]
    settings: Settings
    keys: Mapping[tuple[str, str], str]
    _cache: Cache

    def of(self, method: str) -> list[Trial]:
        """Trials of one method in the order of the materials."""
        return [self.trials[m, method] for m in self.materials if (m, method) in self.trials]

    def tried(self, methods: Iterable[str]) -> list[str]:
        """Those of some methods that have trials."""
        return [method for method in methods if self.of(method)]

    def left_out(self) -> list[tuple[str, str, list[str]]]:
        """Method, reason and materials of skipped trials, one entry per method and reason."""
        found: dict[tuple[str, str], list[str]] = {}
        for (material, method), reason in sorted(self.skipped.items()):
            found.setdefault((method, reason), []).append(material)
        return [(*pair, materials) for pair, materials in found.items()]

    def mean_size(self, method: str) -> float:
        """Mean bytes of a method over its trials, of which there is at least one."""
        return fmean(trial.size for trial in self.of(method))

    def pictures(self, material: str, method: str) -> dict[str, Picture]:
        """Pictures of a trial by name of the light.

        Raises
        ------
        NacreError
            If they have vanished from the cache since the run.
        """
        arrays = self._cache.find(self.keys[material, method], _PARTS)
        if arrays is None:
            raise NacreError(f"{self._cache.folder}: files vanished while being read; run again")
        parts = Picture.__annotations__
        return {light: Picture(*(arrays[f"{light} {part}"] for part in parts)) for light in LIGHTS}

    def fitted(self, material: str, method: str) -> Brdf:
        """The representation of a trial, fitted again if it is not in the cache."""
        if method != TRUTH:
            for ending in _ENDINGS.values():
                path = self._cache.path(self.keys[material, method], ending)
                if path.is_file():
                    try:
                        return load_brdf(path)
                    except NacreError:
                        break  # damaged
        brdf = load_brdf(self.materials[material])
        return brdf if method == TRUTH else self.methods[method].fit(brdf)


def run(
    files: Sequence[Path],
    methods: Mapping[str, Method],
    settings: Settings,
    cache: Cache,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Study:
    """Run every trial that is not in the cache.

    Parameters
    ----------
    files
        Materials for :func:`nacre.load`; each is in memory only during its trials.
    methods
        By name; :data:`nacre_lab.reproduce.trial.TRUTH` must be one of them.
    jobs
        Number of materials at the same time; one per core if None.

    Raises
    ------
    NacreError
        If a material cannot be read, two have the same name, or nothing could be tried. A method
        that cannot represent a material is skipped.
    """
    materials = {path.stem: path for path in files}
    if len(materials) < len(files):
        raise NacreError("two materials have the same file name without its ending; rename one")
    require("skimage.metrics", "render")
    total, lock, stopped = len(materials) * len(methods), threading.Lock(), threading.Event()
    trials: dict[tuple[str, str], Trial] = {}
    skipped: dict[tuple[str, str], str] = {}
    keys: dict[tuple[str, str], str] = {}

    def try_all(name: str, path: Path) -> None:
        sha256 = digest(path)
        reference: Reference | None = None
        for method_name, method in methods.items():
            if stopped.is_set():
                return
            pair = name, method_name
            where = _key(name, sha256, method_name, method, settings)
            trial = _find(cache, where)
            problem = ""
            if trial is None:
                reference = reference or Reference(name, load_brdf(path), settings)
                try:
                    trial, pictures, fitted = attempt(reference, method_name, method)
                except NacreError as error:
                    problem = str(error)
                else:
                    _keep(cache, where, trial, pictures, fitted)
            with lock:
                keys[pair] = where
                if trial is None:
                    skipped[pair] = problem
                else:
                    trials[pair] = trial
                progress("trials", len(trials) + len(skipped), total, ", ".join(pair))

    with one_blas_thread(), ThreadPoolExecutor(jobs or core_count()) as pool:
        futures = [pool.submit(try_all, *item) for item in materials.items()]
        try:
            for future in as_completed(futures):
                future.result()
        except BaseException:
            stopped.set()  # trials under way finish and are cached
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Study(trials, skipped, materials, methods, settings, keys, cache)


def _key(material: str, sha256: str, name: str, method: Method, settings: Settings) -> str:
    """Key of a trial; the material's name counts, since published networks are found by it."""
    facts = {
        "material": [material, sha256],
        "method": name,
        "settings": dict(method.settings),
        "protocol": settings.facts,
        "code": code_digest(),
    }
    return cache_key("trial", facts)


def _find(cache: Cache, key: str) -> Trial | None:
    """A finished trial; None if there is none, or its file is damaged."""
    arrays = cache.find(key, ["trial", *_PARTS])
    if arrays is None:
        return None
    try:
        trial = Trial(**json.loads(str(arrays["trial"])))
        return trial if set(trial.figures) == set(FIGURES) else None
    except (ValueError, TypeError, RecursionError):
        return None


def _keep(
    cache: Cache, key: str, trial: Trial, pictures: Mapping[str, Picture], fitted: Brdf
) -> None:
    """Store a trial, last the mark that it is finished; the material itself is not stored."""
    classes = [c.__name__ for c in type(fitted).__mro__]
    ending = next((ending for name, ending in _ENDINGS.items() if name in classes), "")
    if ending and trial.method != TRUTH:
        cache.folder.mkdir(parents=True, exist_ok=True)
        save(fitted, cache.path(key, ending))
    arrays = {f"{n} {part}": a for n, p in pictures.items() for part, a in asdict(p).items()}
    cache.keep(key, {"trial": np.array(json.dumps(asdict(trial))), **arrays})
