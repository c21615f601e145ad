"""Maps of the hemisphere: where a property of a material is violated."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np

from nacre.errors import require
from nacre.figures.page import FAINT, INK, RULE, magma
from nacre.soundness import Outcome

_SIZE, _DPI = 2.4, 110  # inches and pixels per inch
_POINTS = 4000
_RINGS = 30.0, 60.0, 90.0  # degrees


def hemisphere_map(outcome: Outcome) -> Any:
    """A Matplotlib figure of the violation over directions to the light.

    The middle is the normal, the rim the horizon, and the distance from the middle the polar angle.
    Dots are gray where there is no violation, and darker the larger it is, up to the largest or
    the limit, whichever is more; what is not finite is red. Of more than 4,000 directions those
    with the largest violations are drawn, and others at even steps.

    Raises MissingExtraError if Matplotlib is not installed.
    """
    figures = require("matplotlib.figure", "plot")
    patches = require("matplotlib.patches", "plot")
    figure = figures.Figure((_SIZE, _SIZE), dpi=_DPI, facecolor="white")
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set(xlim=(-97.0, 97.0), ylim=(-97.0, 97.0))
    for ring in _RINGS:
        axes.add_patch(patches.Circle((0.0, 0.0), ring, fill=False, color=RULE, linewidth=0.8))
        axes.text(0.0, ring, f"{ring:g}", fontsize=6, color=FAINT, ha="center", va="bottom")
    violation = np.where(np.isfinite(outcome.violation), outcome.violation, np.inf)
    order = np.argsort(violation, kind="stable")
    if len(order) > _POINTS:
        half = _POINTS // 2
        rest = order[:-half]
        order = np.concatenate([rest[:: max(1, len(rest) // half)], order[-half:]])
    wi, values = outcome.wi[order], violation[order]
    theta = np.degrees(np.arctan2(np.hypot(wi[:, 0], wi[:, 1]), wi[:, 2]))
    phi = np.arctan2(wi[:, 1], wi[:, 0])
    finite = np.isfinite(values)
    largest = float(values[finite].max(initial=0.0))
    colors = np.full((len(values), 3), 0.86)
    marked = finite & (values > 0.0)
    scale = max(largest, outcome.limit if outcome.limit < 1.0 else 0.0)
    colors[marked] = magma(1.0 - 0.9 * values[marked] / scale)
    colors[~finite] = (0.84, 0.15, 0.16)
    size = 2.0 if len(values) > 500 else 14.0
    axes.scatter(theta * np.cos(phi), theta * np.sin(phi), c=colors, s=size, linewidths=0.0)
    axes.text(-95.0, -95.0, f"largest {largest:.2g}", fontsize=6, color=INK)
    return figure


def inlined(figure: Any) -> str:
    """A figure as the address of a PNG that a page holds itself."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
