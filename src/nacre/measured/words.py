"""Tables of optical tools as text: words one after another, each as it is expected."""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import numpy as np

from nacre.array import Floats
from nacre.errors import CUT_SHORT, FormatError
from nacre.io.files import PathLike
from nacre.io.text_file import parse_number

_NODE_LIMIT = 4096
_LARGEST = float(np.finfo(np.float32).max)


class Words:
    """The words of numbered lines; a :class:`FormatError` names the path and what is expected."""

    def __init__(self, path: PathLike, lines: Iterable[tuple[int, str]]) -> None:
        self._path = path
        self._lines = iter(lines)
        self._line: list[tuple[int, str]] = []

    def error(self, problem: str) -> FormatError:
        return FormatError(f"{self._path}: {problem}")

    def take(self, expected: str) -> tuple[int, str]:
        """The next word, and the number of its line."""
        while not self._line:
            number, line = next(self._lines, (0, ""))
            if number == 0:
                raise self.error(f"ends before {expected}; {CUT_SHORT}")
            self._line = [(number, word) for word in reversed(line.split())]
        return self._line.pop()

    def skip_line(self) -> None:
        """Leave out the rest of this line, and the next one whatever is in it."""
        self._line = []
        next(self._lines, None)

    def expect(self, expected: str) -> None:
        """Take a word that must be there, in any case."""
        line, word = self.take(expected)
        if word.lower() != expected.lower():
            raise self.error(f"line {line}: {word[:40]!r}, expected {expected} (in any case)")

    def number(self, expected: str) -> float:
        line, word = self.take(expected)
        try:
            value = parse_number(word)
        except ValueError:
            value = np.inf
        if not abs(value) <= _LARGEST:
            problem = f"{word[:40]!r} is not a finite number, expected {expected}"
            raise self.error(f"line {line}: {problem}")
        return value

    def numbers(self, count: int, expected: str) -> Floats:
        return np.fromiter((self.number(f"a number of {expected}") for _ in range(count)), float)

    def count(self, expected: str) -> int:
        """How many nodes of a kind there are."""
        value = self.number(f"how many {expected} there are")
        if not 1 <= value <= _NODE_LIMIT or value != int(value):
            raise self.error(f"{expected}: {value:g}, expected 1 to {_NODE_LIMIT}")
        return int(value)

    def check_angles(self, angles: Floats, name: str, limit: float) -> None:
        """Refuse angles in degrees that do not increase from 0 to a limit."""
        if angles[0] < 0.0 or angles[-1] > limit + 1e-3 or not (np.diff(angles) > 0.0).all():
            raise self.error(f"{name}: must increase from 0 to up to {limit:g} degrees")

    def end(self, *allowed: str) -> None:
        """Refuse words after the last table, but for some."""
        rest = ((number, word) for number, text in self._lines for word in text.split())
        for line, word in itertools.chain(reversed(self._line), rest):
            if word.lower() not in allowed:
                raise self.error(f"line {line}: {word[:40]!r} after the last table")
