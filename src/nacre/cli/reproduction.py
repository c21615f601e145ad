"""What the commands of `nacre reproduce` share: options, and what they print at their end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import click

from nacre.cli import options
from nacre.cli.report import aside, report
from nacre.errors import printable

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])

experiment_help = "Table or figure, like table1 or btf-fig4; --list prints all."


def output_option() -> Callable[[_Decorated], _Decorated]:
    """The folder that is written to."""
    text = "Folder for the CSV, the Markdown table and the pictures."
    return options.output_option(text, required=False, default="reproduced")


def list_option(print_names: Callable[[], None]) -> Callable[[_Decorated], _Decorated]:
    """An option that calls a function which prints the names of all methods, and stops."""

    def stop(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
        if value and not context.resilient_parsing:
            print_names()
            context.exit()

    return options.option(
        "--list",
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=stop,
        help="Print the names of all experiments and methods.",
    )


def split_names(text: str) -> list[str]:
    """Distinct names with commas between them, in order."""
    return list(dict.fromkeys(part.strip() for part in text.split(",")))


def print_reproduced(
    lines: Iterable[object],
    differs: str,
    left_out: Sequence[tuple[str, str, Sequence[str]]] = (),
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
    missing = [
        {"method": method, "reason": reason, "materials": list(materials)}
        for method, reason, materials in left_out
    ]
    for method, reason, materials in left_out:
        aside(printable(f"left out: {method} ({', '.join(materials)}): {reason}"))
    written = [str(line) for line in lines]
    data = {"outputs": written, "differs": differs, "left_out": missing}
    report([*written, f"differs from the paper: {differs}"], data)
