"""The manifest of a library: which fits it holds, and from which files.

It is a file with one JSON object per line, in the folder of the fits. A line is added when a
material is begun or finished; the last line about a material counts. An incomplete line, which a
killed process or a full disk may leave, is ignored and so costs only its own material. At the end
of a run the file is rewritten with one line per material.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Container
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, get_type_hints

from nacre.errors import FormatError
from nacre.io.files import PathLike, append_line, atomic_path, check_regular

MANIFEST = "library.jsonl"
_SIZE_LIMIT = 1 << 28  # bytes: about 500,000 materials, or half as many during a run


@dataclass(frozen=True)
class Record:
    """One material of a library.

    `sha256`, `size` and `modified` describe the measured file, and are None if it could not be
    read. `code` is that of :meth:`nacre.workflows.Fitting.code`, None if it is not known, as for
    fits by nacre 0.1.0. A failure has an `error` and no `output_sha256`.
    """

    source: str  # measured file, relative to the given folder
    sha256: str | None  # in hexadecimal
    size: int | None  # bytes
    modified: int | None  # time of the last change in ns
    settings: str  # SHA-256 of the settings of the fit
    nacre: str  # version that made the fit
    output: str  # fitted file, relative to the library
    output_sha256: str | None = None
    losses: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    error: str | None = None
    code: str | None = None

    @property
    def _material(self) -> tuple[str, str]:
        """A source may have both a neural and an analytic fit in a library."""
        return self.source, PurePosixPath(self.output).suffix


_TYPES: dict[str, Any] = get_type_hints(Record) | {"losses": dict, "seconds": int | float}
"""JSON types of the fields in a file, which anyone may have edited."""


class Manifest:
    """The manifest of a folder; threads may share it, processes may not.

    The file is made when the first record is kept. A FormatError is raised if there is a file that
    cannot be read.
    """

    def __init__(self, folder: PathLike) -> None:
        self.path = Path(folder) / MANIFEST
        self._records: dict[str, Record] = {}
        self._outputs: dict[tuple[str, str], str] = {}
        self._lock = threading.Lock()
        if self.path.is_symlink():
            raise FormatError(f"{self.path}: is a symbolic link; remove it or name another folder")
        try:
            if check_regular(self.path) > _SIZE_LIMIT:
                raise FormatError(
                    f"{self.path}: is larger than {_SIZE_LIMIT >> 20} MiB; name another folder"
                )
            with self.path.open(encoding="utf-8", errors="replace") as file:
                for line in file:
                    if record := _parse(line):
                        self._add(record)
        except FileNotFoundError:
            return
        except OSError as error:
            raise FormatError(f"{self.path}: cannot be read: {error.strerror}") from error

    def records(self) -> list[Record]:
        """All records, one per fitted file, sorted by its name."""
        with self._lock:
            return [self._records[output] for output in sorted(self._records)]

    def find(self, output: str) -> Record | None:
        """The record of a fitted file, named relative to the folder; None if there is none."""
        with self._lock:
            return self._records.get(output)

    def keep(self, record: Record) -> None:
        """Add a record, or replace that of the same material, here and in the file.

        A FormatError is raised if the file cannot be written; the record then counts until the
        process ends.
        """
        with self._lock:
            self._add(record)
            try:
                self._append(_line(record))
            except OSError as error:
                reason = error.strerror or error
                raise FormatError(f"{self.path}: cannot be written: {reason}") from error

    def tidy(self, wanted: Container[str]) -> None:
        """Rewrite the file with one line per material, and only the `wanted` outputs' failures.

        If that fails, as on a full disk, the old file stays, with the same meaning.
        """
        with self._lock:
            for output, record in list(self._records.items()):
                if record.error is not None and output not in wanted:
                    del self._records[output]
            text = "".join(_line(self._records[output]) for output in sorted(self._records))
            with suppress(FormatError):
                if not self.path.exists() or self.path.read_bytes() != text.encode():
                    with atomic_path(self.path, internal=True) as temporary:
                        temporary.write_text(text, encoding="utf-8", newline="\n")

    def _add(self, record: Record) -> None:
        before = self._outputs.get(record._material)
        if before not in (None, record.output):
            self._records.pop(str(before), None)
        self._outputs[record._material] = record.output
        self._records[record.output] = record

    def _append(self, line: str) -> None:
        """Add a line to the file; a method, so that tests can simulate a full disk."""
        append_line(self.path, line)


def _line(record: Record) -> str:
    return json.dumps(asdict(record)) + "\n"


def _parse(line: str) -> Record | None:
    """The record in a line; None if it is incomplete."""
    try:
        content: Any = json.loads(line)
    except (ValueError, RecursionError):
        return None
    whole = (
        isinstance(content, dict)
        and content.keys() | {"code"} == _TYPES.keys()
        and all(isinstance(content.get(name), kinds) for name, kinds in _TYPES.items())
    )
    return Record(**content) if whole else None
