"""What training writes down as it goes: a table, and events for TensorBoard."""

from __future__ import annotations

import csv
from pathlib import Path
from types import TracebackType
from typing import Any

from nacre.files import require

COLUMNS = "step", "seconds", "learning_rate", "loss", "validation"


class Journal:
    """A CSV file with a row for every report, and TensorBoard events of the same.

    Use as a context manager.

    Parameters
    ----------
    path
        The CSV file; None for none. Rows of steps after `step` are taken out, so that training
        that goes on writes every step once.
    step
        Where training begins.
    events
        Folder for the events; None for none.

    Raises
    ------
    MissingExtraError
        If there is no writer of events.
    """

    def __init__(self, path: Path | None, step: int = 0, events: Path | None = None) -> None:
        self._events: Any = None
        if events is not None:
            writer = require("tensorboardX", "btf").SummaryWriter
            self._events = writer(str(events), purge_step=step or None)
        self._file = None
        if path is not None:
            rows = _rows(path, step)
            self._file = path.open("w", newline="", encoding="utf-8")
            self._table = csv.writer(self._file)
            self._table.writerows([COLUMNS, *rows])

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._file:
            self._file.close()
        if self._events:
            self._events.close()

    def add(
        self, step: int, seconds: float, rate: float, loss: float, validation: float | None
    ) -> None:
        """Write one row; without a validation loss its field is empty."""
        if self._file:
            last = "" if validation is None else f"{validation:.6g}"
            self._table.writerow([step, f"{seconds:.2f}", f"{rate:.6g}", f"{loss:.6g}", last])
            self._file.flush()
        if self._events:
            scalars = {"learning rate": rate, "loss/training": loss}
            if validation is not None:
                scalars["loss/held out"] = validation
            for name, value in scalars.items():
                self._events.add_scalar(name, value, step)


def _rows(path: Path, step: int) -> list[list[str]]:
    """Rows of an earlier training up to a step; none where it begins anew."""
    if not step or not path.exists():
        return []
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        rows = [row for row in csv.reader(file) if len(row) == len(COLUMNS)]
    return [row for row in rows if row[0].isdigit() and int(row[0]) <= step]
