"""Print docs/reference/command-line.md, made of the help of every command.

`python scripts/command_line.py > docs/reference/command-line.md`
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator

import click

from nacre.cli import root

HEAD = """\
# Command line

`nacre VERB INPUT... [-o OUTPUT]`. A material is a reflectance (BRDF) or a texture (BTF): the file
says which, and an option that does not apply to it is refused by name. This page is made of the
help texts by `python scripts/command_line.py`.

Every command takes `-h/--help`, `-V/--version`, `-q/--quiet` (no progress, no notes) and
`-v/--verbose` (timings, paths, causes of errors). `--force` replaces protected outputs, and
`--json` prints reports for programs: [outputs, interruptions, scripts](../guide/outputs.md), which
also has the exit codes. An INPUT `-` is standard input; an OUTPUT `-`, where it is text, standard
output.
"""
SHARED = {"quiet", "verbose", "version", "help", "json", "force"}
"""Options that the head of the page explains."""


def commands(group: click.Group, context: click.Context) -> Iterator[tuple[str, click.Command]]:
    """Every command of a group and of the groups in it, by what is typed behind "nacre"."""
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            inner = click.Context(command, parent=context, info_name=name)
            yield from ((f"{name} {rest}", c) for rest, c in commands(command, inner))
        else:
            yield name, command


def page() -> str:
    """The whole page."""
    context = click.Context(root, info_name="nacre", **root.context_settings)
    found = list(commands(root, context))
    index = "\n".join(f"- [`nacre {name}`](#{_anchor(name)})" for name, _ in found)
    return "\n".join([HEAD, index, "", *(section(name, c, context) for name, c in found)])


def section(name: str, command: click.Command, root_context: click.Context) -> str:
    """Usage, description and options of one command."""
    context = click.Context(command, parent=root_context, info_name=name)
    usage = " ".join(command.collect_usage_pieces(context))
    lines = [f"## nacre {name}", "", "```", f"nacre {name} {usage}", "```", "", _about(command)]
    own, shared = [], []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if not isinstance(parameter, click.Option) or record is None:
            continue
        if SHARED.isdisjoint(option.lstrip("-") for option in parameter.opts):
            own.append(_row(*record))
        elif {"--json", "--force"}.intersection(parameter.opts):
            shared.append(f"`{parameter.opts[-1]}`")
    if own:
        lines += ["| option | | default |", "|---|---|---|", *own, ""]
    if shared:
        lines += [f"Also {' and '.join(shared)}.", ""]
    return "\n".join(lines)


def _about(command: click.Command) -> str:
    """The description of a command in Markdown; paragraphs that click leaves alone are literal."""
    parts = inspect.cleandoc(command.help or "").split("\n\n")
    made = []
    for part in parts:
        if part.startswith("\b"):
            made.append(f"```\n{part[1:].strip()}\n```")
        else:
            made.append(textwrap.fill(_escaped(" ".join(part.split())), 100))
    return "\n\n".join(made) + "\n"


def _row(names: str, text: str) -> str:
    """A row of the table: the option, what it does, its default and range."""
    facts = re.search(r"\s*\[([^\[\]]*(?:\[[^\[\]]*\][^\[\]]*)*)\]$", text)
    only, _, rest = (facts[1] if facts else "").rpartition(" only")
    default = (rest if only else facts[1] if facts else "").removeprefix("; ")
    default = default.removeprefix("default: ")
    default = default.replace("<=", " ≤ ").replace(">=", " ≥ ").replace("<", " < ")
    about = text[: facts.start()] if facts else text
    about += f" For {only}." if only else ""
    cells = (f"`{_cell(names)}`", _escaped(_cell(about)), _escaped(_cell(default)))
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _escaped(text: str) -> str:
    return re.sub(r"([*<])", r"\\\1", text)


def _anchor(name: str) -> str:
    return re.sub(r"[^a-z0-9 -]", "", f"nacre {name}").replace(" ", "-")


if __name__ == "__main__":
    print(page(), end="")
