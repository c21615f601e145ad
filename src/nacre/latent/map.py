"""A map of materials: codes in the plane, neighbors side by side."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, require

FEWEST = 5
"""Materials, or texels, that a map takes at least."""

_PERPLEXITY = 30.0
_SIZE, _THUMBNAIL = 9.0, 0.42
"""Inches: edge of the map, and of a picture on it."""
_INK, _MARK = "#202124", "#d62728"


def embed(codes: npt.ArrayLike, seed: int = 0, what: str = "materials") -> npt.NDArray[np.float64]:
    """Places of codes in the plane by t-SNE (van der Maaten and Hinton 2008).

    Parameters
    ----------
    codes
        Shape (n, k), of :data:`FEWEST` materials at least.
    seed
        The same seed gives the same map.
    what
        Codes are of, for the message of an error.

    Returns
    -------
    array of shape (n, 2)

    Raises
    ------
    NacreError
        If there are fewer codes.
    MissingExtraError
        If openTSNE is not installed.
    """
    values = np.asarray(codes, np.float64)
    if len(values) < FEWEST:
        raise NacreError(f"a map takes {FEWEST} {what} at least, got {len(values)}")
    tsne = require("openTSNE", "latent").TSNE(
        perplexity=_perplexity(len(values)),
        initialization="pca" if np.ptp(values, axis=0).any() else "random",  # of one value is none
        negative_gradient_method="bh",
        random_state=seed,
        n_jobs=1,
    )
    return np.asarray(tsne.fit(values), np.float64)


def embed_into(
    codes: npt.ArrayLike, places: npt.ArrayLike, new: npt.ArrayLike, seed: int = 0
) -> npt.NDArray[np.float64]:
    """Places of new codes on a map of others, which stay where they are (Poličar et al. 2024).

    Parameters
    ----------
    codes, places
        Of the map: what :func:`embed` was given, shape (n, k), and what it gave.
    new
        Shape (m, k).
    seed
        The same seed gives the same places.

    Returns
    -------
    array of shape (m, 2)

    Raises
    ------
    MissingExtraError
        If openTSNE is not installed.
    """
    library = require("openTSNE", "latent")
    values = np.asarray(codes, np.float64)
    perplexity = _perplexity(len(values))
    affinities = library.affinity.PerplexityBasedNN(
        values, perplexity=perplexity, random_state=seed, n_jobs=1
    )
    known = library.TSNEEmbedding(
        np.array(places, np.float64),
        affinities,
        negative_gradient_method="bh",
        random_state=seed,
        n_jobs=1,
    )
    closest = max(1, min(25, len(values) - 1))
    found = known.transform(np.asarray(new, np.float64), perplexity=min(5.0, perplexity), k=closest)
    return np.asarray(found, np.float64)


def _perplexity(count: int) -> float:
    return min(_PERPLEXITY, (count - 1) / 3.0)


def nearest(codes: npt.ArrayLike, index: int, count: int) -> list[int]:
    """The other codes that are closest to one of them, the closest first."""
    values = np.asarray(codes, np.float64)
    order = np.argsort(np.linalg.norm(values - values[index], axis=1), kind="stable")
    return [int(k) for k in order if k != index][:count]


def map_figure(
    names: Sequence[str],
    places: npt.NDArray[np.float64],
    pictures: Sequence[npt.NDArray[np.floating]],
    marked: Collection[str] = (),
) -> Any:
    """Pictures of materials where they are on the map, the marked ones ringed in red.

    Parameters
    ----------
    names
        Of the materials.
    places
        Shape (n, 2).
    pictures
        RGBA of display, in [0, 1].
    marked
        Names.

    Returns
    -------
    matplotlib.figure.Figure
        One page.

    Raises
    ------
    MissingExtraError
        If Matplotlib is not installed.
    """
    boxes = require("matplotlib.offsetbox", "plot")
    figure = require("matplotlib.figure", "plot").Figure((_SIZE, _SIZE), facecolor="white")
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_axis_off()
    low, high = places.min(axis=0), places.max(axis=0)
    margin = 0.08 * np.maximum(high - low, 1e-9)
    axes.set_xlim(low[0] - margin[0], high[0] + margin[0])
    axes.set_ylim(low[1] - margin[1], high[1] + margin[1])
    for name, place, picture in zip(names, places, pictures, strict=True):
        color = _MARK if name in marked else _INK
        zoom = _THUMBNAIL * 72.0 / len(picture)
        image = boxes.OffsetImage(picture, zoom=zoom)
        axes.add_artist(boxes.AnnotationBbox(image, place, frameon=False, pad=0.0))
        if name in marked:
            size = (1.15 * _THUMBNAIL * 72.0) ** 2
            style = {"s": size, "facecolors": "none", "edgecolors": _MARK, "linewidths": 1.6}
            axes.scatter(*place, zorder=4, **style)
        below = (0.0, -0.58 * _THUMBNAIL * 72.0)
        text = {"fontsize": 4.5, "color": color, "ha": "center", "va": "top"}
        axes.annotate(name, place, below, textcoords="offset points", **text)
    return figure
