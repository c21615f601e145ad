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
    "Look at materials": {
        "info": "Show what a file holds, and whether a material is physical.",
        "check": "Check whether materials and BSDFs are sound.",
        "compare": "Compare two materials in numbers and pictures.",
        "plot": "Plot the lobes of materials over one another.",
        "render": "Render a preview of a material, or a Mitsuba scene.",
        "view": "Show materials on a web page.",
    },
    "Make materials": {
        "fit": "Fit a neural material to each file, or to all files in a folder.",
        "estimate": "Estimate a material from photographs or from readings.",
    },
    "Use them elsewhere": {
        "export": "Write a material as shader code or for another tool.",
        "convert": "Write a material in another format.",
    },
    "Get materials": {
        "materials": "List the materials that come with nacre.",
        "download": "Download measured materials from a public database.",
        "measure": "Read gloss, haze and color, or plan measurements.",
    },
    "Textures and codes": {
        "btf": "Capture, train, decode, synthesize and filter textures (BTFs).",
        "latent": "Encode materials as short codes in a shared basis.",
    },
    "More": {
        "demo": "Fit, render and compare one material from start to end.",
        "cache": "List what nacre keeps on this machine, or clear it.",
        "help": "Show the help of a command.",
        "completion": "Print a script for completion in a shell.",
    },
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
    epilog="Run 'nacre help COMMAND' for its options, and 'nacre FILE' for what to do with a file.",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
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
        _stop(f"{_usage(error)} (see {command} --help)", error)
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


def _usage(error: click.UsageError) -> str:
    """What is wrong with a call; of a value, after the option that it is for."""
    text = error.format_message()
    if isinstance(error, click.NoSuchOption):
        from nacre.errors import did_you_mean

        command = error.ctx.command_path if error.ctx else "nacre"
        hint = did_you_mean(error.option_name, error.possibilities or (), similarity=0.75)
        text = f"{command} has no option {error.option_name}{hint}"
    elif isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        text = error.message
        if isinstance(error.param, click.Option):
            text = f"{max(error.param.opts, key=len)}: {text}"
    return text.removesuffix(".")


def _stop(message: str, error: BaseException, code: int = 2) -> NoReturn:
    from nacre.cli.report import detail, fail

    fail(message)
    cause = error.__cause__ or error.__context__
    while cause is not None:
        detail(f"  because of {type(cause).__name__}: {cause}")
        cause = cause.__cause__ or cause.__context__
    sys.exit(code)
