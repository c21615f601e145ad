"""Tables as Markdown and comma-separated values, and mean squared errors for them."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from nacre.io.files import atomic_path
from nacre.io.outputs import overwrite
from nacre.io.text_file import write_rows


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, all but its first column aligned right; ends in a line break."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def write_csv(head: Sequence[str], rows: Iterable[Sequence[object]], path: Path) -> None:
    """Write comma-separated values; numbers have six digits.

    A table of the same columns is replaced: such a file has no place to say who wrote it.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    cells = [[f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in rows]
    with overwrite(_has_columns(path, head)):
        write_rows([head, *cells], path)


def _has_columns(path: Path, head: Sequence[str]) -> bool:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return next(csv.reader(file), []) == [*head]
    except (OSError, ValueError, csv.Error):
        return False


def write_text(text: str, path: Path) -> None:
    """Write text completely or not at all.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def scaled(mse: float | None) -> str:
    """A mean squared error in tables: times ten thousand; a dash if there is none."""
    if mse is None or not math.isfinite(mse):
        return "–"
    return f"{1e4 * mse:.0f}" if mse >= 0.01 else f"{1e4 * mse:.3g}"


def geometric_mean(values: Sequence[float]) -> float:
    """Geometric mean of numbers from zero; NaN if there are none."""
    with np.errstate(divide="ignore"):
        return float(np.exp(np.mean(np.log(values)))) if len(values) else math.nan
