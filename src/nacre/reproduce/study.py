"""Many materials by many methods: trials that are missing are made, the others found."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.reproduce.cache import Cache, key
from nacre.reproduce.methods import TRUTH, Method
from nacre.reproduce.trial import Picture, Reference, Settings, Trial, attempt
from nacre.runtime.parallel import core_count, one_blas_thread
from nacre.runtime.progress import Progress, silent


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
        found = (self.trials.get((material, method)) for material in self.materials)
        return [trial for trial in found if trial is not None]

    def left_out(self) -> list[tuple[str, str, list[str]]]:
        """Method, reason and materials of what was skipped, one entry a method and reason."""
        found: dict[tuple[str, str], list[str]] = {}
        for (material, method), reason in sorted(self.skipped.items()):
            found.setdefault((method, reason), []).append(material)
        return [(*pair, materials) for pair, materials in found.items()]

    def mean_size(self, method: str) -> float:
        """Bytes that a method takes, mean of its trials, of which there is one at least."""
        trials = self.of(method)
        return sum(trial.size for trial in trials) / len(trials)

    def pictures(self, material: str, method: str) -> dict[str, Picture]:
        """Pictures of a trial by the name of their light."""
        return self._cache.pictures(self.keys[material, method])

    def fitted(self, material: str, method: str) -> Brdf:
        """The representation of a trial; it is fitted again where it was not kept."""
        if method == TRUTH:
            return load_brdf(self.materials[material])
        kept = self._cache.fitted(self.keys[material, method])
        return kept or self.methods[method].fit(load_brdf(self.materials[material]))


def run(
    files: Sequence[Path],
    methods: Mapping[str, Method],
    settings: Settings,
    cache: Cache,
    *,
    jobs: int | None = None,
    fresh: bool = False,
    progress: Progress | None = None,
) -> Study:
    """Make every trial that is not in the cache.

    Parameters
    ----------
    files
        Materials that :func:`nacre.load` reads; each is in memory only while it is tried.
    methods
        By name; :data:`nacre.reproduce.methods.TRUTH` must be one of them.
    settings
        Of the trials.
    cache
        Where trials are kept.
    jobs
        Materials at a time; one a core where None.
    fresh
        Whether trials that are in the cache are made again.
    progress
        Called as trials are finished.

    Raises
    ------
    NacreError
        If a material cannot be read, or two have one name, or nothing could be tried. A method
        that has nothing for a material is skipped.
    MissingExtraError
        If scikit-image or flip-evaluator is not installed.
    """
    materials = {path.stem: path for path in files}
    if len(materials) < len(files):
        raise NacreError("two materials have the same file name without its ending; rename one")
    for module in ("skimage.metrics", "flip_evaluator"):
        require(module, "render")
    report = progress or silent
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
            where = key(name, sha256, method_name, method, settings)
            trial = None if fresh else cache.find(where)
            problem = ""
            if trial is None:
                reference = reference or Reference(name, load_brdf(path), settings)
                try:
                    trial, pictures, fitted = attempt(reference, method_name, method)
                except NacreError as error:
                    problem = str(error)
                else:
                    cache.keep(where, trial, pictures, fitted)
            with lock:
                keys[pair] = where
                if trial is None:
                    skipped[pair] = problem
                else:
                    trials[pair] = trial
                report("trials", len(trials) + len(skipped), total, ", ".join(pair))

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
