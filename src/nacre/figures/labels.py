"""Labels beside points, so that none covers another."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from nacre.figures.polar import FAINT, INK

_SIZE = 7.0
"""Points of the text."""
_HEIGHT = 0.125
"""Inches that a line takes."""
_MARK = 0.05
"""Inches about a point that are kept free."""

Box = tuple[float, float, float, float]


def place_labels(axes: Any, labels: Sequence[tuple[float, float, str]]) -> None:
    """Write each label as near to its point as there is room, with a thin line where it is not.

    Parameters
    ----------
    axes
        Of Matplotlib, with their limits and the figure's size set.
    labels
        Points in data units, and texts.
    """
    figure = axes.figure
    frame = axes.get_window_extent()
    bounds = [v / figure.dpi for v in (frame.x0, frame.y0, frame.x1, frame.y1)]
    points = [axes.transData.transform((x, y)) / figure.dpi for x, y, _ in labels]
    taken: list[Box] = [(x - _MARK, y - _MARK, x + _MARK, y + _MARK) for x, y in points]
    order = sorted(range(len(labels)), key=lambda i: -points[i][1])
    for i in order:
        x, y = points[i]
        trial = figure.text(0.0, 0.0, labels[i][2], fontsize=_SIZE, parse_math=False)
        width = trial.get_window_extent().width / figure.dpi
        trial.remove()
        dx, dy, box = _free(x, y, width, taken[:i] + taken[i + 1 :], bounds)
        taken.append(box)
        text = {"fontsize": _SIZE, "color": INK, "va": "center", "parse_math": False}
        side = {"ha": "left" if dx >= 0.0 else "right"}
        line = {"arrowstyle": "-", "color": FAINT, "linewidth": 0.4, "shrinkA": 0.0, "shrinkB": 2.0}
        axes.annotate(
            labels[i][2],
            labels[i][:2],
            (72.0 * dx, 72.0 * dy),
            textcoords="offset points",
            arrowprops=line if math.hypot(dx, dy) > 0.15 else None,
            **text,
            **side,
        )


def _free(
    x: float, y: float, width: float, taken: Sequence[Box], bounds: Sequence[float]
) -> tuple[float, float, Box]:
    """Offset in inches of the nearest free place for a text, and the box it takes."""
    first = None
    for radius, turn in itertools.product((0.09, 0.2, 0.32, 0.45, 0.6, 0.8, 1.0, 1.3), range(16)):
        angle = math.pi / 8.0 * ((turn + 1) // 2) * (1 if turn % 2 else -1)
        dx, dy = radius * math.cos(angle), radius * math.sin(angle)
        left = x + dx if dx >= 0.0 else x + dx - width
        box = (left, y + dy - 0.5 * _HEIGHT, left + width, y + dy + 0.5 * _HEIGHT)
        first = first or (dx, dy, box)
        inside = (
            box[0] > bounds[0] and box[1] > bounds[1] and box[2] < bounds[2] and box[3] < bounds[3]
        )
        if inside and not any(_overlap(box, other) for other in taken):
            return dx, dy, box
    assert first is not None
    return first


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
