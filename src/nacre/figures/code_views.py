"""Pictures of codes: what lies between two of them, and a map of many."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.formats import load_brdf
from nacre.latent import encode
from nacre.latent.file import AnyBasis, Coded, is_code, load_code
from nacre.latent.map import embed, map_figure
from nacre.render.preview import render_preview
from nacre.render.sphere import render_sphere, standard_lights
from nacre.runtime.progress import Progress

_THUMBNAIL = 48
"""Pixels along an edge of the pictures on a map."""


def coded(files: Sequence[Path], basis: AnyBasis, progress: Progress | None = None) -> list[Coded]:
    """The materials of the codes in `.json` files, or of the codes of the materials in others.

    Raises
    ------
    FormatError
        If a file cannot be read, holds a code of another basis, or an anisotropic material.
    """
    found: list[Coded] = []
    for index, path in enumerate(files):
        if is_code(path):
            found.append(load_code(path, basis))
        else:
            brdf = load_brdf(path)
            found.append(basis.decode(encode(basis, brdf), brdf.name))
        if progress:
            progress("encoding", index + 1, len(files), "")
    return found


def between(first: Coded, second: Coded, count: int) -> list[Coded]:
    """Materials at `count` even steps from one code to another of the same basis, ends included."""
    decode, name = first.basis.decode, f"{first.name} - {second.name}"
    shares = np.linspace(0.0, 1.0, count)
    return [decode((1.0 - t) * first.code + t * second.code, f"{name} {t:.2f}") for t in shares]


def displayed(material: Coded, size: int, spp: int) -> npt.NDArray[np.float32]:
    """The preview of a material in values of display, shape (size, size, 3).

    Raises
    ------
    MissingExtraError
        If Mitsuba is not installed.
    """
    return tone_map(render_preview(material, size=size, spp=spp))


def draw_map(
    names: Sequence[str],
    materials: Sequence[Coded],
    marked: Collection[str],
    seed: int,
    progress: Progress,
) -> Any:
    """The t-SNE map of codes, with a sphere for each.

    Parameters
    ----------
    names
        Of the materials, as they are shown.
    materials
        :data:`nacre.latent.map.FEWEST` at least, of one basis.
    marked
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
    return map_figure(names, places, pictures, marked)
