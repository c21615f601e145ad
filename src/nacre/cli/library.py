"""`nacre fit` of folders: one display for the whole run, and what came of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Group
from rich.live import Live
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from nacre.cli.console import StageCallback, console, stage_columns, status
from nacre.errors import printable
from nacre.formats import formats
from nacre.runtime.progress import Progress as Report
from nacre.workflows import Cluster, Executor, Fitting, Stacks, Threads, Watcher, fit_library
from nacre.workflows.cluster import LOCAL
from nacre.workflows.submission import Data


def executor(scheduler: str | None, data: Data, jobs: int | None, device: str | None) -> Executor:
    """What carries out fits, by what the user says.

    Raises
    ------
    BadParameter
        If `scheduler` is no address, or an option does not go with it.
    """
    if scheduler is None:
        if data != "auto":
            raise click.BadParameter("--data is for a cluster; name its --scheduler")
        # On a device materials train together, unless they are asked to come so many at a time.
        return Threads(jobs) if jobs or device is None else Stacks()
    if scheduler != LOCAL and "://" not in scheduler:
        raise click.BadParameter(f"{scheduler!r} is neither {LOCAL} nor like tcp://host:8786")
    if scheduler != LOCAL and jobs:
        raise click.BadParameter("--jobs is for this machine; a cluster runs one fit a thread")
    return Cluster(scheduler, data=data, workers=jobs)


def fit_folders(
    paths: Sequence[Path], output: Path | None, fitting: Fitting, executor: Executor
) -> None:
    """Fit all that is in folders; exit with 1 if something failed.

    Raises
    ------
    BadParameter
        If the output is named like a file.
    NacreError
        As :func:`nacre.workflows.fit_library` has it.
    """
    endings = {ending for entry in formats() for ending in entry.extensions}
    if output and output.suffix.lower() in endings and not output.is_dir():
        raise click.BadParameter(f"{output} must be a folder, as what is fitted to a folder")
    output = output or Path()
    with LibraryDisplay() as display:
        outcome = fit_library(paths, output, fitting, executor=executor, watcher=display)
    counts = {
        "fitted": outcome.fitted,
        "unchanged": outcome.unchanged,
        "failed": outcome.failed,
    }
    line = ", ".join(f"{len(records)} {word}" for word, records in counts.items() if records)
    console.print(printable(f"{output}: {line}"), markup=False)
    if outcome.left_out:
        click.echo(f"nacre: left out, not measurements: {_some(outcome.left_out)}", err=True)
    for record in outcome.failed:
        click.echo(f"nacre: {printable(record.source)}: {record.error}", err=True)
    if outcome.failed:
        raise SystemExit(1)


def _some(paths: Sequence[Path], most: int = 5) -> str:
    """The first names of a list that may be long."""
    rest = f", and {len(paths) - most} more" if len(paths) > most else ""
    return printable(", ".join(path.name for path in paths[:most])) + rest


class LibraryDisplay(Watcher):
    """A line on the whole run, and one on each material that is being fitted.

    Use as a context manager. On anything but a terminal it shows nothing.
    """

    def __init__(self) -> None:
        self._whole = Progress(
            TextColumn("{task.description}"), BarColumn(bar_width=24), _TimeLeft(), console=status
        )
        self._materials = Progress(*stage_columns(), console=status)
        self._live = Live(
            Group(self._whole, self._materials),
            console=status,
            transient=True,
            refresh_per_second=8,
        )
        self._task = self._whole.add_task("looking for what has changed", total=None)
        self._lock = threading.Lock()
        self._lines: dict[str, StageCallback] = {}
        self._total = self._done = self._failed = 0

    def __enter__(self) -> LibraryDisplay:
        if status.is_terminal:
            self._live.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        if status.is_terminal:
            self._live.__exit__(*error)

    def dashboard(self, link: str) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        status.print(f"dashboard: {link}", markup=False)

    def begin(self, materials: int) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        self._total = materials
        self._whole.reset(self._task, total=materials)
        self._update()

    def start(self, name: str) -> Report:
        """See :class:`nacre.workflows.Watcher`."""
        task = self._materials.add_task("waiting", total=1, name=name, note="")
        line = StageCallback(self._materials, task)
        with self._lock:
            self._lines[name] = line
            self._update()
        return line

    def end(self, name: str, error: str | None) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        with self._lock:
            if line := self._lines.pop(name, None):
                self._materials.remove_task(line.task)
            self._done += error is None
            self._failed += error is not None
            self._update()

    def _update(self) -> None:
        counts = {"done": self._done, "running": len(self._lines), "failed": self._failed}
        text = ", ".join(f"{count} {word}" for word, count in counts.items())
        self._whole.update(
            self._task,
            description=f"{text}, of {self._total}",
            completed=self._done + self._failed,
        )


class _TimeLeft(ProgressColumn):
    """Time that the rest takes if it goes on as so far.

    Rich's own column looks at the last half minute, in which not one long fit may end.
    """

    def __init__(self) -> None:
        super().__init__()
        self._seen = (0.0, 0.0)

    def render(self, task: Task) -> Text:
        """The text, in hours, minutes and seconds."""
        elapsed = task.elapsed or 0.0
        if task.completed != self._seen[0]:
            self._seen = (task.completed, elapsed)
        completed, at = self._seen
        if not task.total or not completed:
            return Text("-:--:--", style="progress.remaining")
        left = max(0.0, at / completed * (task.total - completed) - (elapsed - at))
        return Text(f"{left // 3600:.0f}:{time.strftime('%M:%S', time.gmtime(left))}")
