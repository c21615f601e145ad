"""Pages of pictures of materials, each with its errors below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import FAINT, Page, broken
from nacre.reproduce.textures.numbers import scaled

TRUTH = "truth"
"""Title of the column of what was measured."""
_SIDE, _GAP, _NAMES, _HEAD, _CAPTION = 1.35, 0.08, 1.05, 0.4, 0.2
"""Inches: edge of a texture, space between, width of names, height of titles and captions."""
_BRIGHT, _WHITE = 99.0, 0.9
"""Percentile of the truth that is shown at a brightness."""


@dataclass(frozen=True)
class Cell:
    """A picture, errors of it and of the whole texture; none of the truth."""

    picture: Floats | None
    mse: float | None = None
    whole: float | None = None

    @property
    def caption(self) -> str:
        """The errors."""
        return "" if self.mse is None else f"{scaled(self.mse)} (all {scaled(self.whole)})"


def cell_page(
    heads: Sequence[str],
    names: Sequence[str],
    lines: Sequence[Sequence[Cell]],
    *,
    side: float = _SIDE,
    exposed: bool = False,
) -> Any:
    """Pictures of materials in rows, `side` inches wide each, below heads: one is :data:`TRUTH`.

    Where `exposed`, 1 is white; else each row is as bright as shows the truth well.
    """
    across, down = side + _GAP, side + _CAPTION
    page = Page(_NAMES + len(heads) * across, _HEAD + len(lines) * down + _GAP)
    truth = heads.index(TRUTH)
    for column, head in enumerate(heads):
        x = _NAMES + column * across + 0.5 * side
        page.text(x, _HEAD - 0.08, head, ha="center", va="bottom", size=8.0)
    for row, (name, line) in enumerate(zip(names, lines, strict=True)):
        y = _HEAD + row * down
        page.text(0.05, y + 0.5 * side, broken(name, 12), va="center", size=8.0)
        measured = line[truth].picture
        assert measured is not None
        exposure = 1.0 if exposed else _WHITE / max(float(np.percentile(measured, _BRIGHT)), 1e-6)
        for column, cell in enumerate(line):
            x = _NAMES + column * across
            if cell.picture is None:
                page.text(x + 0.5 * side, y + 0.5 * side, "none", ha="center", color=FAINT)
                continue
            page.image(x, y, side, side, tone_map(exposure * cell.picture), smooth=False)
            page.text(x, y + side + 0.03, cell.caption, 7.0, va="top", limit=side)
    return page.figure
