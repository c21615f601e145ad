"""Whole calls: what is wrong with one is said before any work, and with the line to type."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from nacre.cli.options import Input, Output
from nacre.errors import NacreError
from nacre.io.files import missing
from nacre.io.marks import read_mark


@contextmanager
def explained(command: click.Command, ctx: click.Context, call: Sequence[str]) -> Iterator[None]:
    """A block that parses a call, whose errors end with what to type."""
    try:
        yield
    except click.BadParameter as error:
        if isinstance(error, click.MissingParameter) and error.param is not None:
            _check_words(command, ctx, call)
            raise NacreError(_lacking(command, ctx, call, error.param)) from error
        raise
    except click.UsageError as error:
        if "extra argument" in error.message:
            _check_words(command, ctx, call)
        raise


def check_inputs(command: click.Command, ctx: click.Context, call: Sequence[str]) -> None:
    """Raise if a file or folder to read is not there.

    A name that was meant for an output is told with the line to type, also where there is a file
    already: one that the same command wrote, or that holds no material.

    Raises
    ------
    FormatError
        With similar names in the folder.
    NacreError
        With the line to type.
    """
    for parameter in command.params:
        if not isinstance(parameter.type, Input):
            continue
        value = ctx.params.get(parameter.name or "")
        paths = value if isinstance(value, tuple) else (value,)
        for path in paths:
            if not isinstance(path, Path):
                continue
            absent = _is_absent(path)
            if isinstance(parameter, click.Argument) and len(paths) > 1:
                word = f"{path}/" if f"{path}/" in call else str(path)
                option = _output_for(command, call, word)
                if option is not None and (absent or _is_no_input(path, ctx.command_path)):
                    raise NacreError(_line(ctx, call, word, option))
            if absent:
                raise missing(path, parameter.type.others())


def _check_words(command: click.Command, ctx: click.Context, call: Sequence[str]) -> None:
    """Raise a NacreError if one of the names in a call is one too many.

    It may have been meant for an output: then with the line to type.
    """
    given, left, _ = command.make_parser(ctx).parse_args(list(call))
    arguments = [each for each in command.params if isinstance(each, click.Argument)]
    values = [given.get(each.name) for each in arguments]
    parts = [value if isinstance(value, tuple) else (value,) for value in values]
    words = [word for part in parts for word in part if isinstance(word, str)]
    doubtful = [*left, *(word for word in words[1:][::-1] if _is_absent(Path(word)))]
    for word in doubtful:
        option = _output_for(command, call, word)
        if option is not None:
            raise NacreError(_line(ctx, call, word, option))
    if left:
        takes = " ".join(each.make_metavar(ctx) for each in arguments) or "no names"
        raise click.UsageError(
            f"{left[0]}: one name too many; {ctx.command_path} takes {takes}", ctx
        )


def _output_for(command: click.Command, call: Sequence[str], word: str) -> click.Option | None:
    """The option that a name, by its ending, was meant for, and that is not given yet."""
    for option in command.params:
        if not isinstance(option, click.Option) or not _is_output(option):
            continue
        if any(each.partition("=")[0] in option.opts for each in call):
            continue
        about = option.help or ""
        endings, ending = re.findall(r"\.[a-z0-9]+\b", about), Path(word).suffix.lower()
        folder = word.endswith(("/", os.sep)) and "folder" in about
        if folder or (ending and (ending in endings or not endings)):
            return option
    return None


def _is_output(option: click.Option) -> bool:
    return option.name == "output" or isinstance(option.type, Output)


def _line(ctx: click.Context, call: Sequence[str], word: str, option: click.Option) -> str:
    """What to say of a name that was meant for an option."""
    rest = list(call)
    del rest[len(rest) - 1 - rest[::-1].index(word)]
    flag = min(option.opts, key=len)
    typed = shlex.join([*ctx.command_path.split(), *rest, flag, word])
    return f"{word}: is not an input; to write it, type: {typed}"


def _lacking(
    command: click.Command, ctx: click.Context, call: Sequence[str], parameter: click.Parameter
) -> str:
    """What to say of something that a call lacks."""
    typed = shlex.join([*ctx.command_path.split(), *call])
    if isinstance(parameter, click.Option) and _is_output(parameter):
        endings = re.findall(r"\.[a-z0-9]+\b", parameter.help or "")
        return f"say where to write; type: {typed} -o NAME{endings[0] if endings else '.ENDING'}"
    metavar = parameter.make_metavar(ctx)
    if isinstance(parameter, click.Option):
        return f"say which; type: {typed} {max(parameter.opts, key=len)} {metavar}"
    names = [each.make_metavar(ctx) for each in command.params if isinstance(each, click.Argument)]
    return f"say what to read; type: {ctx.command_path} {' '.join(names)}"


def _is_absent(path: Path) -> bool:
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return True
    except (OSError, ValueError):  # left to the reader
        pass
    return False


def _is_no_input(path: Path, command: str) -> bool:
    """Whether a file is what the same command wrote before, or holds nothing that nacre reads."""
    from nacre.formats import describe_kind

    if not path.is_file():
        return False
    mark = None
    with suppress(OSError):
        mark = read_mark(path)
    return (mark is not None and mark.command == command) or not describe_kind(path)
