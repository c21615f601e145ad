"""Pictures of codes: the way between two, and a map of many."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.figures.page import INK, Figure, Page, display_bytes
from nacre.figures.texel_map import apart
from nacre.formats import load_brdf
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.file import is_code, load_code
from nacre.latent.map import embed
from nacre.mitsuba.preview import render_preview
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.runtime.progress import Progress, silent

_THUMBNAIL = 64  # pixels along an edge of a sphere on a map
_SIDE, _PAGE, _NAME, _GAP = 0.42, 8.0, 0.18, 0.06  # inches: a sphere, the map, a name, a gap
_ROOM = 4.0  # the least area of the page over that of all spheres and names
_HIGHLIGHT = "#d62728"


def coded(
    files: Sequence[Path], basis: LatentBasis, progress: Progress = silent
) -> list[CodedBrdf]:
    """The materials of codes in `.json` files; materials in other files are encoded first.

    Raises FormatError if a file cannot be read, or holds a code of another basis or an anisotropic
    material.
    """
    found = []
    for path in files:
        if is_code(path):
            found.append(load_code(path, basis))
        else:
            brdf = load_brdf(path)
            found.append(basis.decode(basis.encode(brdf), brdf.name))
        progress("encoding", len(found), len(files), "")
    return found


def between(first: CodedBrdf, second: CodedBrdf, count: int) -> list[CodedBrdf]:
    """Materials at `count` even steps from one code to another of the same basis, ends included."""
    decode, name = first.basis.decode, f"{first.name} - {second.name}"
    steps = np.linspace(0.0, 1.0, count)
    return [decode((1.0 - t) * first.code + t * second.code, f"{name} {t:.2f}") for t in steps]


def displayed(material: CodedBrdf, size: int, spp: int | None) -> npt.NDArray[np.float32]:
    """The preview of a material in display values, shape (size, size, 3).

    If `spp` is None, samples are those of a preview, which is denoised. Materials of one neural
    basis share their hidden layers, so that one kernel renders all of them.
    """
    return tone_map(render_preview(material, size=size, spp=spp))


def strip(
    materials: Sequence[CodedBrdf],
    size: int,
    spp: int | None,
    progress: Progress = silent,
    columns: int | None = None,
) -> npt.NDArray[np.uint8]:
    """Previews of materials side by side, shape (size * rows, size * columns, 3).

    They are in one row unless `columns` is given; the rest of the last row is white.
    """
    columns = columns or len(materials)
    rows = -(-len(materials) // columns)
    picture = np.ones((rows * size, columns * size, 3), np.float32)
    for index, material in enumerate(materials):
        progress("rendering", index, len(materials), "")
        row, column = divmod(index, columns)
        place = slice(row * size, (row + 1) * size), slice(column * size, (column + 1) * size)
        picture[place] = displayed(material, size, spp)
    progress("rendering", len(materials), len(materials), "")
    return display_bytes(picture)


def draw_map(
    names: Sequence[str],
    materials: Sequence[CodedBrdf],
    highlighted: Collection[str],
    seed: int,
    progress: Progress,
) -> Figure:
    """The t-SNE map of codes of one basis, with a sphere for each; highlighted names get a ring.

    The same seed gives the same map. Raises NacreError if there are fewer materials than
    :data:`nacre.latent.map.MIN_CODES`.
    """
    places = embed([material.code for material in materials], seed)
    light = standard_lights()["environment"]
    pictures = []
    for material in materials:
        pictures.append(tone_map(render_sphere(material, light, _THUMBNAIL)[0]))
        progress("rendering", len(pictures), len(materials), "")
    return map_figure(names, places, pictures, highlighted)


def map_figure(
    names: Sequence[str],
    places: npt.NDArray[np.float64],
    pictures: Sequence[npt.NDArray[np.floating]],
    highlighted: Collection[str] = (),
) -> Figure:
    """Spheres of materials at their places on the map; highlighted ones have a red ring.

    Spheres and their names are moved apart until none covers another, as little as possible. Places
    have shape (n, 2); pictures are in display values, shape (size, size, 3).
    """
    ruler = Page(1.0, 1.0)
    widths = [ruler.text_width(ruler.text(0.0, 0.0, name, 8.0)) + _GAP for name in names]
    boxes = np.array([(max(width, _SIDE), _SIDE + _NAME) for width in widths])
    edge = max(_PAGE, math.sqrt(_ROOM * boxes.prod(axis=1).sum()))
    page = Page(edge, edge, "white")
    low, high = places.min(axis=0), places.max(axis=0)
    margin = 0.5 * boxes.max(axis=0)
    centers = margin + (places - low) / np.maximum(high - low, 1e-9) * (edge - 2.0 * margin)
    centers = apart(centers, boxes, np.array([[0.0, 0.0], [edge, edge]]))
    for name, (x, up), picture in zip(names, centers, pictures, strict=True):
        top, color = edge - up - 0.5 * (_SIDE + _NAME), INK
        if name in highlighted:
            color = _HIGHLIGHT
            page.ring(x, top + 0.5 * _SIDE, 0.51 * _SIDE, color)
        page.sphere(x - 0.5 * _SIDE, top, _SIDE, picture)
        page.text(x, top + _SIDE + 0.02, name, 8.0, color, ha="center", va="top")
    return page.figure
