"""Many materials by many methods: trials that are missing are made, the others found."""

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
"""Of files that hold a class of reflectance exactly."""
_PARTS = [f"{light} {part}" for light in LIGHTS for part in Picture.__annotations__]


@dataclass(frozen=True)
class Study:
    """Trials of materials by methods.

    Parameters
    ----------
    trials
        By material and method.
    skipped
        Why there is no trial, by material and method.
    materials
        Files by the names of the materials, in the order given.
    methods
        By name, in the order asked for.
    settings
        That all trials share.
    keys
        Under which trials are in the cache, by material and method.
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
        """Those of some methods that there are trials of."""
        return [method for method in methods if self.of(method)]

    def left_out(self) -> list[tuple[str, str, list[str]]]:
        """Method, reason and materials of what was skipped, one entry a method and reason."""
        found: dict[tuple[str, str], list[str]] = {}
        for (material, method), reason in sorted(self.skipped.items()):
            found.setdefault((method, reason), []).append(material)
        return [(*pair, materials) for pair, materials in found.items()]

    def mean_size(self, method: str) -> float:
        """Bytes that a method takes, mean of its trials, of which there is one at least."""
        return fmean(trial.size for trial in self.of(method))

    def pictures(self, material: str, method: str) -> dict[str, Picture]:
        """Pictures of a trial by the name of their light.

        Raises
        ------
        NacreError
            If they are gone from the cache since the run.
        """
        arrays = self._cache.find(self.keys[material, method], _PARTS)
        if arrays is None:
            raise NacreError(f"{self._cache.folder}: files are gone while they are read; run again")
        parts = Picture.__annotations__
        return {light: Picture(*(arrays[f"{light} {part}"] for part in parts)) for light in LIGHTS}

    def fitted(self, material: str, method: str) -> Brdf:
        """The representation of a trial; it is fitted again where it was not kept."""
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
    """Make every trial that is not in the cache.

    Parameters
    ----------
    files
        Materials that :func:`nacre.load` reads; each is in memory only while it is tried.
    methods
        By name; :data:`nacre_lab.reproduce.trial.TRUTH` must be one of them.
    jobs
        Materials at a time; one a core where None.

    Raises
    ------
    NacreError
        If a material cannot be read, or two have one name, or nothing could be tried. A method
        that has nothing for a material is skipped.
    """
    materials = {path.stem: path for path in files}
    if len(materials) < len(files):
        raise NacreError("two materials have the same file name without its ending; rename one")
    for module in ("skimage.metrics", "flip_evaluator"):
        require(module, "render")
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
            stopped.set()  # trials under way finish and are kept
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Study(trials, skipped, materials, methods, settings, keys, cache)


def _key(material: str, sha256: str, name: str, method: Method, settings: Settings) -> str:
    """Under what a trial is kept; the material's name counts: published networks go by it."""
    facts = {
        "material": [material, sha256],
        "method": name,
        "settings": dict(method.settings),
        "protocol": settings.facts,
        "code": code_digest(),
    }
    return cache_key("trial", facts)


def _find(cache: Cache, key: str) -> Trial | None:
    """A finished trial; None where there is none, or where its file is damaged."""
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
    """Keep a trial, last what says that it is finished; the material itself need not be kept."""
    classes = [c.__name__ for c in type(fitted).__mro__]
    ending = next((ending for name, ending in _ENDINGS.items() if name in classes), "")
    if ending and trial.method != TRUTH:
        cache.folder.mkdir(parents=True, exist_ok=True)
        save(fitted, cache.path(key, ending))
    arrays = {f"{n} {part}": a for n, p in pictures.items() for part, a in asdict(p).items()}
    cache.keep(key, {"trial": np.array(json.dumps(asdict(trial))), **arrays})
