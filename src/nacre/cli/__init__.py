"""The `nacre` command; each subcommand is a module, imported when it runs."""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from typing import NoReturn

import click

from nacre.cli.command import Group
from nacre.cli.session import begin

COMMANDS = {
    "btf": "Capture, train, decode, synthesize and filter textures (BTFs).",
    "compare": "Compare two materials in numbers and pictures.",
    "completion": "Print a script for completion in a shell.",
    "convert": "Write a material in another format.",
    "demo": "Fit, render and compare one material from start to end.",
    "download": "Download measured materials from a public database.",
    "estimate": "Estimate a material from photographs in known light.",
    "export": "Write a material as shader code or for another tool.",
    "fit": "Fit a neural material to each file, or to all files in a folder.",
    "help": "Show the help of a command.",
    "info": "Show what a file holds, and whether a material is physical.",
    "latent": "Encode materials as short codes in a shared basis.",
    "materials": "List the materials that come with nacre.",
    "measure": "Plan a few measurements, or measure a Mitsuba BSDF virtually.",
    "plot": "Plot the lobes of materials over one another.",
    "render": "Render a preview of a material, or a Mitsuba scene.",
    "view": "Show materials on a web page.",
}

LAB = {
    "bench": "Measure representations of materials with the open benchmark.",
    "reproduce": "Reproduce a table or figure of either paper from given materials.",
}
"""Commands that the package nacre-lab adds."""

root = Group(
    "nacre",
    package="nacre.cli",
    commands_help=COMMANDS,
    entry_points="nacre.commands",
    elsewhere={name: (about, "nacre-lab") for name, about in LAB.items()},
    help="Measured materials as compact neural ones: fit, sample, render, compare.\n\n"
    "A material is a reflectance (BRDF) or a texture (BTF); commands take both.",
    epilog="Run 'nacre help COMMAND' for its options, and 'nacre completion --help' for completion "
    "in a shell.",
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    The exit code is 0 after success, 1 if some of several inputs failed, 2 for wrong input or
    usage, 130 after Ctrl-C and 143 after SIGTERM.
    """
    from nacre.errors import NacreError, is_shortage
    from nacre.runtime.interrupts import Terminated, terminable

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        with begin().stack, terminable():
            root.main(arguments, "nacre", standalone_mode=False)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "nacre"
        named = isinstance(error, click.BadParameter) and not (error.param or error.param_hint)
        message = error.message if named else error.format_message()
        _stop(f"{message} (see {command} --help)", error)
    except (NacreError, click.ClickException) as error:
        _stop(str(error), error)
    except FileExistsError as error:  # a file stands where a folder should be made
        _stop(f"{error.filename}: is a file, expected a folder; name another one", error)
    except (MemoryError, ImportError, OSError) as error:
        if is_shortage(error):
            _stop("not enough memory: free some, or raise ulimit -v", error)
        if not isinstance(error, OSError):
            raise
        where = f"{error.filename}: " if error.filename else ""
        _stop(f"{where}{error.strerror or error}", error)
    except (KeyboardInterrupt, click.Abort) as stop:
        if isinstance(stop, Terminated) or isinstance(stop.__cause__, Terminated):
            _stop("terminated", stop, 143)
        _stop("interrupted", stop, 130)


def _stop(message: str, error: BaseException, code: int = 2) -> NoReturn:
    from nacre.cli.report import detail, fail

    fail(message)
    cause = error.__cause__ or error.__context__
    while cause is not None:
        detail(f"  because of {type(cause).__name__}: {cause}")
        cause = cause.__cause__ or cause.__context__
    sys.exit(code)
