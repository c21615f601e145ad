"""The sheet for two textures under some lights from some views, and their differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.figures.difference_sheet import CELL_PIXELS, Row, difference_sheet
from nacre.figures.page import Bytes, scale_end, scale_note
from nacre.figures.texture_views import angles, reduced, texels
from nacre.measured.textures.directions import from_degrees
from nacre.metrics.ldr_flip import displayed_flip
from nacre.metrics.texture_comparison import matched
from nacre.metrics.verdict import Verdict, verdict
from nacre.textures.selection import nearest_pair

SHOWN = (
    ((0.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (0.0, 0.0)),
    ((45.0, 0.0), (45.0, 180.0)),
    ((75.0, 90.0), (30.0, 180.0)),
    ((60.0, 90.0), (60.0, 270.0)),
)
"""Polar angle and azimuth of the light, then of the view, in degrees."""


def texture_rows(truth: Btf, other: Btf) -> list[Row]:
    """The rows of :func:`texture_sheet`; linear pictures relative to the white of each."""
    other = matched(truth, other)
    wanted = [nearest_pair(truth, from_degrees(*wi), from_degrees(*wo)) for wi, wo in SHOWN]
    return [_row(truth, other, pair) for pair in dict.fromkeys(wanted)]


def texture_verdict(rows: Sequence[Row]) -> Verdict:
    """Whether a viewer would see the difference, in the row that shows it best, a texel a pixel."""
    return verdict((" ".join(row.label.split()), _flip(row)) for row in rows)


def texture_sheet(
    truth: Btf,
    other: Btf,
    names: tuple[str, str] = ("truth", "other"),
    rows: Sequence[Row] | None = None,
) -> Bytes:
    """Draw two textures at the measured pairs of directions nearest to :data:`SHOWN`, as bytes.

    Both are compared on the pairs from :func:`nacre.metrics.texture_comparison.matched`; raises
    NacreError if these do not match. Columns are the reference, the model, and the largest absolute
    difference of the channels. Pictures with more than 384 pixels a side are reduced by means over
    squares of pixels; small ones are enlarged without smoothing. No pair appears twice. Each row
    has its own exposure, in which all but the brightest hundredth of the reference's texels stay
    below white; differences are relative to that white. `rows` are those of :func:`texture_rows`,
    if they are known already.
    """
    rows = texture_rows(truth, other) if rows is None else rows
    scale = texture_scale(rows)
    notes = (
        f"{texels(truth, *rows[0].error.shape)}; every row has an exposure of its own",
        "Difference: the largest of the channels, in units of the row's white; "
        f"{scale_note(scale)}",
    )
    return difference_sheet(rows, scale, "Difference", names, notes)


def texture_scale(rows: Sequence[Row]) -> float:
    """The difference at the bright end of the sheet's color scale."""
    return scale_end(row.error for row in rows)


def _flip(row: Row) -> Floats:
    return displayed_flip(row.reference, row.model)


def _row(truth: Btf, other: Btf, pair: int) -> Row:
    """A row; the difference is computed before pictures are reduced."""
    a, b = (texture.images(np.array([pair]))[0] for texture in (truth, other))
    white = max(float(np.percentile(a.max(-1), 99.0)), 1e-4)
    first, second, error = (reduced(v / white, CELL_PIXELS) for v in (a, b, np.abs(b - a).max(-1)))
    return Row(first, second, error, "        ".join(angles(truth, pair)), f"white is {white:.3g}")
