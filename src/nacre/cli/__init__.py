"""The `nacre` command. Each command lives in a module of its own, loaded when it runs."""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from typing import NoReturn

import click

import nacre
from nacre.cli.group import LazyGroup

_COMMANDS = {
    "btf": "Textures of measured reflectance: capture, train, encode, compare.",
    "compare": "Compare two materials in numbers and one picture.",
    "convert": "Write a material in another format.",
    "demo": "Run the main job from start to end on a built-in or given material.",
    "download": "Download measured materials from a public database.",
    "fit": "Fit a neural material or an analytic model to each file, or to all in a folder.",
    "info": "Show what is in a file, and whether it is physical.",
    "latent": "Materials as codes of a few values.",
    "measure": "Measure a Mitsuba BSDF virtually.",
    "plot": "Draw the lobes of materials over one another.",
    "reproduce": "Make a table or figure of the NBRDF paper again from given materials.",
    "render": "Render a preview of a material.",
}


@click.group(
    cls=LazyGroup,
    package="nacre.cli",
    commands_help=_COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    epilog="Run 'nacre COMMAND --help' for the options of a command.",
)
@click.version_option(nacre.__version__, prog_name="nacre")
def _nacre() -> None:
    """Measured materials as compact neural BRDFs: fit, sample, render, compare."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    0 done, 1 done but for some materials of a folder, 2 wrong input or usage, 130 interrupted by
    Ctrl-C, 143 by SIGTERM.
    """
    from nacre.errors import NacreError
    from nacre.runtime.interrupts import Terminated, terminable

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        with terminable():
            _nacre.main(arguments, standalone_mode=False)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "nacre"
        _stop(f"{error.format_message()} (see {command} --help)")
    except (NacreError, click.ClickException) as error:
        _stop(str(error))
    except MemoryError:
        _stop("out of memory")
    except FileExistsError as error:  # of a folder that is to be made
        _stop(f"{error.filename}: is a file, expected a folder; name another one")
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _stop(f"{where}{error.strerror or error}")
    except (KeyboardInterrupt, click.Abort) as stop:
        if isinstance(stop, Terminated) or isinstance(stop.__cause__, Terminated):
            _stop("terminated", 143)
        _stop("interrupted", 130)


def _stop(message: str, code: int = 2) -> NoReturn:
    from nacre.errors import printable

    click.echo(f"nacre: {printable(message)}", err=True)
    sys.exit(code)
