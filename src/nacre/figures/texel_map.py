"""Draws the map of texels: points by family, names of textures at their texels."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.page import INK, Figure, Page
from nacre.io.files import PathLike
from nacre.io.text_file import write_rows
from nacre.textures.embedding import EmbeddingMap

Places = npt.NDArray[np.float64]

_SIZE, _KEY = 8.0, 1.4  # inches: edge of the map, and width of the key beside it
_DOT, _SQUARE = 9.0, 26.0  # square points
_CLOSE = 0.25  # fraction of a texture's texels that are nearest to its name
_ROUNDS = 2000
_GAP = 0.01  # between boxes that are moved apart, as a fraction of their mean height


def family(name: str) -> str:
    """The name of a kind of materials: the name without a number at its end."""
    return name.rstrip("0123456789").rstrip("_- ") or name


def family_colors(families: Collection[str]) -> dict[str, Any]:
    """A color for each family, in the order of names; they repeat after the 20th."""
    names = sorted(set(families))
    known = require("matplotlib", "plot").colormaps["tab10" if len(names) <= 10 else "tab20"].colors
    return {name: known[index % len(known)] for index, name in enumerate(names)}


def scatter_families(
    axes: Any, places: Places, families: Sequence[str], ringed: npt.NDArray[np.bool_], size: float
) -> None:
    """Draw points in the colors of their families; marked ones are larger and have a ring.

    Places have shape (n, 2), sizes are in square points; each family gets a label.
    """
    of = np.array(families)
    for name, color in family_colors(families).items():
        for ring in (False, True):
            chosen = places[(of == name) & (ringed == ring)]
            style = {"edgecolors": INK, "linewidths": 0.5} if ring else {"linewidths": 0.0}
            label = None if ring and len(places[(of == name) & ~ringed]) else name
            if len(chosen):
                area = 2.0 * size if ring else size
                axes.scatter(*chosen.T, s=area, color=color, label=label, **style)
    _bare(axes)


def _bare(axes: Any) -> None:
    """Hide the scales, which have no meaning; they are equal in both directions."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_aspect("equal", "datalim")


def texel_map_figure(chart: EmbeddingMap, *, new: int = 0, own_colors: bool = False) -> Figure:
    """A map of texels, with each texture named where most of its texels are.

    The last `new` textures have rings and bold names. With `own_colors`, texels are squares in
    their own colors; otherwise they are dots in the family's color.
    """
    width = _SIZE if own_colors else _SIZE + _KEY
    page = Page(width, _SIZE, "white")
    axes = page.axes(0.1, 0.1, _SIZE - 0.2, _SIZE - 0.2)
    ringed = chart.texture >= len(chart.names) - new
    if own_colors:
        _scatter_squares(axes, chart, ringed)
    else:
        families = [family(name) for name in chart.labels]
        scatter_families(axes, chart.places, families, ringed, _DOT)
        style = {"fontsize": 8, "frameon": False, "markerscale": 2.0, "labelcolor": INK}
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **style)
    _name(page, axes, chart, new)
    return page.figure


def write_table(chart: EmbeddingMap, path: PathLike) -> None:
    """Write texels with their textures, places and colors as comma-separated values.

    Raises FormatError if the file cannot be written.
    """
    rows: list[list[object]] = [
        ["texture", "family", "column", "row", "x", "y", "red", "green", "blue"]
    ]
    numbers = np.hstack([chart.places, chart.colors])
    for name, texel, values in zip(chart.labels, chart.xy, numbers, strict=True):
        rows.append([name, family(name), *map(int, texel), *(f"{v:.6g}" for v in values)])
    write_rows(rows, path)


def _scatter_squares(axes: Any, chart: EmbeddingMap, ringed: npt.NDArray[np.bool_]) -> None:
    colors = tone_map(chart.colors)
    for ring in (False, True):
        style = {"edgecolors": INK, "linewidths": 0.6} if ring else {"linewidths": 0.0}
        chosen = ringed == ring
        axes.scatter(
            *chart.places[chosen].T, s=_SQUARE, c=colors[chosen], marker="s", clip_on=False, **style
        )
    _bare(axes)


def middle(places: Places) -> Places:
    """The point in a cloud whose nearest quarter is closest, shape (2,).

    The mean of a cloud in two parts would lie in neither.
    """
    distances = np.linalg.norm(places[:, None] - places, axis=2)
    count = max(1, round(_CLOSE * len(places)))
    reach = np.partition(distances, count - 1, axis=1)[:, count - 1]
    return np.asarray(places[reach.argmin()])


def _name(page: Page, axes: Any, chart: EmbeddingMap, new: int) -> None:
    """Write names of textures at their texels, without overlaps."""
    effects = require("matplotlib.patheffects", "plot")
    halo = [effects.withStroke(linewidth=2.0, foreground="white")]
    size = 7.0 if len(chart.names) > 40 else 9.0
    page.figure.draw_without_rendering()
    dpi = page.figure.dpi
    anchors, texts = [], []
    for index, name in enumerate(chart.names):
        fresh = index >= len(chart.names) - new
        x, y = axes.transData.transform(middle(chart.places[chart.texture == index])) / dpi
        anchors.append((x, page.height - y))
        style: dict[str, Any] = {"ha": "center", "va": "center", "path_effects": halo, "zorder": 5}
        weight = "bold" if fresh else "normal"
        texts.append(page.text(*anchors[-1], name, size, weight=weight, **style))
    boxes = [text.get_window_extent() for text in texts]
    sizes = np.array([(box.width, box.height) for box in boxes]) / dpi
    bounds = np.array([[0.0, 0.0], [_SIZE, page.height]])
    places = apart(np.array(anchors), sizes, bounds)
    for text, (x, y), (to_x, to_y) in zip(texts, anchors, places, strict=True):
        text.set_position((to_x / page.width, 1.0 - to_y / page.height))
        if np.hypot(to_x - x, to_y - y) > size / 72.0:
            page.line(x, y, to_x, to_y, color=INK, linewidth=0.4, alpha=0.5)


def apart(centers: Places, sizes: Places, bounds: Places) -> Places:
    """Centers of boxes, shape (n, 2), moved as little as possible until none overlap.

    They stay between a lower and an upper corner, shape (2, 2); if space is short, some may still
    touch.
    """
    shaken: Places = 1e-4 * sizes.mean() * np.random.default_rng(0).standard_normal(centers.shape)
    found: Places = centers + shaken
    low, high = bounds[0] + 0.5 * sizes, bounds[1] - 0.5 * sizes
    wanted = 0.5 * (sizes[:, None] + sizes) + _GAP * sizes[:, 1].mean()
    for _ in range(_ROUNDS):
        found = np.clip(found, low, np.maximum(low, high))
        between = found[:, None] - found
        over = wanted - np.abs(between)
        np.einsum("iik->ik", over)[:] = 0.0
        hit = (over > 0.0).all(axis=2)
        if not hit.any():
            break
        # Separate along the axis with less overlap, each by half of it.
        along = over.argmin(axis=2)
        step = np.where(hit, over.min(axis=2), 0.0) * 0.5
        for axis in (0, 1):
            sign = np.where(between[..., axis] >= 0.0, 1.0, -1.0)
            found[:, axis] += np.where(along == axis, sign * step, 0.0).sum(axis=1)
    return found
