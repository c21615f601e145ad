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

from nacre.cli import LAB, root
from nacre.cli.command import Group
from nacre.cli.layout import Option, heading, is_shared

HEAD = """\
# Command line

`nacre VERB INPUT... [-o OUTPUT]`. A material is a reflectance (BRDF) or a texture (BTF); the file
determines which, and options for the other kind are refused. `python scripts/command_line.py` makes
this page from the help texts. `nacre FILE` says what a file is and which commands take it.

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


def commands(
    group: Group, context: click.Context, names: Container[str] | None = None
) -> Iterator[tuple[str, str, click.Command]]:
    """Commands of a group (those in `names`, or all) and of its groups: the heading that they stand
    under, their names as typed after "nacre", themselves.
    """
    for title, rows in group.commands_by_heading().items():
        for name, _ in rows:
            if names is not None and name not in names:
                continue
            command = group.get_command(context, name)
            assert command is not None
            if isinstance(command, Group):
                inner = click.Context(command, parent=context, info_name=name)
                for _, rest, child in commands(command, inner):
                    yield title, f"{name} {rest}", child
            else:
                yield title, name, command


def page(*, lab: bool = False) -> str:
    """The page of nacre's own commands, or of those that nacre-lab adds."""
    context = click.Context(root, info_name="nacre", **root.context_settings)
    found = list(commands(root, context, LAB if lab else root.built_in))
    index: dict[str, list[str]] = {}
    for title, name, _ in found:
        index.setdefault(title, []).append(f"[`{name}`](#{_anchor(name)})")
    listed = [_filled(f"- {title}: {', '.join(links)}", "  ") for title, links in index.items()]
    head = LAB_HEAD if lab else HEAD
    return "\n".join([head, *listed, "", *(section(name, c, context) for _, name, c in found)])


def section(name: str, command: click.Command, root_context: click.Context) -> str:
    """Usage, description and options of one command."""
    context = click.Context(command, parent=root_context, info_name=name)
    usage = " ".join(command.collect_usage_pieces(context))
    lines = [f"## nacre {name}", "", f"`nacre {name} {usage}`", "", _about(command)]
    groups: dict[str, list[str]] = {"Options": []}
    for option in command.get_params(context):
        if isinstance(option, Option) and not is_shared(option):
            groups.setdefault(heading(option), []).append(_row(option, context))
    for title, rows in groups.items():
        if rows:
            above = [] if title == "Options" else [f"{title}:", ""]
            lines += [*above, "| option | | default |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _about(command: click.Command) -> str:
    """The description of a command in Markdown; paragraphs that click leaves alone are literal."""
    parts = inspect.cleandoc(command.help or "").split("\n\n")
    made = []
    for part in parts:
        if part.startswith("\b"):
            made.append(f"```\n{part[1:].strip()}\n```")
        else:
            made.append(_filled(_escaped(" ".join(part.split()))))
    return "\n\n".join(made) + "\n"


def _row(option: Option, context: click.Context) -> str:
    """A row of the table: the option, its help, its range and default."""
    record = option.get_help_record(context)
    assert record is not None
    about = " ".join([option.help or "", *(f"{each.capitalize()}." for each in option.limits())])
    default = option.default_in_words(context)
    cells = (f"`{_cell(record[0])}`", _escaped(_cell(about)), _escaped(_cell(default)))
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")


def _filled(text: str, indent: str = "") -> str:
    """Text in lines; links and words with hyphens stay whole."""
    whole = re.sub(r"\[[^]]*\]", lambda link: link[0].replace(" ", "\0"), text)
    lines = textwrap.fill(
        whole, 100, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )
    return lines.replace("\0", " ")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _escaped(text: str) -> str:
    return re.sub(r"([*<])", r"\\\1", text)


def _anchor(name: str) -> str:
    return re.sub(r"[^a-z0-9 -]", "", f"nacre {name}").replace(" ", "-")


if __name__ == "__main__":
    print(page(lab=sys.argv[1:] == ["lab"]), end="")
