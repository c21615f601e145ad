"""What a training writes down as it goes: a table, and events for TensorBoard."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nacre.errors import NacreError, require
from nacre.io.files import append_line, file_errors, write_encoded

COLUMNS = "step", "seconds", "learning_rate", "loss", "validation"
_STEP = re.compile(r"[0-9]{1,18}")
_LONGEST = 80  # characters that the first line may have, and more


class Journal:
    """A context manager that writes a row of a CSV file and TensorBoard events for every report.

    Either may be None. Rows after `step`, where training begins, are removed from the file, so that
    a training that is resumed writes every step once. A :class:`NacreError` says that a file with
    this name is not such a table, or cannot be read or written. `last` is the step of the last row,
    0 where there is none.
    """

    def __init__(self, path: Path | None, step: int = 0, events: Path | None = None) -> None:
        self._events: Any = None
        self._path = path
        rows = [] if path is None else _rows(path, step)
        self.last = int(rows[-1][0]) if rows else 0
        if path is not None:
            text = "".join(_line(row) for row in [COLUMNS, *rows])
            write_encoded(path, str.encode, text, internal=True)
        if events is not None:
            writer = require("tensorboardX", "btf").SummaryWriter
            self._events = writer(str(events), purge_step=step or None)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        if self._events:
            self._events.close()

    def add(
        self, step: int, seconds: float, rate: float, loss: float, validation: float | None
    ) -> None:
        """Write one row; without a validation loss its field is empty."""
        self.last = step
        if self._path is not None:
            last = "" if validation is None else f"{validation:.6g}"
            row = str(step), f"{seconds:.2f}", f"{rate:.6g}", f"{loss:.6g}", last
            with file_errors(self._path, "written"):
                append_line(self._path, _line(row))
        if self._events:
            scalars = {"learning rate": rate, "loss/training": loss}
            if validation is not None:
                scalars["loss/held out"] = validation
            for name, value in scalars.items():
                self._events.add_scalar(name, value, step)


def _line(row: Iterable[str]) -> str:
    line = io.StringIO(newline="")
    csv.writer(line).writerow(row)
    return line.getvalue()


def _rows(path: Path, step: int) -> list[list[str]]:
    """Rows of an earlier training up to a step; none where it begins anew."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        if file.readline(_LONGEST).rstrip("\r\n") not in ("", ",".join(COLUMNS)):
            raise NacreError(f"{path}: is not a training's table; move it, or name another output")
        try:
            rows = [row for row in csv.reader(file) if len(row) == len(COLUMNS)] if step else []
        except csv.Error as error:
            raise NacreError(f"{path}: is damaged ({error}); move it to start a new one") from error
    return [row for row in rows if _STEP.fullmatch(row[0]) and int(row[0]) <= step]
