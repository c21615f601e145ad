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
    """The results of one method on one material.

    Parameters
    ----------
    split, material, method
        Their names.
    key
        Fingerprint of everything that determines the result: the material's content, the method
        with its settings, the protocol, the code.
    about, family
        The method; see :class:`nacre_lab.reproduce.trial.Method`.
    protocol
        Name of the protocol and its settings.
    measures
        Values by the keys of :data:`nacre_lab.benchmark.protocol.MEASURES`; None if there is none.
    missing
        Why a value is None, by key.
    unavailable
        Why the method cannot represent the material, instead of measures; else None.
    sha256
        SHA-256 of the material's file.
    settings
        Settings of the method, JSON-able.
    versions, machine
        Versions of libraries by name; the system, processor and number of cores.
    command
        The command that repeats this row.
    date
        Time of the measurement, UTC.
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
"""Types of the values in a line; `unavailable` may also be null."""


def read_results(path: Path) -> list[Row]:
    """The rows of a file; the last one for each material, method, split and protocol.

    An incomplete line, which a killed process may leave, is skipped.

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
    """A results file to write; only one thread or process may use it.

    Parameters
    ----------
    path
        The file; made when the first row is kept.
    fresh
        Ignore existing rows.
    """

    def __init__(self, path: Path, *, fresh: bool = False) -> None:
        self.path = path
        rows = read_results(path) if path.exists() else []
        self._known = {} if fresh else {row.key: row for row in rows}

    def find(self, key: str) -> Row | None:
        """The row with a fingerprint; None if there is none."""
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

    Another file stays, unless outputs may replace anything
    (:func:`nacre.io.outputs.overwrite`).

    Raises
    ------
    FormatError
        If another file is there, or the file cannot be read.
    NacreError
        If another process is using it.
    """
    if path.is_symlink():
        raise FormatError(f"{path}: is a symbolic link; name the file itself")
    if not path.parent.is_dir():
        raise FormatError(f"{path}: folder {path.parent} does not exist; create it first")
    with ExitStack() as stack:
        try:
            stack.enter_context(exclusive(path.with_name(f".{path.name}.lock"), wait=False))
        except BlockingIOError as error:
            raise NacreError(f"{path}: another nacre bench is adding to it") from error
        except OSError as error:
            raise FormatError(f"{path}: cannot be written: {error.strerror or error}") from error
        if path.exists():
            _make_room(path)
            with file_errors(path, "written"), path.open("ab"):
                pass  # before hours of work
        yield Results(path, fresh=fresh)


def _make_room(path: Path) -> None:
    """Empty a file with other content, if it may be replaced."""
    try:
        read_results(path)
    except FormatError:
        check_replaceable(path)
        with atomic_path(path):
            pass


def _parse(line: str) -> Row | None:
    """The row in a line; None if it is incomplete."""
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
