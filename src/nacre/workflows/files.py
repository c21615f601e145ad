"""Fits of single files of materials, each into its own file."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import nacre
from nacre.errors import FormatError, NacreError, printable
from nacre.io.files import PathLike, atomic_path, check_writable
from nacre.io.names import stem
from nacre.runtime.parallel import core_count
from nacre.workflows.executor import Executor, Job
from nacre.workflows.fitting import Fitting, NetworkFitting
from nacre.workflows.manifest import Record
from nacre.workflows.material import Fit, explain
from nacre.workflows.stacks import usual_executor
from nacre.workflows.watcher import Watcher, begun


@dataclass(frozen=True)
class FittedFile:
    """A measured file and its fit; the output was not written if the fit failed."""

    source: Path
    output: Path
    fit: Fit


def output_paths(
    paths: Sequence[PathLike],
    output: str | os.PathLike[str] | None,
    ending: str,
    *,
    make_folder: bool = True,
) -> list[Path]:
    """The file for the fit of each measured file.

    Parameters
    ----------
    paths
        Measured files.
    output
        A file, for a single path; a folder, which is made unless `make_folder` is false; or None
        for the current folder. A name means a folder if it ends in a slash, is a folder already, or
        is for several files.
    ending
        Ending of files in a folder, with the dot.

    Raises
    ------
    FormatError
        If the output does not suit the number of files, or two would have the same name.
    """
    sources = [Path(path) for path in paths]
    folder = Path(output or ".")
    slashed = output is not None and os.fspath(output).endswith(("/", os.sep))
    if output is not None and not folder.is_dir() and not slashed:
        if len(sources) > 1 and folder.suffix:
            raise FormatError(f"{output}: must be a folder for several files; end it in a slash")
        if len(sources) == 1 and folder.suffix:
            return [folder]
        if len(sources) == 1:
            raise FormatError(
                f"{output}: has no ending; write {output}{ending} for a file or {output}/ for a "
                "folder"
            )
    if make_folder:
        folder.mkdir(parents=True, exist_ok=True)
    targets = [folder / f"{stem(path)}{ending}" for path in sources]
    if len(set(targets)) < len(targets):
        raise FormatError("two fits would have the same name; write them to two folders")
    return targets


def fit_files(
    paths: Sequence[PathLike],
    outputs: Sequence[PathLike],
    fitting: Fitting | None = None,
    *,
    executor: Executor | None = None,
    watcher: Watcher | None = None,
) -> list[FittedFile]:
    """Fit files, each into its own file; a failure affects only its own file.

    Parameters
    ----------
    paths
        Measured files.
    outputs
        The file to write for each; see :func:`output_paths`.
    fitting, executor, watcher
        See :func:`nacre.workflows.fit_library`.

    Returns
    -------
    list of FittedFile
        In the order of `paths`.

    Raises
    ------
    NacreError
        If nothing can be fitted in this way.
    """
    fitting = fitting or NetworkFitting()
    pairs = [(Path(path), Path(output)) for path, output in zip(paths, outputs, strict=True)]
    taken = {path.resolve() for path, _ in pairs}
    found: dict[Path, Fit] = {}
    for path, output in pairs:
        try:
            if output.resolve() in taken:
                raise FormatError(f"{output}: is the input as well; name another output")
            check_writable(output)
        except (OSError, NacreError) as error:
            found[output] = Fit(error=explain(error, path))

    watcher = watcher or Watcher()
    watcher.begin(len(pairs) - len(found))

    def jobs() -> Iterator[Job]:
        same = fitting.digest, nacre.__version__
        for path, output in pairs:
            if output not in found:
                record = Record(str(path), None, None, None, *same, str(output))
                yield Job(path, record, begun(watcher, printable(path.name)))

    usual = usual_executor(fitting, min(core_count(), len(pairs)))
    with (
        (executor or usual).open(fitting, watcher) as stream,
        contextlib.closing(stream(jobs())) as results,
    ):
        for job, fit in results:
            output = Path(job.record.output)
            found[output] = _written(job.path, output, fit)
            watcher.end(printable(job.path.name), found[output].error)
    return [FittedFile(path, output, found[output]) for path, output in pairs]


def _written(source: Path, output: Path, fit: Fit) -> Fit:
    """Write the content of a fit, and return the fit without it."""
    error = fit.error
    if error is None:
        try:
            with atomic_path(output) as temporary:
                temporary.write_bytes(fit.content)
        except (OSError, NacreError) as problem:
            error = explain(problem, source)
    return replace(fit, content=b"", error=error)
