"""What `nacre FILE` answers: what the file is, and which commands take it."""

from __future__ import annotations

import os
import shlex
from collections.abc import Container, Sequence
from itertools import islice
from pathlib import Path

import click

from nacre.errors import FormatError, NacreError, printable
from nacre.io.files import missing

_LINES = {
    "measured": {
        "info {}": "show what it holds",
        "fit {}": "fit a neural material to it",
        "render {}": "render a preview",
        "view {}": "show it on a web page",
    },
    "model": {
        "info {}": "show what it holds",
        "render {}": "render a preview",
        "view {}": "show it on a web page",
        "export {} --to glsl": "write it as shader code",
    },
    "texture": {
        "info {}": "show what it holds",
        "fit {}": "encode it, for web pages and shaders",
        "render {}": "render a preview",
    },
    "codes": {
        "info {}": "show what it holds",
        "render {}": "render a preview",
        "view {}": "show it on a web page",
        "btf decode {} -o decoded.npz": "get the texture back",
    },
    "folder": {
        "fit {} -o fitted/": "fit every measured file in it and below",
        "view {}": "show all materials in it on a web page",
    },
    "scene": {"render {}": "render it"},
    "other": {"info {}": "show what it holds"},
}
"""Commands to type after "nacre", and what each does, by what lies at the path."""

_LOOKED_AT = 10_000
"""Most entries of a folder, and of those in it, that are looked at."""


def answer_file(words: Sequence[str], commands: Container[str]) -> None:
    """If the first of the words after "nacre" is a file, say what to do with it, and exit with 2.

    Raises
    ------
    NacreError
        If a command follows the file.
    FormatError
        If the file is of no known kind, or the word looks like a path but is none.
    """
    from nacre.included import resolve

    name, *rest = words
    path = resolve(name)  # raises for a name like those of included materials that is none
    if not os.path.lexists(path):
        if not Path(name).suffix and os.sep not in name:
            return
        raise missing(path)
    if rest and rest[0] in commands:
        typed = shlex.join(["nacre", rest[0], name, *rest[1:]])
        raise NacreError(f"{name}: is a file; the command comes first: {typed}")
    about, lines = _described(path)
    quoted = shlex.quote(name)
    shown = {f"nacre {line.format(quoted)}": text for line, text in lines.items()}
    width = max(map(len, shown))
    click.echo(f"nacre: {printable(name)}: is {about}; say what to do with it:", err=True)
    for line, text in shown.items():
        click.echo(f"  {printable(line):<{width}}  {text}", err=True)
    raise SystemExit(2)


def _described(path: Path) -> tuple[str, dict[str, str]]:
    """What lies at a path, and the lines to type for it."""
    from nacre.formats import describe_kind, identify, is_measured
    from nacre.io.files import first_bytes

    kind = describe_kind(path).replace(") (", "; ")
    if not kind and b"<scene" in first_bytes(path):
        return "a Mitsuba scene", _LINES["scene"]
    if not kind and path.is_dir():
        below = islice(path.rglob("*"), _LOOKED_AT)
        if any(each.is_file() and is_measured(each) for each in below):
            return "a folder with measured files", _LINES["folder"]
    try:
        entry = identify(path)
    except FormatError:
        if kind:
            return kind, _LINES["other"]
        raise
    if entry.kind == "btf":
        return kind, _LINES["texture" if entry.load_material is None else "codes"]
    return kind, _LINES["measured" if entry.measured else "model"]
