"""Charts of numbers: how lines and axes look, and the names of points."""

from __future__ import annotations

from typing import Any

from nacre.array import Floats
from nacre.errors import require
from nacre.figures.page import FAINT, INK
from nacre.figures.plot import COLORS

_DASHES = ("-", "o"), ("--", "s"), (":", "^"), ("-.", "D")

_GRID = "#e4e4e1"


def charts(count: int, width: float, height: float) -> tuple[Any, list[Any]]:
    """A figure of some inches, and axes side by side in it."""
    figure = require("matplotlib.figure", "plot").Figure(
        (width, height), facecolor="white", layout="constrained"
    )
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def color_of(index: int) -> str:
    """One of :data:`COLORS`, again from the first after the last."""
    return COLORS[index % len(COLORS)]


def line_style(index: int) -> dict[str, Any]:
    """How the line of one of several series looks: its color, its dashes, and its points.

    Lines of the same color differ in dashes and points.
    """
    dashes, marker = _DASHES[index // len(COLORS) % len(_DASHES)]
    return {
        "color": color_of(index),
        "linestyle": dashes,
        "marker": marker,
        "markersize": 3,
        "linewidth": 1.2,
    }


def _label(value: float, _position: int | None = None) -> str:
    """The number at a tick of a logarithmic axis, if it begins with 1, 2 or 5."""
    return f"{value:,.10g}" if f"{value:e}"[0] in "125" else ""


def dress(
    axes: Any, title: str = "", x: str = "", y: str = "", log: str = "", grid: str = "both"
) -> None:
    """Titles, a faint grid and no frame.

    Parameters
    ----------
    axes
        Of Matplotlib.
    title, x, y
        Above, below and beside them.
    log
        Names of the axes that are logarithmic, as in "xy".
    grid
        "x", "y" or "both".
    """
    for name in log:
        axes.set(**{f"{name}scale": "log"})
        axis = getattr(axes, f"{name}axis")
        for set_formatter in (axis.set_major_formatter, axis.set_minor_formatter):
            set_formatter(_label)
    axes.set_title(title, fontsize=9, color=INK)
    axes.set_xlabel(x, fontsize=8, color=FAINT)
    axes.set_ylabel(y, fontsize=8, color=FAINT)
    axes.tick_params(which="both", length=0, labelsize=8, labelcolor=INK)
    axes.grid(axis=grid, color=_GRID, linewidth=0.5)
    axes.set_axisbelow(True)
    for spine in axes.spines.values():
        spine.set_visible(False)


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

    `textalloc` finds the places, on axes with their limits and the figure's size set.

    Parameters
    ----------
    points
        In data units, shape (n, 2).
    colors
        Of the text; one of each label where it is a list.
    obstacles
        What labels keep off, in data units, shape (m, 2); the points where None.
    distance
        Least distance of a text from its point, as a fraction of the axes.
    """
    import textalloc  # only here: listing experiments needs no charts

    kept_free = points if obstacles is None else obstacles
    limits = {"xlim": axes.get_xlim(), "ylim": axes.get_ylim()}
    textalloc.allocate(
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
    axes.set(**limits)


def broken(name: str, length: int = 17) -> str:
    """A long name in lines, broken at dashes and underscores."""
    lines = [""]
    for part in name.replace("_", "_ ").replace("-", "- ").split():
        if lines[-1] and len(lines[-1]) + len(part) > length:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)
