"""Polar plots of lobes in the plane of incidence, with materials on top of each other."""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.errors import FormatError, NacreError, require
from nacre.figures.lobes import Lobe, lobe
from nacre.figures.page import DPI, FAINT, INK, RULE, Page
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike, atomic_path
from nacre.latent.estimates import bounds, plausible

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""The palette of Okabe and Ito, for all kinds of color vision."""

PLOTS = (".png", ".svg", ".pdf")
"""Endings of the files that :func:`write_plot` writes."""

_RGB = ("red", "green", "blue")
CHANNELS = ("luminance", *_RGB, "rgb")
"""The ways to draw a color; "rgb" is a row of panels for each channel."""

INCIDENCE = tuple(math.radians(degrees) for degrees in (15.0, 45.0, 75.0))
"""Default polar angles of the light."""

MAX_MATERIALS = 7
"""The number of distinguishable colors."""

_REFERENCE = "#a3a6ab"

_MAX_DECADES = 6
_INNER = math.radians(85.0)
_MARGIN, _FOOTER, _PIECE = 0.2, 0.36, 0.32  # inches: both sides, below the panels, lines in the key
_NOTE_DENSITY = 17  # characters of the note per inch
_KEY_SIZE = 9  # points of the materials' names
_ALL_LABELLED = 5  # with more rings than this, every other one has a label
_EXTENT = (1.28, -0.14, 1.34)  # half the width, the lower and the upper edge, in radii
_PANEL = (2.0 * _EXTENT[0] * 1.25, (_EXTENT[2] - _EXTENT[1]) * 1.25)  # inches

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
    """Draw lobes on a logarithmic polar scale, with a panel for each angle of incidence.

    Light comes from the left; the mirror direction is on the right. Lines have gaps where f_r is
    unknown. The first of several materials is a wide gray line below the others. For materials
    known from few samples, a band shows where f_r lies with 90 % probability.

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
        Value at the center in 1/sr; lower values are drawn there, too. By default the power of ten
        below all values except near the horizon, at most seven decades below the largest.

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
    check_count(len(materials))
    lobes = {
        name: [lobe(brdf, angle, azimuth) for angle in incidence]
        for name, brdf in materials.items()
    }
    bands = {name: _bands(materials[name], each) for name, each in lobes.items()}
    rows = _RGB if channel == "rgb" else (channel,)
    low, high = _range([item for each in lobes.values() for item in each], rows, cosine, floor)

    what = "f_r × cosine of the viewer" if cosine else "f_r"
    what += "" if channel == "rgb" else f", {channel}"
    plane = f"; plane at azimuth {math.degrees(azimuth):g}°" if azimuth else ""
    note = f"{what}, in 1/sr, log scale; {_readable(10.0**low)} and less at the center{plane}"
    if any(bands.values()):
        note += "; bands hold 90 %"

    width = len(incidence) * _PANEL[0]
    places, top = key_places(list(lobes), width)
    note = textwrap.fill(note, int(width * _NOTE_DENSITY))
    bottom = _FOOTER + 0.14 * note.count("\n")
    page = Page(width + 2.0 * _MARGIN, top + len(rows) * _PANEL[1] + bottom, "white")
    for j, row in enumerate(rows):
        for i, angle in enumerate(incidence):
            axes = page.axes(_MARGIN + i * _PANEL[0], top + j * _PANEL[1], *_PANEL)
            _draw_grid(axes, angle, low, high, row if channel == "rgb" else "")
            for k, (name, each) in enumerate(lobes.items()):
                values, style = _values(each[i], row, cosine), line_style(k, len(lobes))
                _draw_curve(axes, each[i].theta, values, low, high, style)
                if bands[name]:
                    ends = (_values(end, row, cosine) for end in bands[name][i])
                    radii = tuple(_radii(end, low, high) for end in ends)
                    _draw_band(axes, each[i].theta, radii, style["color"])
    draw_key(page, places)
    page.text(_MARGIN, page.height - 0.14, note, 8.0, FAINT, va="bottom")
    return page.figure


def check_count(count: int) -> None:
    """Raise NacreError if a plot cannot show that many materials."""
    if not 0 < count <= MAX_MATERIALS:
        raise NacreError(f"a plot shows 1 to {MAX_MATERIALS} materials, not {count}")


def check_plot_path(path: PathLike) -> Path:
    """The path, after checking its ending and that Matplotlib is there; call it before work.

    Raises FormatError if the ending is none of :data:`PLOTS`.
    """
    path = Path(path)
    if path.suffix.lower() not in PLOTS:
        raise FormatError(f"{path}: a plot ends in one of {', '.join(PLOTS)}")
    require("matplotlib.figure", "plot")
    return path


def write_plot(figure: Any, path: PathLike) -> None:
    """Write a Matplotlib figure, whole or not at all; the same figure gives the same bytes.

    Raises
    ------
    FormatError
        If the ending is not `.png`, `.svg` or `.pdf`, or the file cannot be written.
    MissingExtraError
        If Matplotlib is not installed.
    """
    path = check_plot_path(path)
    ending = path.suffix.lower()[1:]
    date = {"png": "Software", "svg": "Date", "pdf": "CreationDate"}[ending]
    settings = {"svg.hashsalt": "nacre", "pdf.fonttype": 42}
    stream = io.BytesIO()  # Matplotlib's own files hide why they cannot be written
    with require("matplotlib", "plot").rc_context(settings):
        figure.savefig(stream, format=ending, dpi=DPI, metadata={date: None})
    with atomic_path(path) as temporary:
        temporary.write_bytes(stream.getvalue())


def _values(item: Lobe, channel: str, cosine: bool) -> Floats:
    """One channel of a lobe, shape (n,); NaN where unknown."""
    rgb = item.intensity() if cosine else item.rgb
    if channel == "luminance":
        return np.asarray(luminance((rgb[:, 0], rgb[:, 1], rgb[:, 2])))
    return np.asarray(rgb[:, _RGB.index(channel)])


def _range(
    lobes: Sequence[Lobe], channels: Sequence[str], cosine: bool, floor: float | None
) -> tuple[float, float]:
    """Decimal logarithms of the values at the center and at the rim.

    Values close to the horizon can be arbitrarily small and do not affect the center.
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


def _bands(brdf: Brdf, lobes: Sequence[Lobe]) -> list[tuple[Lobe, Lobe]]:
    """The lower and upper ends of f_r along lobes; none if the material has no uncertainty."""
    if not plausible(brdf):
        return []
    found = []
    for item in lobes:
        wi = join(from_spherical(item.incidence, item.azimuth + math.pi))
        wo = join(from_spherical(item.theta, item.azimuth))
        low, high = (replace(item, rgb=end) for end in bounds(brdf, wi, wo))
        found.append((low, high))
    return found


def line_style(index: int, count: int) -> dict[str, Any]:
    """Matplotlib's settings of the line of one of so many materials."""
    if count > 1 and index == 0:
        return {"color": _REFERENCE, "linewidth": 3.2, "solid_capstyle": "butt"}
    return {"color": COLORS[index - (count > 1)], "linewidth": 1.2, "solid_capstyle": "round"}


def key_places(names: Sequence[str], width: float) -> tuple[list[Place], float]:
    """Places for the names in the key, in rows, in inches from the upper left; and its height.

    A name that is too long for a row loses its middle.
    """
    ruler = Page(1.0, 1.0)
    x, y, places = 0.0, 0.22, []
    for name in names:
        text = ruler.text(0.0, 0.0, name, _KEY_SIZE, limit=width - _PIECE)
        step = ruler.text_width(text) + _PIECE + 0.3
        if x > 0.0 and x + step > width:
            x, y = 0.0, y + 0.2
        places.append((text.get_text(), _MARGIN + x, y))
        x += step
    return places, y + 0.12


def draw_key(page: Page, places: Sequence[Place]) -> None:
    """Names at the places of :func:`key_places`, with a piece of each line if there are several."""
    for index, (name, x, y) in enumerate(places):
        if len(places) > 1:
            page.line(x, y, x + _PIECE - 0.07, y, **line_style(index, len(places)))
            x += _PIECE
        page.text(x, y, name, _KEY_SIZE, va="center_baseline")


def _readable(value: float) -> str:
    """A value in plain digits if these are few, else as a power of ten."""
    exponent = math.log10(value)
    if abs(exponent) < 2.5 or abs(exponent - round(exponent)) > 1e-9:
        return f"{value:.4g}"
    return "10" + str(round(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _draw_grid(axes: Any, incidence: float, low: float, high: float, title: str) -> None:
    """Rings, spokes, the light and the mirror direction; a title at the lower left."""
    axes.set_axis_off()
    axes.set_xlim(-_EXTENT[0], _EXTENT[0])
    axes.set_ylim(*_EXTENT[1:])
    small = {"color": FAINT, "fontsize": 8, "ha": "center"}
    rule = {"color": RULE, "linewidth": 0.6, "zorder": 0}
    arc = np.radians(np.arange(-90.0, 91.0))
    rings = [(k - low) / (high - low) for k in range(math.floor(low) + 1, math.floor(high) + 1)]
    for exponent, r in enumerate(rings, math.floor(low) + 1):
        axes.plot(r * np.sin(arc), r * np.cos(arc), **rule)
        if len(rings) <= _ALL_LABELLED or (math.floor(high) - exponent) % 2 == 0:
            axes.text(r, -0.03, _readable(10.0**exponent), va="top", **small)
    for degrees in range(-90, 91, 30):
        x, y = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        axes.plot([0.0, x], [0.0, y], **rule)
        if 0 < degrees < 90:
            axes.text(1.07 * x, 1.05 * y, f"{degrees}°", va="center", **small)
    x, y = math.sin(incidence), math.cos(incidence)
    axes.plot([0.0, x], [0.0, y], color=FAINT, linewidth=0.8, linestyle=(0, (1, 2)), zorder=0)
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (-1.01 * x, 1.01 * y), (-1.14 * x, 1.14 * y), arrowprops=arrow)
    label = f"light {math.degrees(incidence):g}°"
    axes.text(-1.16 * x, 1.16 * y, label, color=INK, fontsize=9, ha="center", va="bottom")
    if title:
        axes.text(-1.0, -0.03, title, color=INK, fontsize=9, ha="left", va="top")


def _draw_curve(
    axes: Any, theta: Floats, values: Floats, low: float, high: float, style: Mapping[str, Any]
) -> None:
    """Values (n,) at angles in radians from the normal, with gaps at NaN."""
    r = _radii(values, low, high)
    axes.plot(r * np.sin(theta), r * np.cos(theta), zorder=2, **style)


def _draw_band(axes: Any, theta: Floats, radii: Sequence[Floats], color: str) -> None:
    """The area between two curves, at angles (n,) with radii (n,) each."""
    inner, outer = (np.minimum(r, 1.0) for r in radii)
    r, angle = np.concatenate([inner, outer[::-1]]), np.concatenate([theta, theta[::-1]])
    axes.fill(r * np.sin(angle), r * np.cos(angle), color=color, alpha=0.2, linewidth=0, zorder=1)


def _radii(values: Floats, low: float, high: float) -> Floats:
    """Where values are drawn: 0 at the center, 1 at the rim."""
    with np.errstate(divide="ignore", invalid="ignore"):
        r = (np.log10(np.maximum(values, 0.0)) - low) / (high - low)
    return np.asarray(np.clip(r, 0.0, None))
