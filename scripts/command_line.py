"""Print the reference of the command line, made from the help texts of the commands.

`python scripts/command_line.py > docs/reference/command-line.md` for the commands of nacre,
`python scripts/command_line.py lab > lab/docs/command-line.md` for those of nacre-lab.
"""

from __future__ import annotations

import inspect
import re
import sys
import textwrap
from collections.abc import Container, Iterator

import click

from nacre.cli import COMMANDS, LAB, root

HEAD = """\
# Command line

`nacre VERB INPUT... [-o OUTPUT]`. A material is a reflectance (BRDF) or a texture (BTF); the file
determines which, and options for the other kind are refused. `python scripts/command_line.py` makes
this page from the help texts.

Every command takes `-h/--help`, `-V/--version`, `-q/--quiet` (no progress, no notes) and
`-v/--verbose` (timings, paths, causes of errors). Commands that write files take `--force`, which
replaces protected outputs; commands that report results take `--json`, which prints them for
programs. See [outputs, interruptions, scripts](../guide/outputs.md), also for exit codes.
An INPUT `-` is standard input; an OUTPUT `-` is standard output, for text.
"""
LAB_HEAD = """\
# Commands of the lab

The package `nacre-lab` adds these commands to `nacre`; they take the shared options of all
[commands](../../docs/reference/command-line.md). `python scripts/command_line.py lab` makes this
page from the help texts.
"""
SHARED = {"quiet", "verbose", "version", "help", "json", "force"}
"""Options that the head of the page explains."""
RANGES = {
    r"0<=x<=4294967295": "",
    r"(\S+)<=x<=(\S+?)": r"\2 to \3",
    r"(\S+)<x<=(\S+?)": r"above \2, up to \3",
    r"x>=1": "",
    r"x>=(\S+?)": r"at least \2",
    r"x>(\S+?)": r"above \2",
}
"""Ranges as click writes them, in words."""


def commands(
    group: click.Group, context: click.Context, names: Container[str] | None = None
) -> Iterator[tuple[str, click.Command]]:
    """Commands of a group (those in `names`, or all) and of its groups, as typed after "nacre"."""
    for name in group.list_commands(context):
        if names is not None and name not in names:
            continue
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            inner = click.Context(command, parent=context, info_name=name)
            yield from ((f"{name} {rest}", c) for rest, c in commands(command, inner))
        else:
            yield name, command


def page(*, lab: bool = False) -> str:
    """The page of nacre's own commands, or of those that nacre-lab adds."""
    context = click.Context(root, info_name="nacre", **root.context_settings)
    found = list(commands(root, context, LAB if lab else COMMANDS))
    index = ",\n".join(f"[`{name}`](#{_anchor(name)})" for name, _ in found)
    head = LAB_HEAD if lab else HEAD
    return "\n".join([head, f"{index}.", "", *(section(name, c, context) for name, c in found)])


def section(name: str, command: click.Command, root_context: click.Context) -> str:
    """Usage, description and options of one command."""
    context = click.Context(command, parent=root_context, info_name=name)
    usage = " ".join(command.collect_usage_pieces(context))
    lines = [f"## nacre {name}", "", f"`nacre {name} {usage}`", "", _about(command)]
    own = []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if not isinstance(parameter, click.Option) or record is None:
            continue
        if SHARED.isdisjoint(option.lstrip("-") for option in parameter.opts):
            own.append(_row(*record))
    if own:
        lines += ["| option | | default |", "|---|---|---|", *own, ""]
    return "\n".join(lines)


def _about(command: click.Command) -> str:
    """The description of a command in Markdown; paragraphs that click leaves alone are literal."""
    parts = inspect.cleandoc(command.help or "").split("\n\n")
    made = []
    for part in parts:
        if part.startswith("\b"):
            made.append(f"```\n{part[1:].strip()}\n```")
        else:
            made.append(
                textwrap.fill(_escaped(" ".join(part.split())), 100, break_on_hyphens=False)
            )
    return "\n\n".join(made) + "\n"


def _row(names: str, text: str) -> str:
    """A row of the table: the option, its help, its default and range."""
    facts = re.search(r"\s*\[([^\[\]]*(?:\[[^\[\]]*\][^\[\]]*)*)\]$", text)
    only, _, rest = (facts[1] if facts else "").rpartition(" only")
    default = (rest if only else facts[1] if facts else "").removeprefix("; ")
    default = default.removeprefix("default: ")
    for pattern, words in RANGES.items():
        default = re.sub(rf"(^|; ){pattern}(?=;|$)", rf"\g<1>{words}", default)
    default = default.rstrip("; ")
    about = text[: facts.start()] if facts else text
    about += f" For {only.partition(' (')[0]}." if only else ""
    cells = (f"`{_cell(names)}`", _escaped(_cell(about)), _escaped(_cell(default)))
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _escaped(text: str) -> str:
    return re.sub(r"([*<])", r"\\\1", text)


def _anchor(name: str) -> str:
    return re.sub(r"[^a-z0-9 -]", "", f"nacre {name}").replace(" ", "-")


if __name__ == "__main__":
    print(page(lab=sys.argv[1:] == ["lab"]), end="")
