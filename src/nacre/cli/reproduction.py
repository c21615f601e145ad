"""What the commands of `nacre reproduce` share: options, and what they print at their end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import click

from nacre.cli.console import console, file_path, status
from nacre.errors import printable

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])

output_option = click.option(
    "-o",
    "--output",
    type=file_path(),
    default="reproduced",
    help="Folder for the CSV, the Markdown table and the pictures.",
)


def list_option(print_names: Callable[[], None]) -> Callable[[_Decorated], _Decorated]:
    """An option that calls a function which prints the names of all methods, and stops."""

    def stop(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
        if value:
            print_names()
            context.exit()

    return click.option(
        "--list",
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=stop,
        help="Print the names of all methods.",
    )


def split_names(text: str) -> list[str]:
    """Distinct names with commas between them, in order."""
    return list(dict.fromkeys(part.strip() for part in text.split(",")))


def print_reproduced(
    lines: Iterable[object],
    differs: str,
    left_out: Iterable[tuple[str, str, Sequence[str]]] = (),
) -> None:
    """What was written, and how it differs from the paper.

    Parameters
    ----------
    lines
        A path each, or one with what there is to say of it.
    differs
        From the paper.
    left_out
        Method, reason and materials of what was not tried.
    """
    for method, reason, materials in left_out:
        named = f"left out: {method} ({', '.join(materials)}): {reason}"
        status.print(printable(named), markup=False)
    for line in lines:
        console.print(printable(str(line)), markup=False)
    console.print(f"differs from the paper: {differs}", markup=False)
