"""What commands print: results on standard output, progress and notes on standard error."""

from __future__ import annotations

import json
import math
import os
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from nacre.cli.display import Display, Line
from nacre.cli.session import Session, session
from nacre.errors import printable

_results = Console(highlight=False, soft_wrap=True)
status = Console(stderr=True, highlight=False, soft_wrap=True)
_ENDINGS = {
    "bytes": "bytes",
    "degrees": "deg",
    "1/sr": "per_sr",
    "nm": "nm",
    "dB": "db",
    "seconds": "s",
    "share": "fraction",
    "fraction": "fraction",
}
"""Ending of a fact's key for the first word of its unit."""
_KEYS = {
    "bytes": "size_bytes",
    "ratio": "compression_ratio",
    "largest polar angle of lights": "light_polar_angle_max_deg",
    "largest polar angle of views": "view_polar_angle_max_deg",
}


def _cleared() -> Session:
    """The session, its display cleared for printing."""
    now = session()
    if now.display is not None:
        now.display.clear()
    return now


def _print(thing: str | Table, **settings: Any) -> None:
    """Print results for people; nothing with --json."""
    now = _cleared()
    if not now.as_json:
        # Standard output may be taken by the output file.
        (_results if now.piped is None else status).print(thing, **settings)


def progress(name: str, stage: str = "") -> Line:
    """A line on the display of the running command, at the stage that begins."""
    # Outside of a command there is no display.
    line = (session().display or Display(name, status, quiet=True)).add(name)
    if stage:
        line(stage, 0, 1)
    return line


@contextmanager
def hidden_progress() -> Iterator[None]:
    """A block without progress, for questions to the user."""
    display = session().display
    with display.hidden() if display is not None else nullcontext():
        yield


def say(text: str, *, style: str | None = None, end: str = "\n") -> None:
    _print(text, style=style, markup=False, end=end)


def tell(sentences: Iterable[str], indent: int = 0) -> None:
    """Print sentences, one a line; on a terminal, those too long for it go on below, indented."""
    for sentence in sentences:
        text = f"{' ' * indent}{printable(sentence)}"
        if _results.is_terminal:
            further = " " * (indent + 2)
            text = textwrap.fill(text, max(_results.width, 40), subsequent_indent=further)
        say(text)


def note(text: str) -> None:
    """Print something worth knowing, on standard error."""
    aside(f"note: {text}")


def aside(text: str) -> None:
    """Print an event during the work, on standard error."""
    if not session().quiet:
        _print_status(text)


def detail(text: str) -> None:
    """Print something for --verbose, on standard error."""
    if session().verbose:
        _print_status(text)


def fail(message: str) -> None:
    """Print what went wrong, on one line of standard error."""
    for folder in _cleared().folders:  # for standard input and output
        message = message.replace(f"{folder}{os.sep}", "")
    click.echo(f"nacre: {printable(message)}", err=True)


def _print_status(text: str) -> None:
    _cleared()
    status.print(printable(text), markup=False)


def report(text: str | Iterable[str], data: Any) -> None:
    """Print a result: lines for people, or its data as JSON."""
    print_json(data)
    for line in [text] if isinstance(text, str) else text:
        say(printable(line))


def report_file(path: Path, text: str, **data: Any) -> None:
    """Report a written file with a `text` about it, and its size."""
    size = path.stat().st_size
    facts = [text, f"{size:,} bytes"] if text else [f"{size:,} bytes"]
    report(f"{path}: {', '.join(facts)}", {"output": str(path), "size_bytes": size, **data})


def report_facts(
    title: str, facts: Mapping[str, Any], units: Mapping[str, str] | None = None, **data: Any
) -> None:
    """Print facts in aligned columns, or as JSON together with `data`."""
    print_json({**data, **keyed(facts, units)})
    print_facts(title, facts.items(), units)


def report_parts(results: Sequence[Mapping[str, Any]], lines: Iterable[str] = ()) -> None:
    """Report on several files, and exit with 1 if some failed, with 2 if all did.

    There is one result per file; that of a failure has the keys "file" and "error". The `lines` are
    about the files that did not fail.
    """
    report(lines, results)
    failures = [result["error"] for result in results if result.get("error")]
    for failure in failures:
        fail(failure)
    if failures:
        raise SystemExit(1 if len(failures) < len(results) else 2)


def keyed(facts: Mapping[str, Any], units: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Facts under keys in snake case that end in the unit."""
    units = units or {}
    return {json_key(name, units.get(name, "")): _plain(v, json_key) for name, v in facts.items()}


def json_key(name: str, unit: str = "") -> str:
    """The key of a fact: `json_key("value range", "1/sr")` is `"value_range_per_sr"`."""
    if name in _KEYS:
        return _KEYS[name]
    key = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    ending = _ENDINGS.get(re.split(r"[ ,;]", unit)[0], "")
    return key if not ending or key.endswith(ending) else f"{key}_{ending}"


def _plain(value: Any, key: Callable[[str], str] = str) -> Any:
    """A value for JSON, with null for what is not finite and keys renamed by `key`."""
    if isinstance(value, Mapping):
        return {key(str(name)): _plain(item, key) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, key) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_facts(
    title: str, facts: Iterable[tuple[str, Any]], units: Mapping[str, str] | None = None
) -> None:
    """Print facts in aligned columns under a title, with units; nothing with --json.

    Lines are never broken, so that scripts can read them.
    """
    lines = [(key, _text(value)) for key, value in facts]
    width = max(len(key) for key, _ in lines)
    say(printable(title), style="bold")
    for key, value in lines:
        unit = (units or {}).get(key, "")
        say(f"  {key:<{width}}  {value}", end="" if unit else "\n")
        if unit:
            say(f"  [{unit}]", style="dim")


def print_table(columns: Sequence[str], rows: Iterable[Sequence[Any]], *, texts: int = 0) -> None:
    """Print a table, its columns of numbers aligned right; nothing with --json.

    The first column and the last `texts` are of text.
    """
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for index, column in enumerate(columns):
        number = 0 < index < len(columns) - texts
        table.add_column(column, justify="right" if number else "left")
    for row in rows:
        table.add_row(*(Text(_text(v)) for v in row))
    _print(table)


def print_json(value: Any) -> None:
    """Print a value as JSON if --json is given."""
    if session().as_json:
        text = json.dumps(_plain(value), indent=2, allow_nan=False)
        click.echo(text, err=_cleared().piped is not None)


def counted(number: int, one: str, many: str) -> str:
    """A number with the word that goes with it: "1 pair", "2 pairs"."""
    return f"{number:,} {one if number == 1 else many}"


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
