"""One picture of a comparison: both spheres under both lights, and where they differ."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.errors import printable, require
from nacre.metrics.comparison import Comparison, LightComparison
from nacre.metrics.metrics import flip
from nacre.render.sphere import MARGIN

Floats = npt.NDArray[np.floating]
Bytes = npt.NDArray[np.uint8]

_CELL = 320
_GAP = 28
_MARGIN = 44
_HEADER = 118
_ROW_LABEL = 46
_FOOTER = 96

PAPER = (237, 237, 235)
INK = (32, 33, 36)
FAINT = (112, 114, 118)
RULE = (208, 208, 205)

_SCALES = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Ends of the color scale of errors."""

_MAGMA = np.array(
    [
        [-0.002136485, -0.000749655, -0.005386128],
        [0.251660541, 0.677523244, 2.494026599],
        [8.353717279, -3.577719515, 0.314467903],
        [-27.668733086, 14.264730781, -13.649213188],
        [52.176139812, -27.943606072, 12.944169442],
        [-50.768525365, 29.046582821, 4.234152994],
        [18.655705066, -11.489773520, -5.601961509],
    ]
)
"""Coefficients of Zucker's polynomial approximation (CC0) of the magma color map."""

_NAMES = {"environment": "Environment", "directional": "Directional light, 45°"}


def magma(values: Floats) -> Floats:
    """Colors of display in [0, 1], shape (..., 3), of values in [0, 1], shape (...)."""
    t = np.clip(values, 0.0, 1.0)[..., None]
    colors = np.zeros((*t.shape[:-1], 3))
    for coefficients in _MAGMA[::-1]:
        colors = colors * t + coefficients
    clipped: Floats = np.clip(colors, 0.0, 1.0)
    return clipped


def picture(comparison: Comparison, views: tuple[Floats, Floats] | None = None) -> Bytes:
    """Draw a comparison.

    Rows are lights; columns are the reference, what is judged, and the FLIP map with its scale.
    Pictures are tone mapped as for the metrics and enlarged to a fixed size.

    Parameters
    ----------
    comparison
        What to draw.
    views
        Square linear renderings of both materials in one scene, for another row.

    Returns
    -------
    array of shape (height, width, 3)
        sRGB bytes.

    Raises
    ------
    MissingExtraError
        If Pillow is not installed.
    """
    canvas = require("PIL.Image", "render")
    width = 2 * _MARGIN + 3 * _CELL + 2 * _GAP
    row_count = len(comparison.lights) + (views is not None)
    height = _HEADER + row_count * (_ROW_LABEL + _CELL) + _FOOTER
    image, draw = blank_page(width, height)
    columns = [_MARGIN + i * (_CELL + _GAP) for i in range(3)]
    right = width - _MARGIN

    draw_text(draw, (_MARGIN, 46), comparison.other, 30, limit=right - _MARGIN)
    draw_text(draw, (_MARGIN, 78), f"against {comparison.truth}", 17, FAINT, limit=right - _MARGIN)
    for x, title in zip(columns, ("Reference", "Model", "Difference (FLIP)"), strict=True):
        draw_text(draw, (x + _CELL / 2, _HEADER - 6), title, 17, anchor="ms")

    scale = scale_end(item.flip_map[comparison.mask] for item in comparison.lights)
    y = _HEADER
    for item in comparison.lights:
        draw.line([(_MARGIN, y + 6), (right, y + 6)], fill=RULE)
        draw_text(draw, (_MARGIN, y + 32), _NAMES.get(item.light, item.light), 17)
        draw_text(draw, (right, y + 32), _figures(item), 17, FAINT, anchor="rs")
        y += _ROW_LABEL
        parts = tone_map(item.truth), tone_map(item.other), magma(item.flip_map / scale)
        for x, part in zip(columns, parts, strict=True):
            disk, alpha = _disk(part, comparison.mask)
            image.paste(canvas.fromarray(disk), (x, y), canvas.fromarray(alpha))
        y += _CELL

    if views is not None:
        draw.line([(_MARGIN, y + 6), (right, y + 6)], fill=RULE)
        draw_text(draw, (_MARGIN, y + 32), "Path traced", 17)
        y += _ROW_LABEL
        mapped = [tone_map(view) for view in views]
        for x, part in zip(columns, [*mapped, magma(flip(*mapped) / scale)], strict=True):
            view = canvas.fromarray(display_bytes(part)).resize(
                (_CELL, _CELL), canvas.Resampling.LANCZOS
            )
            image.paste(view, (x, y))
        y += _CELL

    angles = comparison.angles
    draw.line([(_MARGIN, y + 16), (right, y + 16)], fill=RULE)
    draw_text(draw, (_MARGIN, y + 46), f"Over {angles.count:,} pairs of directions", 17)
    summary = (
        f"log-cosine error {angles.log_cosine:.4f}     "
        f"relative error, median {angles.relative_median:.1%}"
    )
    draw_text(draw, (_MARGIN, y + 72), summary, 17, FAINT)
    draw_scale(image, draw, (columns[2], y + 34), _CELL, scale)
    return np.array(image)


def scale_end(errors: Iterable[Floats]) -> float:
    """End of the color scale for some maps of errors: the least that holds nearly all of each."""
    peak = max(float(np.percentile(values, 99.5)) for values in errors)
    return next((end for end in _SCALES if end >= peak), _SCALES[-1])


def draw_scale(image: Any, draw: Any, at: tuple[int, int], width: int, end: float) -> None:
    """The colors of errors from 0 to `end`, with numbers below."""
    bar = np.broadcast_to(magma(np.linspace(0.0, 1.0, width)), (14, width, 3))
    image.paste(require("PIL.Image", "render").fromarray(display_bytes(bar)), at)
    for tick, anchor in ((0.0, "ls"), (0.5, "ms"), (1.0, "rs")):
        place = (at[0] + tick * width, at[1] + 38)
        draw_text(draw, place, f"{tick * end:g}", 15, FAINT, anchor=anchor)


def _figures(item: LightComparison) -> str:
    errors = item.errors
    psnr = "infinite" if math.isinf(errors.psnr) else f"{errors.psnr:.1f} dB"
    return f"SSIM {errors.ssim:.4f}     PSNR {psnr}     FLIP {errors.flip:.4f}"


def display_bytes(values: Floats) -> Bytes:
    """Bytes of values of display, which are clipped to [0, 1]."""
    quantised: Bytes = np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)
    return quantised


def _disk(values: Floats, mask: npt.NDArray[np.bool_]) -> tuple[Bytes, Bytes]:
    """A picture of the sphere enlarged to the cell, and its smooth outline as opacity."""
    canvas = require("PIL.Image", "render")
    size = len(mask)
    # Colors just inside the rim run on outwards, so that enlarging mixes no background in.
    axis = np.arange(size) + 0.5 - size / 2.0
    radius = np.hypot(axis, axis[:, None])
    inside = size / 2.0 * (1.0 - MARGIN) - 1.0
    shrink = np.minimum(1.0, inside / radius)
    rows, columns = (
        np.floor(a * shrink + size / 2.0).astype(int) for a in (axis[:, None], axis[None, :])
    )
    extended = canvas.fromarray(display_bytes(values[rows, columns]))
    enlarged = extended.resize((_CELL, _CELL), canvas.Resampling.BICUBIC)
    axis = np.arange(_CELL) + 0.5 - _CELL / 2.0
    distance = np.hypot(axis, axis[:, None])
    alpha = np.clip(_CELL / 2.0 * (1.0 - MARGIN) - distance, 0.0, 1.0)
    return np.array(enlarged), display_bytes(alpha)


def blank_page(width: int, height: int) -> tuple[Any, Any]:
    """A page of Pillow's, and what draws on it.

    Raises
    ------
    MissingExtraError
        If Pillow is not installed.
    """
    image = require("PIL.Image", "render").new("RGB", (width, height), PAPER)
    return image, require("PIL.ImageDraw", "render").Draw(image)


def draw_text(
    draw: Any,
    at: tuple[float, float],
    text: str,
    size: int,
    fill: tuple[int, int, int] = INK,
    *,
    anchor: str = "ls",
    limit: float = math.inf,
) -> None:
    """Text on one base line, cut with an ellipsis where it is wider than `limit`."""
    text = printable(text)
    font = require("PIL.ImageFont", "render").load_default(size=size)
    if draw.textlength(text, font) > limit:
        while text and draw.textlength(text + "…", font) > limit:
            text = text[:-1]
        text += "…"
    draw.text(at, text, fill=fill, font=font, anchor=anchor)
