"""Figure 15: the kitchen, crops of it with every sampler, and the places of the materials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.errors import require
from nacre.figures.page import FAINT, INK, Figure, Page
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.passes import accumulate
from nacre.mitsuba.scene import matte
from nacre_lab.reproduce.kitchen import SLOTS, describe_kitchen
from nacre_lab.reproduce.noise import NoiseStudy


class Crop(NamedTuple):
    """A part of a picture: its name, left, top and size, as fractions of the picture's edges."""

    name: str
    left: float
    top: float
    size: float

    def of(self, picture: Floats) -> Floats:
        """The part of a picture of shape (height, width, 3)."""
        height, width, _ = picture.shape
        top, left = round(self.top * height), round(self.left * width)
        return picture[
            top : top + round(self.size * height), left : left + round(self.size * width)
        ]


CROPS = Crop("A", 0.28, 0.37, 0.24), Crop("B", 0.28, 0.08, 0.24), Crop("C", 0.68, 0.58, 0.24)
"""The stove, the hood above it, and the table."""

_PICTURE, _CROP, _LEGEND = 4.0, 1.3, 2.2
"""Inches: width of a picture, of a crop, and of the names of materials."""
_EDGE, _GAP, _HEAD, _CAPTION, _LINE = 0.25, 0.06, 0.3, 0.36, 0.2
"""Inches: left margin, space between, heights of titles, of captions and of a line of names."""
_SAMPLES = 16
"""Of a pixel of the key: its edges are smooth."""


def colors(count: int) -> Floats:
    """Display colors that tell materials apart, shape (count, 3), for one in each of the slots."""
    palette = require("matplotlib", "plot").colormaps["Paired"].colors
    return np.array(palette[: min(count, len(SLOTS))])


def color_key(count: int, size: tuple[int, int]) -> Floats:
    """The kitchen with a flat color for each material, in display values.

    Parameters
    ----------
    count
        Materials; see :func:`nacre_lab.reproduce.kitchen.describe_kitchen`.
    size
        Width and height in pixels.

    Returns
    -------
    array
        Shape (height, width, 3); gray where no material of the study is.
    """
    mi = mitsuba()
    flat = [matte(*color) for color in (colors(count) ** 2.2).tolist()]
    scene = mi.load_dict(describe_kitchen(flat, size))
    albedo = mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
    ((_, seen),) = accumulate(scene, [_SAMPLES], 0, integrator=albedo)
    return tone_map(seen[..., -3:])


def kitchen_page(study: NoiseStudy, samplers: Sequence[str]) -> Figure:
    """Reference, color key with the names of the materials, and crops by every sampler.

    Parameters
    ----------
    study
        Of one picture of :func:`nacre_lab.reproduce.kitchen.describe_kitchen`.
    samplers
        Columns, behind that of the reference.
    """
    ((name, truth),) = study.references.items()
    names, settings = [brdf.name for brdf in study.groups[name]][: len(SLOTS)], study.settings
    ratio = settings.size[1] / settings.size[0]
    tall, down = _PICTURE * ratio, _CROP * ratio
    columns = 1 + len(samplers)
    width = max(2 * (_PICTURE + _GAP) + _LEGEND, columns * (_CROP + _GAP)) + _EDGE
    below = _HEAD + max(tall, len(names) * _LINE) + _HEAD
    page = Page(width, below + len(CROPS) * (down + _GAP) + _CAPTION, "white")
    second = _EDGE + _PICTURE + _GAP
    page.text(_EDGE, _HEAD - 0.1, f"reference, {settings.reference} samples")
    page.text(second, _HEAD - 0.1, "materials")
    whole = page.image(_EDGE, _HEAD, _PICTURE, tall, tone_map(truth))
    _frame(whole, truth)
    sharp = 2 * settings.size[0], 2 * settings.size[1]
    page.image(second, _HEAD, _PICTURE, tall, color_key(len(names), sharp))
    _legend(page, second + _PICTURE + 2 * _GAP, names)
    pictures = [truth, *(study.found[name, sampler].picture for sampler in samplers)]
    at = settings.counts.index(settings.shown)
    for i, picture in enumerate(pictures):
        x = _EDGE + i * (_CROP + _GAP)
        title, caption = "reference", ""
        if i:
            found, title = study.found[name, samplers[i - 1]], samplers[i - 1]
            caption = f"RMSE {found.errors['RMSE'][at]:.4f}\n{found.seconds[at]:.1f} s"
        page.text(x, below - 0.1, title, 8.0, limit=_CROP)
        for j, crop in enumerate(CROPS):
            y = below + j * (down + _GAP)
            page.image(x, y, _CROP, down, tone_map(crop.of(picture)), smooth=False)
            if not i:
                page.text(0.5 * _EDGE, y + 0.5 * down, crop.name, ha="center", va="center")
        foot = below + len(CROPS) * (down + _GAP)
        page.text(x, foot, caption or f"{settings.shown} samples:", 8.0, FAINT, va="top")
    return page.figure


def _frame(axes: Figure, picture: Floats) -> None:
    """Mark the crops on the axes of a picture of shape (height, width, 3)."""
    patches = require("matplotlib.patches", "plot")
    height, width, _ = picture.shape
    for crop in CROPS:
        corner = crop.left * width, crop.top * height
        size = crop.size * width, crop.size * height
        for color, line in (INK, 2.2), ("white", 1.0):
            style = {"fill": False, "edgecolor": color, "linewidth": line}
            axes.add_patch(patches.Rectangle(corner, *size, **style))
        box = {"facecolor": "white", "edgecolor": INK, "linewidth": 0.5, "pad": 1.5}
        axes.text(*corner, crop.name, fontsize=8, color=INK, va="top", bbox=box)


def _legend(page: Page, x: float, names: Sequence[str]) -> None:
    """A swatch and a name for each material, one below the other."""
    side = 0.6 * _LINE
    for index, (name, color) in enumerate(zip(names, colors(len(names)), strict=True)):
        y = _HEAD + index * _LINE
        page.image(x, y, side, side, color[None, None], smooth=False)
        where = x + _LINE, y + 0.5 * side
        page.text(*where, name, 8.0, va="center", limit=_LEGEND - 2 * _LINE)
