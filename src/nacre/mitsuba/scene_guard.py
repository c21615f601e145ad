"""Checks scene files in XML for what would end the process when Mitsuba loads them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

from nacre.errors import FormatError
from nacre.io.files import PathLike, missing

MAX_DEPTH = 64
"""Levels of nested elements: Mitsuba's parser recurses for each, until the stack overflows."""
MAX_ELEMENTS = 1_000_000
"""Elements of a scene, counted each time a file is included."""
MAX_NAME = 4096
"""Letters in the name of an included file, where each `<default>` may double the others."""


_PARAMETER = re.compile(r"\$(\w+)")


class _Size(NamedTuple):
    depth: int
    elements: int


def check_scene(path: PathLike, parameters: Mapping[str, str] | None = None) -> set[str]:
    """Refuse a scene file that Mitsuba's parser would not survive.

    That is XML that is, with all its includes, nested too deeply or too large, and a `blendbsdf`
    without a weight, on which Mitsuba 3.9.1 crashes. A document type is refused too: older expat
    expands its entities to gigabytes. `parameters` take the place of values of `<default>`.

    Returns
    -------
    set of str
        Names of the scene's parameters: what a `<default>` declares and what stands behind a $.

    Raises
    ------
    FormatError
        For all of these, for a file that is no XML or includes itself, and if a file cannot be
        read.
    """
    if not Path(path).is_file():
        raise missing(path)
    files = _Files(path, parameters or {})
    files.size(Path(path), str(path))
    return files.names


class _Files:
    """A scene and the files that it includes, each read once."""

    def __init__(self, path: PathLike, parameters: Mapping[str, str]) -> None:
        self._top = Path(path)
        self._folders = [self._top.parent, Path()]
        self.names: set[str] = set()
        self._defaults = {name: value[: MAX_NAME + 1] for name, value in parameters.items()}
        self._sizes: dict[Path, _Size | None] = {}  # None while it is read

    def size(self, path: Path, shown: str) -> _Size:
        """The size of a file with its includes; messages call it `shown`."""
        own = path.resolve()
        if own not in self._sizes:
            self._sizes[own] = None
            self._sizes[own] = self._parsed(path, shown)
        if (size := self._sizes[own]) is None:
            raise FormatError(f"{self._top}: <include> of {shown}, which includes itself")
        return size

    def _parsed(self, path: Path, shown: str) -> _Size:
        level = deepest = elements = 0
        unweighted: dict[int, int] = {}  # lines of open blendbsdfs without a weight, by level

        def grown(name: str, by: _Size) -> None:
            nonlocal deepest, elements
            deepest = max(deepest, level + by.depth)
            elements += by.elements
            line = parser.CurrentLineNumber
            if deepest > MAX_DEPTH:
                reason = f"lies within {MAX_DEPTH} others; no scene needs that"
                raise FormatError(f"{shown}: line {line}: <{name}> {reason}")
            if elements > MAX_ELEMENTS:
                raise FormatError(
                    f"{shown}: line {line}: makes more than {MAX_ELEMENTS:,} elements with what it "
                    "includes"
                )

        def opened(name: str, attributes: dict[str, str]) -> None:
            nonlocal level
            grown(name, _Size(1, 1))
            for value in attributes.values():
                self.names.update(_PARAMETER.findall(value))
            if attributes.get("name") == "weight":
                unweighted.pop(level - 1, None)
            if attributes.get("type") == "blendbsdf":
                unweighted[level] = parser.CurrentLineNumber
            if name == "default":
                value = attributes.get("value", "")[: MAX_NAME + 1]
                self._defaults.setdefault(attributes.get("name", ""), value)
                self.names.add(attributes.get("name", ""))
            elif name == "path":
                self._folders.append(self._top.parent / attributes.get("value", ""))
            elif name == "include":
                for included in self._found(attributes.get("filename", ""), path, shown):
                    grown(name, self.size(included, str(included)))
            level += 1

        def closed(_: str) -> None:
            nonlocal level
            level -= 1
            if line := unweighted.pop(level, 0):
                raise FormatError(f"{shown}: line {line}: this blendbsdf has no weight; add one")

        def declared(*_: object) -> None:
            reason = "declares a document type (DOCTYPE), which is not read; drop it"
            raise FormatError(f"{shown}: {reason}")

        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = opened, closed
        parser.StartDoctypeDeclHandler = declared
        try:
            with path.open("rb") as file:
                parser.ParseFile(file)
        except OSError as error:
            raise FormatError(f"{shown}: cannot be read: {error.strerror}") from error
        except expat.ExpatError as error:
            raise FormatError(f"{shown}: is not XML: {error}") from error
        return _Size(deepest, elements)

    def _found(self, name: str, inside: Path, shown: str) -> list[Path]:
        """The files that an `<include>` may mean; Mitsuba itself refuses a missing one."""
        for key in sorted(self._defaults, key=len, reverse=True):
            if len(name := name.replace(f"${key}", self._defaults[key])) > MAX_NAME:
                raise FormatError(f"{shown}: <include> of a name longer than {MAX_NAME} letters")
        if unknown := _PARAMETER.search(name):
            raise FormatError(f"{shown}: <include> of {name}: {unknown[0]} has no <default>")
        candidates = (folder / name for folder in (inside.parent, *self._folders))
        try:
            return [path for path in dict.fromkeys(candidates) if path.is_file()]
        except OSError as error:  # a name that no file can have
            raise FormatError(f"{shown}: <include> of {name[:80]}: {error.strerror}") from error
