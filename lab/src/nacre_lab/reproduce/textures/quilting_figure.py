"""Figure 10: textures enlarged by quilting their codes, and rendered."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.figures.page import FAINT, Figure, Page
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.synthesis import synthesize
from nacre_lab.reproduce.chart import broken
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.textures import rendering
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.rendering import View, encoded, render_texture
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.texture_figures import measured_pair

SCALE = 5
"""Factor by which each edge grows (Rainer et al. 2020, section 5.2)."""
_NAMES = "picture", "contrast", "used", "seconds"
_SOURCES = (
    *rendering.SOURCES, "textures/synthesis/*.py", "reproduce/textures/quilting_figure.py"
)  # fmt: skip
_SIDE, _GAP, _HEAD, _CAPTION, _LEFT, _INSET = 2.6, 0.1, 0.35, 0.2, 0.85, 0.24
"""Inches: edge of a rendering, space between, height of heads and captions, width of names; part of
a rendering that the measured texture covers."""


def fig10(study: Study, methods: Sequence[Method]) -> Outcome:
    """Planes of enlarged unseen textures, with the measured texture in a corner."""
    view = View("plane", repeat=1, size=study.size)
    rows: list[Sequence[object]] = []
    table: list[list[str]] = []
    lines, names = [], []
    for material in study.unseen:
        line = []
        for method in methods:
            make = partial(quilted, progress=study.report(method, material))
            found = study.results("quilted", _NAMES, make, method, material, view, sources=_SOURCES)
            line.append(found)
            if found is not None:
                ratio, used, seconds = (float(found[name]) for name in _NAMES[1:])
                rows.append((material.name, method.name, ratio, used, seconds))
                shown = f"{ratio:.2f}", f"{100.0 * used:.0f} %", f"{seconds:.1f}"
                table.append([method.name, material.name, *shown])
        lines.append((measured_pair(material, "fig10")[1], line))
        names.append(material.name)
    columns = ("material", "method", "contrast of seams", "share of the input used", "seconds")
    head = ["method", "material", "contrast of seams", "input used", "seconds to quilt"]
    page = _page([method.name for method in methods], names, lines)
    return Outcome({"": page}, columns, rows, markdown_table(head, table))


def quilted(
    texture: Btf, codec: TexelCodec, view: View, seed: int, progress: Progress = silent
) -> Mapping[str, Any]:
    """A texture enlarged :data:`SCALE` times through its codes, and rendered.

    Returns
    -------
    dict
        The "picture", shape (size, size, 3); the "contrast" of seams, NaN if there are none; the
        fraction of the input that is "used"; and the "seconds" of quilting.

    Raises
    ------
    NacreError
        If the codec is for other directions, or decodes only its own.
    """
    if not codec.any_directions:
        raise NacreError("its codec knows its own directions only")
    latent = encoded(texture, codec, progress)
    began = time.monotonic()
    made = synthesize(
        latent, SCALE * texture.height, SCALE * texture.width, seed=seed, progress=progress
    )
    seconds = time.monotonic() - began
    ratio = made.contrast.ratio
    picture = render_texture(made.latent, view, seed, progress).picture
    contrast = np.nan if ratio is None else ratio
    return dict(zip(_NAMES, (picture, contrast, made.used, seconds), strict=True))


def _page(
    heads: Sequence[str],
    names: Sequence[str],
    lines: Sequence[tuple[Floats, Sequence[Mapping[str, Floats] | None]]],
) -> Figure:
    """Renderings of materials in rows, with the measured texture at the lower left of each."""
    across, down = _SIDE + _GAP, _SIDE + _CAPTION
    page = Page(_LEFT + len(heads) * across, _HEAD + len(lines) * down)
    for column, head in enumerate(heads):
        page.text(_LEFT + column * across + 0.5 * _SIDE, _HEAD - 0.08, head, 8.0, ha="center")
    for row, (name, (texture, line)) in enumerate(zip(names, lines, strict=True)):
        y = _HEAD + row * down
        page.text(0.05, y + 0.5 * _SIDE, broken(name, 12), 8.0, va="center")
        for column, found in enumerate(line):
            x = _LEFT + column * across
            if found is None:
                page.text(x + 0.5 * _SIDE, y + 0.5 * _SIDE, "none", ha="center", color=FAINT)
                continue
            page.image(x, y, _SIDE, _SIDE, tone_map(found["picture"]))
            inset = _INSET * _SIDE
            page.image(x, y + _SIDE - inset, inset, inset, tone_map(texture), smooth=False)
            caption = f"contrast of seams {float(found['contrast']):.2f}"
            page.text(x, y + _SIDE + 0.03, caption, 7.0, va="top", limit=_SIDE)
    return page.figure
