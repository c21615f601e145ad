"""The results file: a line of JSON for each material and method, only ever added to."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from nacre.errors import FormatError, NacreError
from nacre.io.files import append_line, atomic_path, check_regular, file_errors, read_bytes
from nacre.io.outputs import check_replaceable
from nacre.runtime.lock import exclusive

_MARK = "nacre bench"
_VERSION = 1
_START = f'{{"{_MARK}": '
_LIMIT = 1 << 28


@dataclass(frozen=True)
class Row:
    """What was measured of one material by one method.

    Parameters
    ----------
    split, material, method
        Their names.
    key
        Fingerprint of all that decides the result: the material's content, the method with its
        settings, the protocol, the code.
    about, family
        What the method is; see :class:`nacre_lab.reproduce.trial.Method`.
    protocol
        Name of the protocol and its settings.
    measures
        By the keys of :data:`nacre_lab.benchmark.protocol.MEASURES`; None where there is no value.
    missing
        Why there is none, by key.
    unavailable
        Why the method has nothing for the material, in place of measures; None where it has.
    sha256
        Of the material's file.
    settings
        Of the method, JSON-able.
    versions, machine
        Of libraries by name; the system, processor and number of cores.
    command
        What measures this row again.
    date
        When it was measured, UTC.
    """

    split: str
    material: str
    method: str
    key: str
    about: str = ""
    family: str = ""
    protocol: dict[str, Any] = field(default_factory=dict)
    measures: dict[str, float | None] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    unavailable: str | None = None
    sha256: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    machine: dict[str, Any] = field(default_factory=dict)
    command: str = ""
    date: str = ""


_TYPES = {f.name: str if "str" in str(f.type).partition("[")[0] else dict for f in fields(Row)}
"""Of the values in a line; a row that is not unavailable has null there."""


def read_results(path: Path) -> list[Row]:
    """The rows of a file; of several of one material, method, split and protocol the last.

    A line that is not whole, which a killed process may leave, is passed over.

    Raises
    ------
    FormatError
        If the file cannot be read, or holds something else.
    """
    with file_errors(path):
        if check_regular(path) == 0:
            return []
    text = read_bytes(path, _LIMIT).decode("utf-8", errors="replace")
    if text.strip() and not text.startswith(_START):
        raise FormatError(f"{path}: holds no results of nacre bench")
    found: dict[tuple[str, ...], Row] = {}
    for line in text.split("\n"):
        if row := _parse(line):
            where = row.split, str(row.protocol.get("name")), row.material, row.method
            found.pop(where, None)
            found[where] = row
    return list(found.values())


class Results:
    """A results file that is written; of threads and processes only one may.

    Parameters
    ----------
    path
        The file; made when the first row is kept.
    fresh
        Whether rows that are there count as absent.
    """

    def __init__(self, path: Path, *, fresh: bool = False) -> None:
        self.path = path
        rows = read_results(path) if path.exists() else []
        self._known = {} if fresh else {row.key: row for row in rows}

    def find(self, key: str) -> Row | None:
        """The row of a fingerprint; None where there is none."""
        return self._known.get(key)

    def keep(self, row: Row) -> None:
        """Add a row.

        Raises
        ------
        FormatError
            If the file cannot be written.
        """
        line = json.dumps({_MARK: _VERSION, **asdict(row)}, allow_nan=False) + "\n"
        with file_errors(self.path, "written"):
            append_line(self.path, line)
        self._known[row.key] = row


@contextmanager
def open_results(path: Path, *, fresh: bool = False) -> Iterator[Results]:
    """The results file at a path, for this process alone.

    What is there and holds no results stays, unless outputs may replace anything
    (:func:`nacre.io.outputs.overwrite`).

    Raises
    ------
    FormatError
        If something else is there, or the file cannot be read.
    NacreError
        If another process works on it.
    """
    if path.is_symlink():
        raise FormatError(f"{path}: is a symbolic link; name the file itself")
    if not path.parent.is_dir():
        raise FormatError(f"{path}: folder {path.parent} does not exist; create it first")
    with ExitStack() as stack:
        try:
            stack.enter_context(exclusive(path.with_name(f".{path.name}.lock"), wait=False))
        except BlockingIOError as error:
            raise NacreError(f"{path}: another nacre bench adds to it") from error
        except OSError as error:
            raise FormatError(f"{path}: cannot be written: {error.strerror or error}") from error
        if path.exists():
            _make_room(path)
            with file_errors(path, "written"), path.open("ab"):
                pass  # before hours of work
        yield Results(path, fresh=fresh)


def _make_room(path: Path) -> None:
    """Empty a file that holds something else, where that may be."""
    try:
        read_results(path)
    except FormatError:
        check_replaceable(path)
        with atomic_path(path):
            pass


def _parse(line: str) -> Row | None:
    """The row in a line; None where it is not whole."""
    try:
        content: Any = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(content, dict) or content.pop(_MARK, None) != _VERSION:
        return None
    whole = content.keys() == _TYPES.keys() and all(
        isinstance(content[name], kind) or (name == "unavailable" and content[name] is None)
        for name, kind in _TYPES.items()
    )
    numbers = whole and all(
        value is None or (isinstance(value, int | float) and not isinstance(value, bool))
        for value in content["measures"].values()
    )
    return Row(**content) if numbers else None
