"""Options that tell readers about a file: the same on every command that takes materials.

A further one is a line in :data:`_OPTIONS`, named like the keyword of the reader that takes it.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import click

from nacre.cli.layout import Option
from nacre.cli.options import Input, Parsed, floats
from nacre.cli.session import session
from nacre.errors import in_words

_GROUP = "reading files"


def _bands(text: str) -> tuple[float, ...] | str:
    if text == "color":
        return text
    bands = floats(text)
    if not 1 <= len(bands) <= 3 or not all(0.0 < band < 1e6 for band in bands):
        raise ValueError("expected color, or one to three wavelengths in nm, like 450,550,905")
    return bands


def _columns(text: str) -> dict[str, str]:
    pairs = [part.split("=", 1) for part in text.split(",") if part.strip()]
    if not pairs or not all(len(pair) == 2 and pair[0].strip() for pair in pairs):
        raise ValueError("expected NAME=COLUMN,..., like theta_i=inc,theta_o=view,f=brdf")
    return {name.strip(): column.strip() for name, column in pairs}


def _apertures(text: str) -> tuple[float, ...]:
    angles = floats(text)
    if len(angles) != 2 or not all(0.0 <= angle < 90.0 for angle in angles):
        raise ValueError("expected SOURCE,DETECTOR in degrees, half the angles, like 0.25,2.5")
    return angles


_QUANTITIES = ["brdf", "brf", "brdf-cos", "percent"]
_OPTIONS: tuple[tuple[str, dict[str, Any], str], ...] = (
    (
        "--material",
        {"multiple": True, "metavar": "NAME"},
        "One material of a file of several, by name or number.",
    ),
    (
        "--bands",
        {"type": Parsed("NM,...", _bands), "metavar": "NM,..."},
        "Up to three bands of a scan as channels, or color.",
    ),
    (
        "--columns",
        {"type": Parsed("A=B,...", _columns), "metavar": "A=B,..."},
        "Columns of a table by name or number: theta_i=inc,f=3.",
    ),
    (
        "--quantity",
        {"type": click.Choice(_QUANTITIES), "metavar": "KIND"},
        f"Values of a table are {', '.join(_QUANTITIES)}.",
    ),
    (
        "--apertures",
        {"type": Parsed("DEG,DEG", _apertures), "metavar": "DEG,DEG"},
        "Half-angles of a scan's source and its detector.",
    ),
    ("--sheet", {"metavar": "NAME"}, "Sheet of a spreadsheet."),
    ("--opaque-part", {"is_flag": True}, "Leave out transmission, emission and textures."),
    ("--as-stored", {"is_flag": True}, "Do not scale Zemax and Speos tables to their totals."),
)


def options() -> list[click.Parameter]:
    """The options, for a command that reads materials."""

    def keep(_context: click.Context, parameter: click.Parameter, value: Any) -> None:
        if value not in (None, False, ()):
            session().reading[parameter.name or ""] = value

    return [
        Option([flag], group=_GROUP, expose_value=False, callback=keep, help=text, **dict(settings))
        for flag, settings, text in _OPTIONS
    ]


def applied(context: click.Context) -> AbstractContextManager[None]:
    """A block in which the inputs of a command are read as its options say.

    Raises
    ------
    UsageError
        If no input takes one of them, or there are more materials than files that hold several.
    """
    from nacre.io.reading import reading

    given = dict(session().reading)
    if not given:
        return reading({})
    materials = list(given.pop("material", ()))
    inputs = [path for path in _inputs(context) if path.is_file()]
    told: dict[Path, dict[str, Any]] = {path: {} for path in inputs}
    for name, value in given.items():
        taking = [path for path in inputs if name in _taken(path)]
        if not taking:
            kinds = in_words(dict.fromkeys(map(_kind, inputs))) if inputs else "folders"
            raise click.UsageError(f"{_flag(name)} is not for {kinds}; leave it out")
        for path in taking:
            told[path][name] = value
    several = [path for path in inputs if "material" in _taken(path)] if materials else []
    if len(materials) > max(len(several), 1):
        problem = f"{len(materials)} times, for {len(several)} files that hold several"
        raise click.UsageError(f"--material is given {problem}")
    if materials and not several:
        raise click.UsageError("--material is for files that hold several; no input does")
    for index, path in enumerate(several):
        chosen: str | None = None
        if len(materials) == 1:
            chosen = materials[0]
        elif index < len(materials):
            chosen = materials[index]
        if chosen is not None:
            told[path]["material"] = chosen
    return reading(told)


def chosen_material(path: Path) -> str:
    """The material that was chosen of a file; empty for none."""
    from nacre.io.reading import told

    return str(told(path).get("material", ""))


def typed() -> str:
    """The options that were given, as one types them; begins with a blank unless empty."""
    words = []
    for name, value in session().reading.items():
        for each in value if name == "material" else (value,):
            text = {True: ""}.get(each, each) if isinstance(each, bool) else each
            if isinstance(each, dict):
                text = ",".join(f"{key}={column}" for key, column in each.items())
            elif isinstance(each, tuple):
                text = ",".join(f"{number:g}" for number in each)
            words.append(f" {_flag(name)}" + (f" {shlex.quote(str(text))}" if text else ""))
    return "".join(words)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _kind(path: Path) -> str:
    from nacre.formats import describe_kind

    return f"{path} ({described})" if (described := describe_kind(path)) else str(path)


def _inputs(context: click.Context) -> Iterator[Path]:
    for parameter in context.command.params:
        if isinstance(parameter.type, Input):
            value = context.params.get(parameter.name or "")
            for path in value if isinstance(value, tuple) else (value,):
                if isinstance(path, Path):
                    yield path


def _taken(path: Path) -> tuple[str, ...]:
    """Names of the options that suit a file; none for one that is read for something else."""
    from nacre.errors import FormatError
    from nacre.formats import reader_options

    try:
        return reader_options(path)
    except FormatError:
        return ()


def check_alone() -> None:
    """Refuse the options for a folder, whose files would need their own, and for a cluster."""
    if session().reading:
        flags = ", ".join(map(_flag, session().reading))
        raise click.UsageError(f"{flags}: is for files that are fitted here; name them")
