"""What commands print, and the checks that they share."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Table

from nacre.files import FormatError

console = Console(highlight=False, soft_wrap=True)
"""Results go to standard output."""

status = Console(stderr=True, highlight=False, soft_wrap=True)
"""Progress goes to standard error."""


class Stages:
    """A progress display with one line a material: stage, bar, note, time left.

    Use as a context manager; :meth:`add` gives a callback `(stage, done, total, note)`.
    """

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.fields[name]}"),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.completed:.0f}/{task.total:.0f}"),
            TimeRemainingColumn(compact=True),
            TextColumn("{task.fields[note]}"),
            console=status,
        )

    def __enter__(self) -> Stages:
        self._progress.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._progress.__exit__(*error)

    def add(self, name: str) -> StageCallback:
        """A line for one material."""
        task = self._progress.add_task("waiting", total=1, name=name, note="")
        return StageCallback(self._progress, task)


class StageCallback:
    """Updates one line of :class:`Stages`."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self._task, self._stage = progress, task, ""

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """Show that `done` of `total` steps of a stage are finished."""
        if stage != self._stage:
            self._stage = stage
            self._progress.reset(self._task, description=stage, total=total)
        self._progress.update(self._task, completed=done, total=total, note=note)


def print_facts(title: str, facts: Iterable[tuple[str, Any]]) -> None:
    """Two aligned columns under a title; a line is never broken, so that scripts can read it."""
    lines = [(key, _text(value)) for key, value in facts]
    width = max(len(key) for key, _ in lines)
    console.print(title, style="bold", markup=False)
    for key, value in lines:
        console.print(f"  {key:<{width}}  {value}", markup=False)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, list | tuple):
        between = " to " if all(isinstance(v, float) for v in value) else ", "
        return between.join(_text(v) for v in value)
    return str(value)


def print_table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table with all but the first column to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left")
    for row in rows:
        table.add_row(*(_text(v) for v in row))
    console.print(table)


def check_writable(path: Path) -> None:
    """Raise before work starts if a file could not be written at its end.

    Raises
    ------
    FormatError
        If the folder is absent or not writable, or `path` is a folder.
    """
    if path.is_dir():
        raise FormatError(f"{path}: is a directory, expected a file name to write")
    folder = path.parent
    if not folder.is_dir():
        raise FormatError(f"{path}: folder {folder} does not exist; create it first")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FormatError(f"{path}: cannot be written: {error.strerror}") from error


def existing_file() -> click.Path:
    """A file argument; the loader says what is wrong with it."""
    return click.Path(path_type=Path)
