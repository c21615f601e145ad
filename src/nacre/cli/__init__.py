"""The `nacre` command. Each command lives in a module of its own, loaded when it runs."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

import click

import nacre

_COMMANDS = {
    "compare": "Compare two materials in numbers and one picture.",
    "demo": "Run the main job from start to end on a built-in or given material.",
    "fit": "Fit a neural material to each measured file.",
    "info": "Show what is in a file.",
    "render": "Render a preview of a material.",
}


class _Commands(click.Group):
    """Lists commands without importing them: help must come at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"nacre.cli.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(sorted(_COMMANDS.items()))


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog="Run 'nacre COMMAND --help' for the options of a command.",
)
@click.version_option(nacre.__version__, prog_name="nacre")
def _nacre() -> None:
    """Measured materials as compact neural BRDFs: fit, sample, render, compare."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 2 wrong input or usage, 130 interrupted."""
    from nacre.files import NacreError

    try:
        _nacre.main(arguments, standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except NacreError as error:
        click.echo(f"nacre: {error}", err=True)
        sys.exit(2)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        click.echo(f"nacre: {where}{error.strerror or error}", err=True)
        sys.exit(2)
    except (KeyboardInterrupt, click.Abort):
        click.echo("nacre: interrupted", err=True)
        sys.exit(130)
