"""What a library holds, and from what it was made.

The manifest is a file of lines, a JSON object each, in the folder of the fits. A line is added when
a material is begun or finished; of several on one material the last counts. A line that is not
whole, which a killed process or a full disk may leave, is ignored, and so costs no more than its
own material. At the end of a run the file is written anew with one line a material.
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
"""Name of the file."""

_SIZE_LIMIT = 1 << 28
"""Bytes that are read: lines of about 500,000 materials, or of half as many while a run works."""


@dataclass(frozen=True)
class Record:
    """One material of a library.

    Parameters
    ----------
    source
        Measured file, relative to the folder that was given.
    sha256, size, modified
        Of that file: SHA-256 in hexadecimal, bytes, and time of last change in ns. None where the
        file could not be read.
    settings
        SHA-256 of the settings of the fit.
    nacre
        Version that fitted it.
    output
        Fitted file, relative to the library's folder.
    output_sha256
        Of that file; None of a failure.
    losses
        What the fit reports: of a network training and held-out loss.
    seconds
        That the fit took.
    error
        Why there is no fit; None where there is one.
    code
        Fingerprint of the code that decided it, see :meth:`nacre.workflows.Fitting.code`; None
        where it is not known, as of fits of nacre 0.1.0.
    """

    source: str
    sha256: str | None
    size: int | None
    modified: int | None
    settings: str
    nacre: str
    output: str
    output_sha256: str | None = None
    losses: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    error: str | None = None
    code: str | None = None

    @property
    def _material(self) -> tuple[str, str]:
        """A source may have a neural and an analytic fit in one library."""
        return self.source, PurePosixPath(self.output).suffix


_TYPES: dict[str, Any] = get_type_hints(Record) | {"losses": dict, "seconds": int | float}
"""Of the fields in a file, which anyone may have edited, as JSON has them."""


class Manifest:
    """The manifest of one folder; threads may share it, processes may not.

    Parameters
    ----------
    folder
        Where it is, or is made when the first record is kept.

    Raises
    ------
    FormatError
        If there is one that cannot be read.
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
        """Every record, one a fitted file, by the names of these."""
        with self._lock:
            return [self._records[output] for output in sorted(self._records)]

    def find(self, output: str) -> Record | None:
        """The record of a fitted file, given relative to the folder; None where there is none."""
        with self._lock:
            return self._records.get(output)

    def keep(self, record: Record) -> None:
        """Add a record, or replace that of the same material, here and in the file.

        Raises
        ------
        FormatError
            If the file cannot be written; the record counts until the process ends.
        """
        with self._lock:
            self._add(record)
            try:
                self._append(_line(record))
            except OSError as error:
                reason = error.strerror or error
                raise FormatError(f"{self.path}: cannot be written: {reason}") from error

    def tidy(self, wanted: Container[str]) -> None:
        """Write the file anew: one line a material, and of failures only the `wanted` outputs'.

        Where it cannot be written, as on a full disk, it stays as it is, which says the same.
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
        """Add a line to the file on disk; apart, so that a full disk can be tried."""
        append_line(self.path, line)


def _line(record: Record) -> str:
    return json.dumps(asdict(record)) + "\n"


def _parse(line: str) -> Record | None:
    """The record in a line; None where it is not whole."""
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
