"""Results as Markdown: one table per split and protocol, one line per method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import fmean

from nacre_lab.benchmark.protocol import MEASURES
from nacre_lab.benchmark.results import Row
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.trial import LIGHTS

SHOWN = (
    "size_bytes",
    *(f"{light}_{key}" for light in LIGHTS for key in ("psnr_db", "ssim", "flip")),
    *("fit_cpu_s", "eval_ns", "noise", "reciprocity_error", "max_albedo"),
)
"""Measures in tables; files hold all."""

_LARGEST = "max_albedo"
"""Measure of which the largest value over materials counts instead of the mean."""


def grouped(rows: Iterable[Row]) -> dict[tuple[str, str], list[Row]]:
    """Comparable rows, by the names of split and protocol."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row.split, str(row.protocol.get("name"))), []).append(row)
    return found


def summary(rows: Sequence[Row], key: str) -> tuple[float | None, int]:
    """Mean of a measure over the rows that have it (for albedos, the largest), and their number."""
    values = [v for row in rows if (v := row.measures.get(key)) is not None]
    if not values:
        return None, 0
    return max(values) if key == _LARGEST else fmean(values), len(values)


def markdown(rows: Iterable[Row], measures: Sequence[str] = SHOWN) -> str:
    """Tables with titles, methods by size; below each, what has no result and why.

    A cell is the mean over the materials; where some have no value, their number follows in
    parentheses. What no material has is a dash.
    """
    parts = []
    for (split, protocol), group in grouped(rows).items():
        by_method: dict[str, list[Row]] = {}
        for row in group:
            if row.unavailable is None:
                by_method.setdefault(row.method, []).append(row)
        materials = {row.material for row in group}
        head = ["method", "materials", *(MEASURES[key].title for key in measures)]
        lines = [
            [f"`{name}`", str(len(found)), *(_cell(found, key) for key in measures)]
            for name, found in sorted(by_method.items(), key=lambda item: _size(item[1]))
        ]
        parts.append(f"## {split}, protocol {protocol}, {len(materials)} materials\n")
        parts.append(markdown_table(head, lines))
        parts.extend(_left_out(group))
    return "\n".join(parts)


def _size(rows: Sequence[Row]) -> float:
    size, _ = summary(rows, "size_bytes")
    return float("inf") if size is None else size


def _cell(rows: Sequence[Row], key: str) -> str:
    value, count = summary(rows, key)
    if value is None:
        return "–"
    text = f"{value:,.{MEASURES[key].digits}f}"
    return text if count == len(rows) else f"{text} ({count})"


def _left_out(rows: Iterable[Row]) -> list[str]:
    found: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if row.unavailable is not None:
            found.setdefault((row.method, row.unavailable), []).append(row.material)
    lines = [f"- `{method}`: {why} ({', '.join(m)})\n" for (method, why), m in found.items()]
    return ["Without a result:\n", "".join(lines)] if lines else []
