"""Fits of every measured file in folders that is not up to date."""

from __future__ import annotations

import contextlib
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import nacre
from nacre.errors import FormatError, NacreError, printable
from nacre.formats import is_btf
from nacre.io.files import PathLike, abandoned, atomic_path, check_not_inputs, digest
from nacre.io.outputs import check_replaceable, overwrite
from nacre.runtime.lock import exclusive
from nacre.runtime.parallel import thread_map
from nacre.workflows.executor import Executor, Job, Stream
from nacre.workflows.fitting import Fitting, NetworkFitting
from nacre.workflows.manifest import Manifest, Record
from nacre.workflows.material import Fit, explain
from nacre.workflows.sources import Source, find_sources, output_names
from nacre.workflows.stacks import usual_executor
from nacre.workflows.watcher import Watcher, begun

LOCK = ".library.lock"
"""File in the folder of the fits that keeps a second run out."""

UNFINISHED = "the run ended before this was finished"
"""Error of a material while it is being fitted."""


@dataclass(frozen=True)
class Outcome:
    """The result of a run, by material."""

    fitted: tuple[Record, ...]
    unchanged: tuple[Record, ...]  # the fit was up to date
    failed: tuple[Record, ...]  # their `error` says why
    left_out: tuple[Path, ...] = ()  # files with the ending of a measurement that are not one


def fit_library(
    paths: Sequence[PathLike],
    output: PathLike,
    fitting: Fitting | None = None,
    *,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> Outcome:
    """Fit every measured file in folders, into a folder with a manifest.

    A material is fitted if the manifest has no fit of it, if its file, the settings or the code
    that determines its fit have changed, or if the fitted file is missing or altered. A failure,
    even from a full disk, affects only its own material.

    Parameters
    ----------
    paths
        Folders, and files if you like; see :func:`nacre.workflows.find_sources`.
    output
        Folder for the fits, made if necessary; see :func:`nacre.workflows.output_names`.
    fitting
        What to fit; networks with the recommended recipe if None.
    executor
        What carries out the fits; if None, one thread per core, or a stack on the device that
        `fitting` names.
    watcher
        Told about the progress.

    Raises
    ------
    NacreError
        If there is nothing to fit, two sources would have the same fit, another run works on
        `output`, it is not a writable folder, or the executor does not work.
    MissingExtraError
        If the fitting or the executor needs a library that is not installed.
    KeyboardInterrupt
        If interrupted; finished fits stay, and the next run continues.
    """
    output, fitting = Path(output), fitting or NetworkFitting()
    left_out: list[Path] = []
    sources, names = _sources(paths, output, fitting, left_out)
    watcher = watcher or Watcher()
    with contextlib.ExitStack() as stack:
        stream = stack.enter_context((executor or usual_executor(fitting)).open(fitting, watcher))
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
            outcome = _Run(output, fitting, manifest, watcher)(sources, names, stream)
            return replace(outcome, left_out=tuple(left_out))
        finally:
            manifest.tidy(set(names))
            for path in leftovers:
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)


def stale_fits(
    paths: Sequence[PathLike], output: PathLike, fitting: Fitting
) -> tuple[list[tuple[Source, str]], int]:
    """What :func:`fit_library` would fit, with names in the folder, and how many fits are up to
    date; raises NacreError as it does, and writes nothing.
    """
    output = Path(output)
    pairs = list(zip(*_sources(paths, output, fitting, []), strict=True))
    run = _Run(output, fitting, Manifest(output), Watcher())
    stale = [pair for pair in pairs if run.current(*pair, keep=False) is None]
    return stale, len(pairs) - len(stale)


def _sources(
    paths: Sequence[PathLike], output: Path, fitting: Fitting, left_out: list[Path]
) -> tuple[list[Source], list[str]]:
    """The sources of a library, and the names of their fits."""
    sources = find_sources(paths, output, left_out.append)
    if not sources:
        where = ", ".join(map(str, paths))
        factored = (file for path in paths for file in Path(path).glob("*.btf"))
        textures = any(is_btf(path) for path in (*paths, *left_out, *factored))
        advice = ", only textures (BTFs); fit these one at a time" if textures else ""
        raise NacreError(f"{where}: no measured materials found{advice}")
    names = output_names(sources, fitting.ending)
    check_not_inputs((output / name for name in names), (source.path for source in sources))
    return sources, names


def _leftovers(output: Path, names: Sequence[str]) -> list[Path]:
    """Temporary files from killed runs.

    They are found when a run begins and removed when it ends: by then, a file that another command
    was just writing has its final name.
    """
    folders = {output, *((output / name).parent for name in names)}
    return [path for folder in folders if folder.is_dir() for path in abandoned(folder)]


class _Run:
    """The work on one folder of fits."""

    def __init__(
        self, output: Path, fitting: Fitting, manifest: Manifest, watcher: Watcher
    ) -> None:
        self._output, self._manifest, self._watcher = output, manifest, watcher
        self._fitting, self._settings = fitting, fitting.digest
        self._records: dict[str, Record] = {}
        self._before = {record.output: record for record in manifest.records()}

    def __call__(self, sources: Sequence[Source], names: Sequence[str], stream: Stream) -> Outcome:
        pairs = list(zip(sources, names, strict=True))
        current = list(thread_map(lambda pair: self.current(*pair), pairs))
        work = [pair for pair, record in zip(pairs, current, strict=True) if record is None]
        failed = {name for name, record in self._before.items() if record.error is not None}
        work.sort(key=lambda pair: pair[1] in failed)  # it may fail again, or end the process
        self._watcher.begin(len(work))
        with contextlib.closing(stream(self._begun(work))) as results:
            for job, fit in results:
                self._finish(job.record, job.path, fit)
        records = [self._records[name] for _, name in work]
        return Outcome(
            tuple(record for record in records if record.error is None),
            tuple(record for record in current if record is not None),
            tuple(record for record in records if record.error is not None),
        )

    def current(self, source: Source, name: str, *, keep: bool = True) -> Record | None:
        """The record of a fit that is up to date; None if the material must be fitted.

        If `keep`, the manifest keeps the time of a source that was touched.
        """
        record = self._manifest.find(name)
        expected = str(source.relative), self._settings, None
        if not record or expected != (record.source, record.settings, record.error):
            return None
        if record.code is None or record.code != self._fitting.code(source.path):
            return None
        with contextlib.suppress(OSError, FormatError):
            if digest(self._output / name) != record.output_sha256:
                return None
            status = source.path.stat()
            if (status.st_size, status.st_mtime_ns) == (record.size, record.modified):
                return record
            if status.st_size == record.size and digest(source.path) == record.sha256:
                record = replace(record, modified=status.st_mtime_ns)
                if keep:
                    with contextlib.suppress(FormatError):  # then it is hashed again next time
                        self._manifest.keep(record)
                return record
        return None

    def _begun(self, work: Sequence[tuple[Source, str]]) -> Iterator[Job]:
        """The jobs, each marked in the manifest as it begins."""
        for source, name in work:
            relative = str(source.relative)
            record = Record(relative, None, None, None, self._settings, nacre.__version__, name)
            with contextlib.suppress(FormatError):  # it only serves the next run
                self._manifest.keep(replace(record, error=UNFINISHED))
            try:
                # Before reading: the next run notices a change made during it.
                status = source.path.stat()
                record = replace(record, size=status.st_size, modified=status.st_mtime_ns)
                record = replace(record, code=self._fitting.code(source.path))
                with overwrite(self._is_own(self._output / name)):
                    check_replaceable(self._output / name)
            except (OSError, FormatError) as error:
                self._finish(record, source.path, Fit(error=explain(error, source.path)))
                continue
            yield Job(source.path, record, begun(self._watcher, printable(relative)))

    def _is_own(self, path: Path) -> bool:
        """Whether the manifest lists a file as a fit of this library, whole or damaged."""
        record = self._before.get(path.relative_to(self._output).as_posix())
        if record is None or record.output_sha256 is None:
            return False
        with contextlib.suppress(OSError):
            mode = path.lstat().st_mode
            return stat.S_ISREG(mode) and bool(mode & 0o222)
        return False

    def _finish(self, record: Record, source: Path, fit: Fit) -> None:
        """Write the fit of a material, and keep a record of it."""
        result = replace(record, error=fit.error)
        if fit.error is None:
            try:
                path = self._output / record.output
                path.parent.mkdir(parents=True, exist_ok=True)
                with overwrite(self._is_own(path)), atomic_path(path) as temporary:
                    temporary.write_bytes(fit.content)
                result = replace(
                    record,
                    sha256=fit.sha256,
                    output_sha256=digest(path),
                    losses=dict(fit.losses),
                    seconds=fit.seconds,
                )
                self._manifest.keep(result)
            except (OSError, NacreError) as error:
                result = replace(record, error=explain(error, source))
        if result.error is not None:
            with contextlib.suppress(FormatError):  # without a record it is fitted next time
                self._manifest.keep(result)
        self._records[record.output] = result
        self._watcher.end(printable(record.source), result.error)
