"""Labels beside points, so that none covers another: placed by `textalloc`."""

from __future__ import annotations

from typing import Any

from nacre.array import Floats
from nacre.errors import require
from nacre.figures.page import FAINT, INK


def place_labels(
    axes: Any,
    points: Floats,
    labels: list[str],
    *,
    size: float = 8.0,
    colors: str | list[str] = INK,
    obstacles: Floats | None = None,
    distance: float = 0.013,
    **style: Any,
) -> None:
    """Write each label as near to its point as there is room, with a thin line where it is not.

    Parameters
    ----------
    axes
        Of Matplotlib, with their limits and the figure's size set.
    points
        In data units, shape (n, 2).
    labels
        A text for each.
    size
        Points of the text.
    colors
        Of the text; one of each label where it is a list.
    obstacles
        What labels keep off, in data units, shape (m, 2); the points where None.
    distance
        Least distance of a text from its point, as a fraction of the axes.
    style
        Of the text, as Matplotlib takes it.
    """
    kept_free = points if obstacles is None else obstacles
    limits = axes.get_xlim(), axes.get_ylim()
    require("textalloc", "plot").allocate(
        axes,
        *points.T,
        labels,
        x_scatter=kept_free[:, 0],
        y_scatter=kept_free[:, 1],
        textsize=size,
        textcolor=colors,
        min_distance=distance,
        linecolor=FAINT,
        linewidth=0.4,
        avoid_label_lines_overlap=True,
        parse_math=False,
        **style,
    )
    axes.set(xlim=limits[0], ylim=limits[1])
