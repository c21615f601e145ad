"""Polar plots of lobes: materials over one another, in the plane of incidence."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.errors import FormatError, NacreError, require
from nacre.figures.lobes import Lobe, lobe
from nacre.figures.polar import FAINT, INK, PANEL, draw_curve, draw_grid, readable
from nacre.io.files import PathLike, atomic_path

Floats = npt.NDArray[np.floating]

PLOTS = (".png", ".svg", ".pdf")
"""Endings of the files that :func:`write_plot` writes."""

CHANNELS = ("luminance", "red", "green", "blue", "rgb")
"""What can be drawn of a color; "rgb" is a row of panels for each channel."""

INCIDENCE = tuple(math.radians(degrees) for degrees in (15.0, 45.0, 75.0))
"""Polar angles of the light that are drawn unless others are asked for."""

MAX_MATERIALS = 7
"""As many as there are colors that can be told apart."""

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Of Okabe and Ito's palette for all kinds of color vision."""
_REFERENCE = "#a3a6ab"

_MAX_DECADES = 6
_INNER = math.radians(85.0)
_MARGIN, _FOOTER, _PIECE = 0.2, 0.36, 0.32
"""Inches at both sides, below the panels, and of a line in the key."""
_NOTE_DENSITY = 17
"""Characters of the note that an inch holds."""
_KEY_SIZE = 9
"""Points of the materials' names."""

Place = tuple[str, float, float]


def lobe_figure(
    materials: Mapping[str, Brdf],
    incidence: Sequence[float] = INCIDENCE,
    *,
    azimuth: float = 0.0,
    channel: str = "luminance",
    cosine: bool = False,
    floor: float | None = None,
) -> Any:
    """Draw lobes on a logarithmic polar scale, a panel for each angle of incidence.

    Light comes from the left, the mirror direction is on the right. Lines have gaps where f_r is
    not known. The first of several materials is a wide gray line beneath the others.

    Parameters
    ----------
    materials
        Reflectances by the names to show, at most :data:`MAX_MATERIALS`.
    incidence
        Polar angles of the light in radians, in [0, pi/2).
    azimuth
        Of the plane, toward the mirror direction, in radians.
    channel
        One of :data:`CHANNELS`.
    cosine
        Whether f_r is multiplied by the cosine of the viewer.
    floor
        Value at the center in 1/sr; lower ones are drawn there. Where None: the power of ten below
        all values but those near the horizon, at most seven decades below the largest.

    Returns
    -------
    matplotlib.figure.Figure
        For :func:`write_plot`, or any use of Matplotlib.

    Raises
    ------
    NacreError
        If there is no material or too many, or nothing is known in this plane.
    ValueError
        If another argument is out of range.
    MissingExtraError
        If Matplotlib is not installed.
    """
    if channel not in CHANNELS:
        raise ValueError(f"channel must be one of {', '.join(CHANNELS)}, got {channel!r}")
    if not incidence:
        raise ValueError("expected at least one angle of incidence")
    if floor is not None and not 0.0 < floor < math.inf:
        raise ValueError(f"floor must be positive, got {floor}")
    if not 0 < len(materials) <= MAX_MATERIALS:
        raise NacreError(f"a plot shows 1 to {MAX_MATERIALS} materials, not {len(materials)}")
    figures = require("matplotlib.figure", "plot")
    lobes = {
        name: [lobe(brdf, angle, azimuth) for angle in incidence]
        for name, brdf in materials.items()
    }
    rows = ("red", "green", "blue") if channel == "rgb" else (channel,)
    low, high = _range([item for each in lobes.values() for item in each], rows, cosine, floor)

    what = "f_r × cosine of the viewer" if cosine else "f_r"
    what += "" if channel == "rgb" else f", {channel}"
    plane = f"; plane at azimuth {math.degrees(azimuth):g}°" if azimuth else ""
    note = f"{what}, in 1/sr, log scale; {readable(10.0**low)} and less at the center{plane}"

    width, height = len(incidence) * PANEL[0], len(rows) * PANEL[1]
    figure = figures.Figure(facecolor="white")
    places, top = _arrange(figure, list(lobes), width)
    note = textwrap.fill(note, int(width * _NOTE_DENSITY))
    bottom = _FOOTER + 0.14 * note.count("\n")
    size = width + 2.0 * _MARGIN, height + top + bottom
    figure.set_size_inches(size)
    for j, row in enumerate(rows):
        for i, angle in enumerate(incidence):
            box = (_MARGIN + i * PANEL[0], bottom + (len(rows) - 1 - j) * PANEL[1], *PANEL)
            axes = figure.add_axes([v / size[k % 2] for k, v in enumerate(box)])
            draw_grid(axes, angle, low, high, row if channel == "rgb" else "")
            for k, each in enumerate(lobes.values()):
                values = _values(each[i], row, cosine)
                draw_curve(axes, each[i].theta, values, low, high, _style(k, len(lobes)))
    _key(figure, places, size)
    figure.text(_MARGIN / size[0], 0.14 / size[1], note, color=FAINT, fontsize=8, va="bottom")
    return figure


def check_plot_path(path: PathLike) -> Path:
    """The path, if a plot can have its ending and Matplotlib is there; to be called before work.

    Raises
    ------
    FormatError
        If its ending is none of :data:`PLOTS`.
    MissingExtraError
        If Matplotlib is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in PLOTS:
        raise FormatError(f"{path}: a plot ends in one of {', '.join(PLOTS)}")
    require("matplotlib.figure", "plot")
    return path


def write_plot(figure: Any, path: PathLike) -> None:
    """Write a figure, whole or not at all; the same figure gives the same bytes.

    Parameters
    ----------
    figure
        Of :func:`lobe_figure`, or any of Matplotlib's.
    path
        `.png`, `.svg` or `.pdf`.

    Raises
    ------
    FormatError
        If the ending is none of these or the file cannot be written.
    MissingExtraError
        If Matplotlib is not installed.
    """
    path = check_plot_path(path)
    ending = path.suffix.lower()[1:]
    date = {"png": "Software", "svg": "Date", "pdf": "CreationDate"}[ending]
    settings = {"svg.hashsalt": "nacre", "pdf.fonttype": 42}
    with require("matplotlib", "plot").rc_context(settings), atomic_path(path) as temporary:
        figure.savefig(temporary, format=ending, dpi=160, metadata={date: None})


def _values(item: Lobe, channel: str, cosine: bool) -> Floats:
    """One channel of a lobe, shape (n,); NaN where it is not known."""
    rgb = item.intensity() if cosine else item.rgb
    if channel == "luminance":
        return np.asarray(luminance((rgb[:, 0], rgb[:, 1], rgb[:, 2])))
    result: Floats = rgb[:, ("red", "green", "blue").index(channel)]
    return result


def _range(
    lobes: Sequence[Lobe], channels: Sequence[str], cosine: bool, floor: float | None
) -> tuple[float, float]:
    """Decimal logarithms of the values at the center and at the rim.

    Close to the horizon values may be as small as they like: they do not move the center.
    """
    theta = np.concatenate([item.theta for item in lobes for _ in channels])
    values = np.concatenate([_values(item, c, cosine) for item in lobes for c in channels])
    if not np.isfinite(values).any():
        raise NacreError("nothing to plot: f_r is not known anywhere in this plane")
    positive = np.where(values > 0.0, values, math.nan)
    if not np.isfinite(positive).any():
        positive = np.ones(len(values))
    high = math.log10(np.nanmax(positive))
    inner = positive[np.isfinite(positive) & (np.abs(theta) < _INNER)]
    low = math.floor(math.log10(inner.min())) if inner.size else -math.inf
    low = math.log10(floor) if floor else max(low, math.floor(high) - _MAX_DECADES)
    return low, max(high, low + 1.0) + 0.05


def _style(index: int, count: int) -> dict[str, Any]:
    """How the lines of a material look."""
    if count > 1 and index == 0:
        return {"color": _REFERENCE, "linewidth": 3.2, "solid_capstyle": "butt"}
    return {"color": COLORS[index - (count > 1)], "linewidth": 1.2, "solid_capstyle": "round"}


def _arrange(figure: Any, names: Sequence[str], width: float) -> tuple[list[Place], float]:
    """Where the key's names go, in inches from the upper left, in rows; and the key's height.

    A name that is too long for a row loses its middle.
    """

    def length(name: str) -> float:
        text = figure.text(0.0, 0.0, name, fontsize=_KEY_SIZE, parse_math=False)
        result: float = text.get_window_extent().width / figure.dpi
        text.remove()
        return result

    x, y, places, room = 0.0, 0.22, [], width - _PIECE
    for name in names:
        half = int(0.5 * len(name) * room / max(length(name), room)) - 2
        short = name if length(name) <= room else f"{name[:half]}…{name[-half:]}"
        step = length(short) + _PIECE + 0.3
        if x > 0.0 and x + step > width:
            x, y = 0.0, y + 0.2
        places.append((short, _MARGIN + x, y))
        x += step
    return places, y + 0.12


def _key(figure: Any, places: Sequence[Place], size: tuple[float, float]) -> None:
    """Names of the materials above the panels, each behind a piece of its line."""
    lines = require("matplotlib.lines", "plot")
    for index, (name, x, down) in enumerate(places):
        y = 1.0 - down / size[1]
        if len(places) > 1:
            ends = [x / size[0], (x + _PIECE - 0.07) / size[0]]
            figure.add_artist(lines.Line2D(ends, [y, y], **_style(index, len(places))))
            x += _PIECE
        options = {"color": INK, "fontsize": _KEY_SIZE, "va": "center_baseline"}
        figure.text(x / size[0], y, name, parse_math=False, **options)
