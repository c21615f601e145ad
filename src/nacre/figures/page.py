"""A page on which pictures and text are placed in inches."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import require
from nacre.figures.polar import INK

Floats = npt.NDArray[np.floating]

_PAPER = "#dcdcd9"
"""Darker than a white sphere."""


class Page:
    """A figure on which things are placed in inches from the upper left."""

    def __init__(self, size: tuple[float, float]) -> None:
        figures = require("matplotlib.figure", "plot")
        self.width, self.height = size
        self.figure = figures.Figure(figsize=size, facecolor=_PAPER)

    def image(self, x: float, y: float, side: float, pixels: Floats) -> None:
        """A square picture of display values."""
        shown = np.clip(pixels, 0.0, 1.0)
        self.axes(x, y, side, side).imshow(shown, interpolation="antialiased")

    def text(self, x: float, y: float, text: str, **options: Any) -> None:
        """Text; see Matplotlib for the options."""
        options = {"color": INK, "fontsize": 7, "parse_math": False} | options
        self.figure.text(x / self.width, 1.0 - y / self.height, text, **options)

    def axes(self, x: float, y: float, width: float, height: float) -> Any:
        """Axes without a frame."""
        box = (x / self.width, 1.0 - (y + height) / self.height)
        axes = self.figure.add_axes((*box, width / self.width, height / self.height))
        axes.set_axis_off()
        return axes


def broken(name: str, length: int = 17) -> str:
    """A long name in lines, broken at dashes and underscores."""
    lines = [""]
    for part in name.replace("_", "_ ").replace("-", "- ").split():
        if lines[-1] and len(lines[-1]) + len(part) > length:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)
