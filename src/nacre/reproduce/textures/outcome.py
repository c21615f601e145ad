"""What comes of an experiment, and the files it is written to."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nacre.figures.plot import write_plot
from nacre.io.files import atomic_path
from nacre.io.text_file import write_rows
from nacre.reproduce.summary import table_row


@dataclass(frozen=True)
class Outcome:
    """Numbers and pages.

    Parameters
    ----------
    columns, rows
        Of the CSV file.
    table
        In Markdown.
    pages
        Matplotlib figures by what is added to the experiment's name.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[object]]
    table: str
    pages: Mapping[str, Any]

    def write(self, name: str, text: str, folder: Path) -> list[Path]:
        """Write CSV, Markdown and pictures; gives their paths.

        Parameters
        ----------
        name
            Of the files.
        text
            Of the Markdown; `{table}` in it becomes the table.
        folder
            Which exists.

        Raises
        ------
        FormatError
            If a file cannot be written.
        """
        written = [folder / f"{name}.csv", folder / f"{name}.md"]
        rows = [[f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in self.rows]
        write_rows([self.columns, *rows], written[0])
        with atomic_path(written[1]) as temporary:
            temporary.write_text(text.replace("{table}", self.table), encoding="utf-8")
        for ending, page in self.pages.items():
            written.append(folder / f"{name}{ending}.png")
            write_plot(page, written[-1])
        return written


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown, all but its first column to the right."""
    lines = [table_row(head), "|---" + "|---:" * (len(head) - 1) + "|"]
    return "\n".join([*lines, *map(table_row, rows)])


def scaled(mse: float | None) -> str:
    """A mean squared error as tables show it: times ten thousand; a dash where there is none."""
    if mse is None or not math.isfinite(mse):
        return "–"
    return f"{1e4 * mse:.0f}" if mse >= 0.01 else f"{1e4 * mse:.3g}"


def geometric_mean(values: Sequence[float]) -> float:
    """Of numbers, none below zero; NaN of none."""
    with np.errstate(divide="ignore"):
        return float(np.exp(np.mean(np.log(values)))) if len(values) else math.nan
