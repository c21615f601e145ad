"""What commands print, and the checks that they share."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from nacre.errors import FormatError, printable
from nacre.io.files import check_writable

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
            *stage_columns(),
            console=status,
            transient=True,
            disable=not status.is_terminal,
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


def stage_columns() -> list[ProgressColumn]:
    """What a line on one material shows; its task has the fields `name` and `note`."""
    return [
        TextColumn("{task.fields[name]}", markup=False),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeRemainingColumn(compact=True),
        TextColumn("{task.fields[note]}"),
    ]


class StageCallback:
    """Updates the line of one material."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self.task, self._stage = progress, task, ""

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """Show that `done` of `total` steps of a stage are finished."""
        if stage != self._stage:
            self._stage = stage
            self._progress.reset(self.task, description=stage, total=total)
        self._progress.update(self.task, completed=done, total=total, note=note)


def print_facts(
    title: str, facts: Iterable[tuple[str, Any]], units: Mapping[str, str] | None = None
) -> None:
    """Aligned columns under a title: what, its value, and in brackets its unit where there is one.

    A line is never broken, so that scripts can read it.
    """
    lines = [(key, _text(value)) for key, value in facts]
    width = max(len(key) for key, _ in lines)
    console.print(title, style="bold", markup=False)
    for key, value in lines:
        unit = (units or {}).get(key, "")
        console.print(f"  {key:<{width}}  {value}", markup=False, end="")
        console.print(f"  [{unit}]" if unit else "", style="dim", markup=False)


def counted(number: int, one: str, many: str) -> str:
    """A number with the word that goes with it: "1 pair", "2 pairs"."""
    return f"{number:,} {one if number == 1 else many}"


def print_json(value: Any) -> None:
    """A value as JSON; what is not finite becomes null, which is all that JSON has for it."""
    click.echo(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def raise_all(failures: Sequence[BaseException]) -> None:
    """Print all errors but the last, and raise that; nothing where there is none."""
    for failure in failures[:-1]:
        click.echo(f"nacre: {printable(str(failure))}", err=True)
    if failures:
        raise failures[-1]


def _text(value: Any) -> str:
    if value is None:
        return "unknown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, list | tuple):
        pair = len(value) == 2 and all(isinstance(v, float) for v in value)
        between = " to " if pair else ", "
        return between.join(_text(v) for v in value)
    return printable(str(value))


def print_table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """A table with all but the first column to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left")
    for row in rows:
        table.add_row(*(Text(_text(v)) for v in row))
    console.print(table)


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise before work starts if a file could not be written at its end, or is an input.

    Raises
    ------
    FormatError
        If a folder is absent or not writable, or an output is a folder or an input.
    """
    taken = {path.resolve() for path in inputs}
    for path in outputs:
        if path.resolve() in taken:
            raise FormatError(f"{path}: is the input as well; name another output")
        check_writable(path)


def file_path() -> click.Path:
    """A path that the command itself checks, with a message of its own."""
    return click.Path(path_type=Path)


environment_option = click.option(
    "--environment",
    type=file_path(),
    help="Latitude-longitude map (.exr, .hdr, .png). Default: the built-in studio.",
)


def numbers(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> tuple[int, ...] | None:
    """Whole numbers with commas between them, as an option's callback."""
    if value is None:
        return None
    parts = value.split(",")
    if len(parts) > 8 or not all(len(p) < 10 and p.isascii() and p.isdigit() for p in parts):
        raise click.BadParameter("expected whole numbers with commas between them, like 90,90,180")
    return tuple(map(int, parts))


resolution_option = click.option(
    "--resolution",
    metavar="N,N,...",
    callback=numbers,
    help="Nodes of the table: theta_h,theta_d,phi_d of .binary and .npz; "
    "phi_i,theta_i,square,azimuths,polars of .bsdf. Default: see docs/formats.md.",
)

preset_option = click.option(
    "--preset",
    default="standard",
    type=click.Choice(["draft", "standard", "best"]),
    help="How long a fit may take: about 0.5, 3 or 15 seconds on two cores.",
)
