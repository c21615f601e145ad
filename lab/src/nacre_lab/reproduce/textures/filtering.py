"""Figure 9: textures from further away, by averages of decoded pictures and of codes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.figures.page import FAINT, Figure, Page
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.mipmap import LatentPyramid, filtered_reflectance, halved_rows, level_shapes
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import geometric_mean, markdown_table, scaled
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.rendering import encoded
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.texture_figures import exposure_of, measured_pair

_LEVELS = 3  # distances: averages over 2, 4 and 8 texels per edge, if there are as many
_PAIRS = 512  # pairs of directions behind the errors
_ROWS = "measured", "mean of\nthe image", "mean of\nthe codes"
_SOURCES = ("textures/mipmap.py", "reproduce/textures/filtering.py")
_SIDE, _GAP, _HEAD, _CAPTION, _NAMES, _BETWEEN = 0.85, 0.06, 0.5, 0.2, 0.75, 0.2
"""Inches: edge of a picture, space between, height of heads and captions, width of names, space
between materials."""
_ACROSS = 4  # materials side by side


def fig9(study: Study, methods: Sequence[Method]) -> Outcome:
    """Unseen textures from three distances: measured, and decoded and filtered in either order."""
    rows: list[Sequence[object]] = []
    pages: dict[str, Any] = {}
    table: list[list[str]] = []
    for method in methods:
        blocks = []
        errors: dict[int, list[Floats]] = {}
        for material in study.unseen:
            texture = material.load()
            pair, _ = measured_pair(material, "fig9")
            levels = range(1, len(level_shapes(texture.height, texture.width)[: _LEVELS + 1]))
            names = ("errors", *(f"level {level}" for level in levels))
            make = partial(filtered, progress=study.report(method, material))
            found = study.results(
                "filtered", names, make, method, material, pair, len(levels), sources=_SOURCES
            )
            if found is None:
                continue
            blocks.append((material.name, [found[f"level {k}"] for k in levels], found["errors"]))
            for level, squares in zip(levels, found["errors"], strict=True):
                errors.setdefault(level, []).append(squares)
                rows.append((material.name, method.name, 2**level, *map(float, squares)))
        for level, squares in errors.items():
            means = [geometric_mean(list(map(float, column))) for column in np.transpose(squares)]
            table.append([f"{method.name}, {2**level} texels", *map(scaled, means)])
        if blocks:
            pages[method.name] = _page(blocks)
    against = "image, to measured", "codes, to measured", "codes, to image"
    columns = ("material", "method", "texels an edge", *(f"mse of {name}" for name in against))
    head = ["MSE x 10⁴, geometric mean", *(f"mean of {name}" for name in against)]
    return Outcome(pages, columns, rows, markdown_table(head, table))


def filtered(
    texture: Btf,
    codec: TexelCodec,
    pair: int,
    count: int,
    seed: int,
    progress: Progress = silent,
) -> Mapping[str, Floats]:
    """A texture from `count` distances, each twice the previous one.

    Returns
    -------
    dict
        For each "level k", shape (3, height, width, 3): the average at the pair of directions of
        the measured picture, that of the decoded picture, and the decoded average of the codes; and
        "errors", shape (count, 3): mean squared differences of the second and the third from the
        first, and of the third from the second, over random pairs.

    Raises
    ------
    NacreError
        If the codec is only for other directions.
    """
    random = np.random.default_rng(seed)
    total = texture.pair_count
    chosen = np.append(random.permutation(total)[:_PAIRS], pair)
    wi, wo = texture.wi[chosen], texture.wo[chosen]
    latent = encoded(texture, codec, progress)
    decode = codec.decoder(wi, wo)
    images = filtered_reflectance(latent, wi, wo)
    codes = LatentPyramid.build(latent, "codes").levels[1:]
    width = texture.width
    rows: Iterable[Floats] = (
        texture.texels(slice(y * width, (y + 1) * width))[:, chosen] for y in range(texture.height)
    )
    results: dict[str, Floats] = {}
    errors = []
    for level in range(count):
        rows = np.stack(list(halved_rows(rows, level_shapes(texture.height, width)[level][0])))
        decoded = np.stack([decode(line) for line in codes[level]])
        three = np.stack([rows, images[level], decoded])
        results[f"level {level + 1}"] = three[:, :, :, -1].astype(np.float32)
        measured, image, code = three[:, :, :, :-1]
        pairs = ((image, measured), (code, measured), (code, image))
        errors.append([float(np.square(a - b).mean()) for a, b in pairs])
    return results | {"errors": np.array(errors)}


def _page(blocks: Sequence[tuple[str, Sequence[Floats], Floats]]) -> Figure:
    """A block for each material: three rows, one column per distance, errors below."""
    columns = max(len(pictures) for _, pictures, _ in blocks)
    step, down = _SIDE + _GAP, _SIDE + _CAPTION
    across = columns * step + _BETWEEN
    high = _HEAD + len(_ROWS) * down
    wide = min(len(blocks), _ACROSS)
    page = Page(_NAMES + wide * across, -(-len(blocks) // _ACROSS) * high + _GAP)
    for index, (name, pictures, errors) in enumerate(blocks):
        left = _NAMES + index % _ACROSS * across
        top = index // _ACROSS * high + _HEAD
        page.text(left, top - 0.26, name, 9.0, limit=across - _GAP)
        exposure = exposure_of(pictures[0][0])
        for row, title in enumerate(_ROWS):
            y = top + row * down
            if index % _ACROSS == 0:
                page.text(0.05, y + 0.5 * _SIDE, title, 8.0, va="center")
            for column, levels in enumerate(pictures):
                x = left + column * step
                if row == 0:
                    page.text(x, y - 0.07, f"{2 ** (column + 1)} texels", 7.0, FAINT)
                shown = tone_map(exposure * levels[row])
                page.image(x, y, _SIDE, _SIDE, shown, smooth=False)
                if row:
                    error = scaled(float(errors[column][row - 1]))
                    page.text(x, y + _SIDE + 0.03, error, 7.0, va="top")
    return page.figure
