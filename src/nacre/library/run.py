"""Every measured file of a folder, fitted: what is up to date stays, what fails is told apart."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import nacre
from nacre.files import FormatError, NacreError, PathLike, abandoned, digest, printable, reason
from nacre.formats import load, save
from nacre.library.fitting import Fitting, NetworkFitting
from nacre.library.manifest import Manifest, Record
from nacre.library.sources import Source, find_sources, output_names
from nacre.lock import exclusive
from nacre.parallel import core_count, one_blas_thread
from nacre.progress import Progress

LOCK = ".library.lock"
"""Name of the file, in the folder of the fits, that keeps a second run out."""

UNFINISHED = "the run ended before this was finished"
"""Error of a material while it is being fitted."""


class Watcher:
    """Hears how a run goes on, from several threads at once. This one does nothing."""

    def begin(self, materials: int) -> None:
        """So many will be fitted."""

    def start(self, name: str) -> Progress:
        """A material is begun; what is returned is called as its fit goes on."""
        return lambda stage, done, total, note: None

    def end(self, name: str, error: str | None) -> None:
        """A material is done, or has failed for a reason."""


@dataclass(frozen=True)
class Outcome:
    """What came of a run.

    Parameters
    ----------
    fitted
        Materials that were fitted.
    unchanged
        Those whose fit was up to date.
    failed
        Those that could not be fitted; their `error` says why.
    """

    fitted: tuple[Record, ...]
    unchanged: tuple[Record, ...]
    failed: tuple[Record, ...]


class _Stopped(BaseException):
    """Ends a fit that nobody waits for any more; no error of the material."""


def fit_library(
    paths: Sequence[PathLike],
    output: PathLike,
    fitting: Fitting | None = None,
    *,
    jobs: int | None = None,
    watcher: Watcher | None = None,
) -> Outcome:
    """Fit every measured file in folders, into a folder with a manifest.

    A material is fitted if the manifest has no fit of it, if its file, the settings or nacre's
    version changed since, or if the fitted file is missing or is not what was written. Whatever
    goes wrong with a material, a full disk too, costs only that material. At most `jobs` of them
    are in memory at a time.

    Parameters
    ----------
    paths
        Folders, and files if you like; see :func:`nacre.library.find_sources`.
    output
        Folder of the fits, made if it is not there; see :func:`nacre.library.output_names`.
    fitting
        What to fit; networks by the recommended recipe where None.
    jobs
        Materials at a time; one a core where None.
    watcher
        Hears how the run goes on.

    Raises
    ------
    NacreError
        If there is nothing to fit, two sources would have the same fit, another run works on
        `output`, or that is no folder that can be written.
    MissingExtraError
        If the fitting needs a library that is not installed.
    KeyboardInterrupt
        If interrupted; what was finished stays, and the next run goes on.
    """
    output, fitting = Path(output), fitting or NetworkFitting()
    sources = find_sources(paths, output)
    if not sources:
        where = ", ".join(map(str, paths))
        raise NacreError(f"{where}: no measured materials found")
    names = output_names(sources, fitting.ending)
    taken = {source.path.resolve() for source in sources}
    for name in names:
        if (output / name).resolve() in taken:
            raise FormatError(f"{output / name}: is an input as well; name another output")
    fitting.check()
    with contextlib.ExitStack() as stack:
        try:
            output.mkdir(parents=True, exist_ok=True)
            stack.enter_context(exclusive(output / LOCK, wait=False))
        except BlockingIOError as error:
            raise NacreError(f"{output}: another run is fitting into this folder") from error
        except OSError as error:
            raise FormatError(f"{output}: cannot be written: {error.strerror}") from error
        manifest = Manifest(output)
        leftovers = _leftovers(output, names)
        try:
            run = _Run(output, fitting, manifest, watcher or Watcher())
            return run(sources, names, jobs or core_count())
        finally:
            manifest.tidy(set(names))
            for path in leftovers:
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)


def _leftovers(output: Path, names: Sequence[str]) -> list[Path]:
    """Temporary files of runs that were killed.

    They are found when a run begins and removed when it ends: one of another command that is
    writing just now has its own name by then.
    """
    folders = {output, *((output / name).parent for name in names)}
    return [path for folder in folders if folder.is_dir() for path in abandoned(folder)]


class _Run:
    """The work on one folder."""

    def __init__(
        self, output: Path, fitting: Fitting, manifest: Manifest, watcher: Watcher
    ) -> None:
        self._output, self._fitting, self._watcher = output, fitting, watcher
        self._manifest = manifest
        self._settings = fitting.digest
        self._stopped = threading.Event()

    def __call__(self, sources: Sequence[Source], names: Sequence[str], jobs: int) -> Outcome:
        with one_blas_thread(), ThreadPoolExecutor(min(jobs, len(sources))) as pool:
            try:
                current = list(pool.map(self._current, sources, names))
                triples = zip(sources, names, current, strict=True)
                work = [(source, name) for source, name, record in triples if record is None]
                work.sort(key=lambda pair: self._failed_before(pair[1]))
                self._watcher.begin(len(work))
                records = list(pool.map(lambda pair: self._fit(*pair), work))
            except BaseException:  # an interrupt, which must not wait for what has not begun
                self._stopped.set()
                pool.shutdown(cancel_futures=True)
                raise
        return Outcome(
            tuple(record for record in records if record.error is None),
            tuple(record for record in current if record is not None),
            tuple(record for record in records if record.error is not None),
        )

    def _current(self, source: Source, name: str) -> Record | None:
        """The record of a fit that is up to date; None where a material is to be fitted."""
        if self._stopped.is_set():
            raise _Stopped
        record = self._manifest.find(name)
        expected = (str(source.relative), self._settings, nacre.__version__, None)
        if record is None:
            return None
        if (record.source, record.settings, record.nacre, record.error) != expected:
            return None
        with contextlib.suppress(OSError, FormatError):
            if digest(self._output / name) != record.output_sha256:
                return None
            status = source.path.stat()
            if (status.st_size, status.st_mtime_ns) == (record.size, record.modified):
                return record
            if status.st_size == record.size and digest(source.path) == record.sha256:
                record = replace(record, modified=status.st_mtime_ns)
                with contextlib.suppress(FormatError):  # then it is hashed again next time
                    self._manifest.keep(record)
                return record
        return None

    def _failed_before(self, name: str) -> bool:
        """Whether a material may fail again, or end the process: it had better come last."""
        record = self._manifest.find(name)
        return record is not None and record.error is not None

    def _fit(self, source: Source, name: str) -> Record:
        """Fit one material, and keep what came of it."""
        shown = printable(str(source.relative))
        progress = self._watcher.start(shown)
        record = Record(
            str(source.relative), None, None, None, self._settings, nacre.__version__, name
        )
        with contextlib.suppress(FormatError):  # it only serves the next run
            self._manifest.keep(replace(record, error=UNFINISHED))
        try:
            # Before it is read: a change while it is read shows in the next run.
            status = source.path.stat()
            record = replace(record, size=status.st_size, modified=status.st_mtime_ns)
            record = replace(record, **self._fitted(source, self._output / name, progress))
            self._manifest.keep(record)
        except Exception as error:
            # As text: the error holds the frames that it went through, and they hold the material.
            record = self._failed(record, source, error)
        self._watcher.end(shown, record.error)
        return record

    def _fitted(self, source: Source, path: Path, progress: Progress) -> dict[str, Any]:
        """Fit, and write the file; what a record says of that."""

        def report(stage: str, done: int, total: int, note: str) -> None:
            if self._stopped.is_set():
                raise _Stopped
            progress(stage, done, total, note)

        report("reading", 0, 1, "")
        brdf = load(source.path)
        start = time.perf_counter()
        fitted = self._fitting.fit(brdf, report)
        seconds = time.perf_counter() - start
        path.parent.mkdir(parents=True, exist_ok=True)
        save(fitted, path)
        return {
            "sha256": (brdf.source or {}).get("sha256"),
            "output_sha256": digest(path),
            "losses": self._fitting.losses(fitted),
            "seconds": round(seconds, 3),
        }

    def _failed(self, record: Record, source: Source, error: Exception) -> Record:
        if isinstance(error, NacreError):
            text = str(error).removeprefix(f"{printable(str(source.path))}: ")
        elif isinstance(error, MemoryError):
            text = "out of memory"
        elif isinstance(error, OSError):
            where = f"{os.fspath(error.filename)}: " if error.filename else ""
            text = f"{where}{error.strerror or error}"
        else:
            text = f"{type(error).__name__}: {reason(error)}"
        record = replace(record, error=printable(text))
        with contextlib.suppress(FormatError):  # a material without a record is fitted next time
            self._manifest.keep(record)
        return record
