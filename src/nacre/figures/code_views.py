"""Pictures of codes: what lies between two of them, and a map of many."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.errors import require
from nacre.formats import load_brdf
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.file import is_code, load_code
from nacre.latent.map import embed
from nacre.render.preview import render_preview
from nacre.render.sphere import render_sphere, standard_lights
from nacre.runtime.progress import Progress, silent

_THUMBNAIL = 48
"""Pixels along an edge of the pictures on a map."""
_SIZE, _INCHES = 9.0, 0.42
"""Inches: edge of the map, and of a picture on it."""
_INK, _HIGHLIGHT = "#202124", "#d62728"


def coded(
    files: Sequence[Path], basis: LatentBasis, progress: Progress = silent
) -> list[CodedBrdf]:
    """The materials of the codes in `.json` files, or of the codes of the materials in others.

    Raises
    ------
    FormatError
        If a file cannot be read, holds a code of another basis, or an anisotropic material.
    """
    found = []
    for index, path in enumerate(files):
        if is_code(path):
            found.append(load_code(path, basis))
        else:
            brdf = load_brdf(path)
            found.append(basis.decode(basis.encode(brdf), brdf.name))
        progress("encoding", index + 1, len(files), "")
    return found


def between(first: CodedBrdf, second: CodedBrdf, count: int) -> list[CodedBrdf]:
    """Materials at `count` even steps from one code to another of the same basis, ends included."""
    decode, name = first.basis.decode, f"{first.name} - {second.name}"
    steps = np.linspace(0.0, 1.0, count)
    return [decode((1.0 - t) * first.code + t * second.code, f"{name} {t:.2f}") for t in steps]


def displayed(material: CodedBrdf, size: int, spp: int) -> npt.NDArray[np.float32]:
    """The preview of a material in values of display, shape (size, size, 3).

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    """
    return tone_map(render_preview(material, size=size, spp=spp))


def strip(
    materials: Sequence[CodedBrdf], size: int, spp: int, progress: Progress = silent
) -> npt.NDArray[np.uint8]:
    """Previews of materials side by side, shape (size, size * materials, 3).

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    """
    pictures = []
    for index, material in enumerate(materials):
        pictures.append(displayed(material, size, spp))
        progress("rendering", index + 1, len(materials), "")
    return np.asarray(np.rint(255.0 * np.concatenate(pictures, axis=1)), np.uint8)


def draw_map(
    names: Sequence[str],
    materials: Sequence[CodedBrdf],
    highlighted: Collection[str],
    seed: int,
    progress: Progress,
) -> Any:
    """The t-SNE map of codes, with a sphere for each; the highlighted ones are ringed in red.

    Parameters
    ----------
    names
        Names of the materials, as they are shown.
    materials
        :data:`nacre.latent.map.MIN_CODES` or more, of one basis.
    highlighted
        Names of those to ring.
    seed
        The same seed gives the same map.
    progress
        Called as spheres are rendered.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    NacreError
        If there are too few materials.
    MissingExtraError
        If openTSNE or Matplotlib is not installed.
    """
    places = embed([material.code for material in materials], seed)
    light = standard_lights()["environment"]
    pictures = []
    for index, material in enumerate(materials):
        image, mask = render_sphere(material, light, _THUMBNAIL)
        pictures.append(np.concatenate([tone_map(image), mask[..., None]], axis=-1))
        progress("rendering", index + 1, len(materials), "")
    return _map_figure(names, places, pictures, highlighted)


def _map_figure(
    names: Sequence[str],
    places: npt.NDArray[np.float64],
    pictures: Sequence[npt.NDArray[np.floating]],
    highlighted: Collection[str],
) -> Any:
    """Pictures (RGBA of display) at their places in the plane, shape (n, 2), on one page."""
    boxes = require("matplotlib.offsetbox", "plot")
    figure = require("matplotlib.figure", "plot").Figure((_SIZE, _SIZE), facecolor="white")
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_axis_off()
    low, high = places.min(axis=0), places.max(axis=0)
    margin = 0.08 * np.maximum(high - low, 1e-9)
    axes.set_xlim(low[0] - margin[0], high[0] + margin[0])
    axes.set_ylim(low[1] - margin[1], high[1] + margin[1])
    for name, place, picture in zip(names, places, pictures, strict=True):
        color = _HIGHLIGHT if name in highlighted else _INK
        zoom = _INCHES * 72.0 / len(picture)
        image = boxes.OffsetImage(picture, zoom=zoom)
        axes.add_artist(boxes.AnnotationBbox(image, place, frameon=False, pad=0.0))
        if name in highlighted:
            size = (1.15 * _INCHES * 72.0) ** 2
            style = {"s": size, "facecolors": "none", "edgecolors": _HIGHLIGHT, "linewidths": 1.6}
            axes.scatter(*place, zorder=4, **style)
        below = (0.0, -0.58 * _INCHES * 72.0)
        text = {"fontsize": 4.5, "color": color, "ha": "center", "va": "top"}
        axes.annotate(name, place, below, textcoords="offset points", **text)
    return figure
