"""The page for all pictures: panels, text and color scales, placed in inches.

Sheets are 8 inches wide. A README shows pictures about 800 pixels wide, where a point of text is
1.4 pixels high, so no text on them is smaller than 8 points.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import printable, require
from nacre.mitsuba.sphere import MARGIN

Bytes = npt.NDArray[np.uint8]
Figure: TypeAlias = Any
"""A Matplotlib figure."""

DPI = 160
"""Pixels per inch, unless the pictures on a page need others."""

PAPER, INK, FAINT, RULE = "#ededeb", "#202124", "#65676b", "#d0d0cd"
"""Background of sheets; main text, secondary text, and lines."""

SCALES = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Ends of the color scale for errors: a few fixed steps, so that most sheets share one."""


def magma(values: Floats) -> Floats:
    """Colors in [0, 1], shape (..., 3), for values in [0, 1], shape (...)."""
    colors = np.asarray(require("matplotlib", "plot").colormaps["magma"](np.clip(values, 0.0, 1.0)))
    return np.asarray(colors[..., :3])


def scale_end(errors: Iterable[Floats]) -> float:
    """The first of :data:`SCALES` that covers 99.5 % of the values in every map."""
    peak = max(float(np.percentile(values, 99.5)) for values in errors)
    return next((end for end in SCALES if end >= peak), SCALES[-1])


def scale_note(end: float) -> str:
    """Where the color scale for errors ends: other sheets may have another."""
    return f"colors end at {end:g} on this sheet"


def display_bytes(values: Floats) -> Bytes:
    """Bytes for display values, clipped to [0, 1]."""
    return np.asarray(np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8))


def enlarged(pixels: Any, size: int) -> Any:
    """A picture with pixels repeated as often as its longest edge allows within `size`."""
    factor = max(1, size // max(pixels.shape[:2]))
    return pixels.repeat(factor, axis=0).repeat(factor, axis=1)


class Page:
    """A Matplotlib figure with items placed in inches from the upper left.

    Width and height are in inches; `paper` is the background color. Raises MissingExtraError if
    Matplotlib is not installed.
    """

    def __init__(self, width: float, height: float, paper: str = PAPER, dpi: float = DPI) -> None:
        figures = require("matplotlib.figure", "plot")
        self.size = round(width * dpi), round(height * dpi)
        self.width, self.height = (pixels / dpi for pixels in self.size)
        self.figure = figures.Figure((self.width, self.height), dpi=dpi, facecolor=paper)

    def axes(self, x: float, y: float, width: float, height: float) -> Any:
        """Axes without a frame, whose edges lie between pixels."""
        dpi = self.figure.dpi
        left, right, top, bottom = (round(v * dpi) for v in (x, x + width, y, y + height))
        across, down = self.size
        place = left / across, 1.0 - bottom / down
        axes = self.figure.add_axes((*place, (right - left) / across, (bottom - top) / down))
        axes.set_axis_off()
        return axes

    def image(
        self, x: float, y: float, width: float, height: float, pixels: Floats, smooth: bool = True
    ) -> Any:
        """A picture of display values in [0, 1], shape (height, width, 3 or 4), in a box.

        If `smooth`, enlarging interpolates.
        """
        axes = self.axes(x, y, width, height)
        axes.imshow(
            display_bytes(pixels),  # this rounds, where Matplotlib would truncate
            interpolation="bicubic" if smooth else "nearest",
            aspect="auto",
            interpolation_stage="rgba",
        )
        return axes

    def sphere(self, x: float, y: float, side: float, pixels: Floats) -> None:
        """A picture of a sphere (:mod:`nacre.mitsuba.sphere`) in display values, cut out smoothly.

        Its shape is (size, size, 3), its box a square; pixels outside the sphere are not shown.
        """
        size = len(pixels)
        # Colors just inside the rim continue outwards, so that enlarging mixes in no background.
        axis = np.arange(size) + 0.5 - 0.5 * size
        inside = 0.5 * size * (1.0 - MARGIN)
        shrink = np.minimum(1.0, (inside - 1.0) / np.hypot(axis, axis[:, None]))
        rows = np.floor(axis[:, None] * shrink + 0.5 * size).astype(int)
        axes = self.image(x, y, side, side, pixels[rows, rows.T])
        patches = require("matplotlib.patches", "plot")
        middle = 0.5 * size - 0.5
        rim = patches.Circle((middle, middle), inside, transform=axes.transData)
        axes.images[0].set_clip_path(rim)

    def ring(self, x: float, y: float, radius: float, color: str) -> None:
        """A circle around a place in inches."""
        patches = require("matplotlib.patches", "plot")
        place = x / self.width, 1.0 - y / self.height
        size = 2.0 * radius / self.width, 2.0 * radius / self.height
        style = {"fill": False, "edgecolor": color, "linewidth": 1.6}
        self.figure.add_artist(patches.Ellipse(place, *size, **style))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        size: float = 9.0,
        color: str = INK,
        limit: float | None = None,
        **options: Any,
    ) -> Any:
        """Text at a place in inches; with a `limit`, one line that loses its middle if too wide.

        `options` are Matplotlib's, such as `ha` and `va`; by default the baseline is at `y`.
        """
        place = x / self.width, 1.0 - y / self.height
        options = {"fontsize": size, "color": color, "parse_math": False} | options
        lines = [text] if limit is not None else text.split("\n")
        found = self.figure.text(*place, "\n".join(map(printable, lines)), **options)
        if limit is not None:
            found.set_text(self._shortened(found, limit))
        return found

    def line(self, x: float, y: float, x_end: float, y_end: float, **style: Any) -> None:
        """A line between two places in inches, by default a thin rule; `style` is Matplotlib's."""
        lines = require("matplotlib.lines", "plot")
        ends = [x / self.width, x_end / self.width], [1.0 - v / self.height for v in (y, y_end)]
        style = {"color": RULE, "linewidth": 0.7} | style
        self.figure.add_artist(lines.Line2D(*ends, **style))

    def error_scale(self, x: float, y: float, width: float, end: float) -> None:
        """The colors for errors from 0 to `end`, with numbers below."""
        bar = magma(np.linspace(0.0, 1.0, 256))[None]
        self.image(x, y, width, 0.09, bar)
        for part, align in ((0.0, "left"), (0.5, "center"), (1.0, "right")):
            place = x + part * width, y + 0.11
            self.text(*place, f"{part * end:g}", 8.0, FAINT, ha=align, va="top")

    def pixels(self) -> Bytes:
        """The page as sRGB bytes, shape (height, width, 3)."""
        canvas = require("matplotlib.backends.backend_agg", "plot").FigureCanvasAgg(self.figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def text_width(self, text: Any) -> float:
        """Width in inches of a text from :meth:`text`."""
        return float(text.get_window_extent().width / self.figure.dpi)

    def _shortened(self, text: Any, limit: float) -> str:
        """The longest start and end of a text, joined by an ellipsis, that fit."""
        whole: str = text.get_text()
        if self.text_width(text) <= limit:
            return whole
        low, high, found = 0, min(len(whole), 400), "…"
        while low < high:
            kept = (low + high + 1) // 2
            tail = kept // 2
            trial = f"{whole[: kept - tail]}…{whole[len(whole) - tail :]}"
            text.set_text(trial)
            if self.text_width(text) <= limit:
                low, found = kept, trial
            else:
                high = kept - 1
        return found
