"""Figures 4, 6 and 8: textures at a light and a view, as they are and as they are decoded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf.directions import from_degrees
from nacre.btf.selection import nearest_pair
from nacre.color import tone_map
from nacre.evaluate.polar import FAINT
from nacre.files import NacreError
from nacre.reproduce.btf.materials import Material
from nacre.reproduce.btf.methods import Method
from nacre.reproduce.btf.outcome import Outcome, markdown_table, scaled
from nacre.reproduce.btf.sampling import ALL, SHARES, Sampling
from nacre.reproduce.btf.study import Study
from nacre.reproduce.btf.table import error_table
from nacre.reproduce.page import Page, broken

ANGLES = {"fig4": ((45.0, 0.0), (60.0, 90.0)), "fig6": ((45.0, 0.0), (60.0, 90.0)),
          "fig8": ((45.0, 0.0), (0.0, 0.0))}  # fmt: skip
"""Polar angle and azimuth in degrees of view and light. The paper gives azimuths and elevations of
them, 0, 45, 90, 30 and 0, 45, 0, 90 degrees: its elevations are angles to the surface, as 90 of the
light of Figure 8 can only be the normal, and no direction at the horizon was measured."""
_PARTS = tuple(s for s in SHARES if s.name in ("1 %", "5 %", "10 %", "20 %", "50 %", "100 %"))
_SIDE, _GAP, _NAMES, _HEAD, _CAPTION = 1.25, 0.08, 1.05, 0.4, 0.2
"""Inches: edge of a picture, space between, width of names, height of titles and captions."""
_BRIGHT, _WHITE = 99.0, 0.9
"""Percentile of the truth that is shown at a brightness."""


@dataclass(frozen=True)
class _Cell:
    """A picture, errors of it and of the whole texture; none of the truth."""

    picture: Floats | None
    mse: float | None = None
    whole: float | None = None

    @property
    def caption(self) -> str:
        """The errors."""
        if self.mse is None:
            return ""
        return f"{scaled(self.mse)} (all angles {scaled(self.whole)})"


def fig4(study: Study, methods: Sequence[Method]) -> Outcome:
    """Unseen textures and what each method makes of them.

    Raises
    ------
    NacreError
        If a codec cannot be made.
    """
    return _by_method(study, methods, study.unseen, "fig4")


def fig6(study: Study, methods: Sequence[Method]) -> Outcome:
    """Textures that are unlike those of the training, and what each method makes of them.

    Raises
    ------
    NacreError
        If there are none, or a codec cannot be made.
    """
    if not study.others:
        raise NacreError("there are no textures unlike those of the training; give --other FOLDER")
    return _by_method(study, methods, study.others, "fig6")


def _by_method(
    study: Study, methods: Sequence[Method], materials: Sequence[Material], name: str
) -> Outcome:
    rows: list[Sequence[object]] = []
    lines, whole = [], dict[str, dict[str, float]]()
    for material in materials:
        pair, truth = _truth(material, name)
        line = [_Cell(truth)]
        for method in methods:
            cell = _cell(study, method, material, pair, truth, ALL)
            line.append(cell)
            if cell.mse is not None and cell.whole is not None:
                rows.append((material.name, method.name, cell.mse, cell.whole))
                whole.setdefault(method.name, {})[material.name] = cell.whole
        lines.append(line)
    heads = ["truth", *(method.name for method in methods)]
    page = _page(heads, [material.name for material in materials], lines)
    columns = ("material", "method", "mse of the picture", "mse of all pairs")
    table = error_table([material.name for material in materials], whole)
    return Outcome(columns, rows, table, {"": page})


def fig8(study: Study, methods: Sequence[Method]) -> Outcome:
    """Unseen textures that are coded from some of their pairs, a page a method.

    Raises
    ------
    NacreError
        If a codec cannot be made.
    """
    rows: list[Sequence[object]] = []
    pages: dict[str, Any] = {}
    table: list[list[str]] = []
    for method in methods:
        lines = []
        for material in study.unseen:
            pair, truth = _truth(material, "fig8")
            cells = [_cell(study, method, material, pair, truth, part) for part in _PARTS]
            lines.append([*cells, _Cell(truth)])
            table.append([f"{method.name}, {material.name}", *(scaled(c.whole) for c in cells)])
            for part, cell in zip(_PARTS, cells, strict=True):
                if cell.mse is not None:
                    rows.append((material.name, method.name, part.name, cell.mse, cell.whole))
        heads = [*(part.name for part in _PARTS), "truth"]
        if any(cell.mse is not None for line in lines for cell in line):
            pages[f"-{method.name}"] = _page(heads, [m.name for m in study.unseen], lines)
    columns = ("material", "method", "pairs seen", "mse of the picture", "mse of all pairs")
    head = ["MSE x 10⁴", *(part.name for part in _PARTS)]
    return Outcome(columns, rows, markdown_table(head, table), pages)


def _truth(material: Material, name: str) -> tuple[int, Floats]:
    """The measured pair nearest to the angles of a figure, and the picture there."""
    view, light = (from_degrees(*angles) for angles in ANGLES[name])
    texture = material.load()
    pair = nearest_pair(texture, light.astype(np.float32), view.astype(np.float32))
    return pair, texture.images(np.array([pair]))[0]


def _cell(
    study: Study, method: Method, material: Material, pair: int, truth: Floats, sampling: Sampling
) -> _Cell:
    picture = study.picture(method, material, pair, sampling)
    found = study.errors(method, material, sampling)
    if picture is None or found is None:
        return _Cell(None)
    return _Cell(picture, float(np.square(picture - truth).mean()), found.mse)


def _page(heads: Sequence[str], names: Sequence[str], lines: Sequence[Sequence[_Cell]]) -> Any:
    """Pictures of materials (rows), each row as bright as shows the truth well."""
    across, down = _SIDE + _GAP, _SIDE + _CAPTION
    page = Page((_NAMES + len(heads) * across, _HEAD + len(lines) * down + _GAP))
    truth = heads.index("truth")
    for column, head in enumerate(heads):
        x = _NAMES + column * across + 0.5 * _SIDE
        page.text(x, _HEAD - 0.08, head, ha="center", va="bottom", fontsize=8)
    for row, (name, line) in enumerate(zip(names, lines, strict=True)):
        y = _HEAD + row * down
        page.text(0.05, y + 0.5 * _SIDE, broken(name, 12), va="center", fontsize=8)
        shown = line[truth].picture
        assert shown is not None
        exposure = _WHITE / max(float(np.percentile(shown, _BRIGHT)), 1e-6)
        for column, cell in enumerate(line):
            x = _NAMES + column * across
            if cell.picture is None:
                page.text(x + 0.5 * _SIDE, y + 0.5 * _SIDE, "none", ha="center", color=FAINT)
                continue
            axes = page.axes(x, y, _SIDE, _SIDE)
            axes.imshow(tone_map(exposure * cell.picture), interpolation="nearest")
            caption = {"ha": "center", "va": "top", "fontsize": 6}
            page.text(x + 0.5 * _SIDE, y + _SIDE + 0.03, cell.caption, **caption)
    return page.figure
