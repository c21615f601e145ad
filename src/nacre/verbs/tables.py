"""Facts and figures as text and HTML."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any

from nacre.errors import printable


def value_text(value: Any) -> str:
    """A fact for people: few digits, yes or no, lists with commas."""
    if value is None:
        return "unknown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, list | tuple):
        pair = len(value) == 2 and all(isinstance(each, float) for each in value)
        return (" to " if pair else ", ").join(map(value_text, value))
    return printable(str(value))


def text_table(rows: Iterable[Sequence[str]]) -> str:
    """Rows of text in aligned columns, two spaces apart."""
    cells = [list(map(str, row)) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = (
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        for row in cells
    )
    return "\n".join(line.rstrip() for line in lines)


def html_table(rows: Iterable[Sequence[str]]) -> str:
    """Rows of text as a table, the first column as headings."""
    body = (
        f"<tr><th>{html.escape(head)}</th>"
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
        + "</tr>"
        for head, *cells in rows
    )
    return f"<table>{''.join(body)}</table>"
