"""One half-disc of a polar plot with a logarithmic radius, in Matplotlib."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]

INK, FAINT = "#202124", "#707276"
"""Colors of text that matters and of text that helps."""
_RULE = "#d5d5d2"

_ALL_LABELLED = 5
"""Rings up to which each has a label; of more, every other one."""
_EXTENT = (1.28, -0.14, 1.34)
"""Half the width, the lower and the upper edge, in radii."""
PANEL = (2.0 * _EXTENT[0] * 1.25, (_EXTENT[2] - _EXTENT[1]) * 1.25)
"""Width and height in inches."""


def readable(value: float) -> str:
    """A value in plain digits where these are few, else as a power of ten."""
    exponent = math.log10(value)
    if abs(exponent) < 2.5 or abs(exponent - round(exponent)) > 1e-9:
        return f"{value:.4g}"
    return "10" + str(round(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def draw_grid(axes: Any, incidence: float, low: float, high: float, title: str) -> None:
    """Rings, spokes, the light and the mirror direction.

    Parameters
    ----------
    axes
        Of Matplotlib, of the shape of :data:`PANEL`.
    incidence
        Polar angle of the light in radians.
    low, high
        Decimal logarithms of the values at the center and at the rim.
    title
        To the lower left.
    """
    axes.set_axis_off()
    axes.set_xlim(-_EXTENT[0], _EXTENT[0])
    axes.set_ylim(*_EXTENT[1:])
    small = {"color": FAINT, "fontsize": 6.5, "ha": "center"}
    rule = {"color": _RULE, "linewidth": 0.6, "zorder": 0}
    arc = np.radians(np.arange(-90.0, 91.0))
    rings = [(k - low) / (high - low) for k in range(math.floor(low) + 1, math.floor(high) + 1)]
    for exponent, r in enumerate(rings, math.floor(low) + 1):
        axes.plot(r * np.sin(arc), r * np.cos(arc), **rule)
        if len(rings) <= _ALL_LABELLED or (math.floor(high) - exponent) % 2 == 0:
            axes.text(r, -0.03, readable(10.0**exponent), va="top", **small)
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
    axes.text(-1.16 * x, 1.16 * y, label, color=INK, fontsize=8, ha="center", va="bottom")
    if title:
        axes.text(-1.0, -0.03, title, color=INK, fontsize=8, ha="left", va="top")


def draw_curve(
    axes: Any, theta: Floats, values: Floats, low: float, high: float, style: Mapping[str, Any]
) -> None:
    """Values of shape (n,) against angles in radians from the normal; gaps where they are NaN."""
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.clip((np.log10(np.maximum(values, 0.0)) - low) / (high - low), 0.0, None)
    axes.plot(r * np.sin(theta), r * np.cos(theta), zorder=2, **style)
