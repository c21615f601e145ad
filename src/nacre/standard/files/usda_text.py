"""Text of USD layers as prims and their properties, without composition.

OpenUSD, "Usda File Format Specification". This reads prims, their metadata, attributes and
relationships with values and connections. Variants, references and sublayers are not followed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from nacre.errors import CUT_SHORT, FormatError

DEPTH_LIMIT = 64
"""The most levels of nested prims, or values."""

_TOKEN = re.compile(
    r"""
    (?P<space> [\s]+ | \#[^\n]* )
  | (?P<string> \"{3} (?:[^\"\\] | \\. | \"(?!\"\"))* \"{3}
              | '{3} (?:[^'\\] | \\. | '(?!''))* '{3}
              | \" (?:[^\"\\\n] | \\.)* \"
              | ' (?:[^'\\\n] | \\.)* ' )
  | (?P<asset> @{3} (?:[^@] | @(?!@@))* @{3} | @[^@\n]*@ )
  | (?P<path> <[^<>\n]*> )
  | (?P<number> [-+]? (?:[0-9]+\.?[0-9]*|\.[0-9]+) (?:[eE][-+]?[0-9]+)? | -inf\b )
  | (?P<word> [^\W\d]\w* (?:[:.][^\W\d]\w*)* )
  | (?P<mark> [()\[\]{}=,;:] )
    """,
    re.VERBOSE | re.DOTALL,
)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r"}
_CLOSING = {"(": ")", "[": "]", "{": "}"}
_SPECIFIERS = "def", "over", "class"
_EDITS = "prepend", "append", "add", "delete", "reorder"
_QUALIFIERS = "custom", "uniform", "varying"


@dataclass(frozen=True)
class Path:
    """A path in a layer: "/paint/Looks.outputs:surface"."""

    text: str


@dataclass
class Property:
    """An attribute or a relationship, in simplified form."""

    kind: str
    value: Any = None
    metadata: dict[str, Any] = field(default_factory=dict)


@dataclass
class Prim:
    """A prim; properties are by name, connections by name with ".connect" appended."""

    kind: str
    name: str
    metadata: dict[str, Any] = field(default_factory=dict)
    properties: dict[str, Property] = field(default_factory=dict)
    children: list[Prim] = field(default_factory=list)

    def walk(self, path: str = "") -> Iterator[tuple[str, Prim]]:
        """All prims below this one, by path."""
        for child in self.children:
            yield f"{path}/{child.name}", child
            yield from child.walk(f"{path}/{child.name}")


def parse(text: str) -> Prim:
    """The root of a layer with its metadata and top prims.

    Values are numbers, texts, :class:`Path`, tuples (also for arrays) and dicts. Raises FormatError
    with the line, for anything that is not part of a layer or not supported.
    """
    return _Parser(text).layer()


class _Parser:
    def __init__(self, text: str) -> None:
        self._text, self._place, self._start, self._depth = text, 0, 0, 0
        self._kind, self._word = "", ""
        self._next()

    def _fail(self, problem: str) -> FormatError:
        line = self._text.count("\n", 0, self._start) + 1
        return FormatError(f"line {line}: {problem}")

    def _unexpected(self, wanted: str, word: str) -> FormatError:
        if not word:
            return self._fail(f"ends where {wanted} is expected; {CUT_SHORT}")
        return self._fail(f"expected {wanted}, found {word[:40]!r}")

    def _next(self) -> tuple[str, str]:
        """Return the token ahead, and advance."""
        before = self._kind, self._word
        while self._place < len(self._text):
            self._start = self._place
            found = _TOKEN.match(self._text, self._place)
            if found is None:
                raise self._fail(f"{self._text[self._place : self._place + 20]!r} is not read")
            self._place = found.end()
            if found.lastgroup != "space":
                self._kind, self._word = str(found.lastgroup), found.group()
                return before
        self._kind, self._word, self._start = "end", "", self._place
        return before

    def _take(self, kind: str, *words: str) -> str:
        if self._kind != kind or (words and self._word not in words):
            wanted = " or ".join(map(repr, words)) or f"a {kind}"
            raise self._unexpected(wanted, self._word)
        return self._next()[1]

    def _skip(self, *words: str) -> bool:
        """Whether one of some words is ahead; it is consumed."""
        found = self._kind in ("mark", "word") and self._word in words
        if found:
            self._next()
        return found

    def _deeper(self) -> None:
        self._depth += 1
        if self._depth > DEPTH_LIMIT:
            raise self._fail(f"more than {DEPTH_LIMIT} prims or values within each other")

    def layer(self) -> Prim:
        root = Prim("", "", self._metadata())
        while self._kind != "end":
            root.children.append(self._prim())
        return root

    def _prim(self) -> Prim:
        self._deeper()
        self._take("word", *_SPECIFIERS)
        kind = self._next()[1] if self._kind == "word" else ""
        prim = Prim(kind, _text(self._take("string")), self._metadata())
        self._take("mark", "{")
        while not self._skip("}"):
            if self._kind == "word" and self._word in _SPECIFIERS:
                prim.children.append(self._prim())
            elif self._word == "variantSet":
                raise self._fail("has variants, which are not read; flatten the layer")
            elif not self._skip(";"):
                name, found = self._property()
                prim.properties[name] = found
        self._depth -= 1
        return prim

    def _property(self) -> tuple[str, Property]:
        while self._skip(*_EDITS, *_QUALIFIERS):
            pass
        kind = self._take("word")
        if self._skip("["):
            self._take("mark", "]")
            kind += "[]"
        name = self._take("word")
        value = self._value() if self._skip("=") else None
        return name, Property(kind, value, self._metadata())

    def _metadata(self) -> dict[str, Any]:
        """The entries in parentheses, by name; texts without a name are comments."""
        found: dict[str, Any] = {}
        if not self._skip("("):
            return found
        while not self._skip(")"):
            if self._kind == "string" or self._skip(";", ","):
                if self._kind == "string":
                    self._next()
                continue
            self._skip(*_EDITS)
            name = self._take("word")
            self._take("mark", "=")
            found[name] = self._value()
        return found

    def _value(self) -> Any:
        kind, word = self._next()
        if kind == "string":
            return _text(word)
        if kind == "number":
            return float(word)
        if kind == "path":
            return Path(word[1:-1])
        if kind in ("word", "asset"):
            return word
        if word in _CLOSING and kind == "mark":
            self._deeper()
            found = self._entries() if word == "{" else self._items(_CLOSING[word])
            self._depth -= 1
            return found
        raise self._unexpected("a value", word)

    def _items(self, closing: str) -> tuple[Any, ...]:
        found = []
        while not self._skip(closing):
            found.append(self._value())
            if not self._skip(","):
                self._take("mark", closing)
                break
        return tuple(found)

    def _entries(self) -> dict[str, Any]:
        """A dictionary of typed values, or samples by time."""
        found: dict[str, Any] = {}
        while not self._skip("}"):
            if self._kind == "number":
                name = self._next()[1]
                self._take("mark", ":")
            else:
                self._take("word")
                if self._skip("["):
                    self._take("mark", "]")
                name = _text(self._next()[1])
                self._take("mark", "=")
            found[name] = self._value()
            self._skip(",", ";")
        return found


def _text(word: str) -> str:
    """The content of a token, without quotes and escapes."""
    if word[:1] not in ("'", '"'):
        return word
    size = 3 if len(word) >= 6 and word[:3] == word[:1] * 3 else 1
    return re.sub(r"\\(.)", lambda m: _ESCAPES.get(m[1], m[1]), word[size:-size], flags=re.DOTALL)


def quoted(text: str) -> str:
    """A text as a layer writes it."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{plain}"'
