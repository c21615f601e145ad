"""From materials to the principal components that they have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent.pca import Basis, encoded, node_weights, on_grid, reflectance
from nacre.measured.merl import Resolution
from nacre.runtime.progress import Progress, silent

RESOLUTION = Resolution(90, 45, 45)
"""Of the grid: a fifth of the memory of the database's own."""
VALUES = 32
"""Values in a code (NBRDF paper, section 4.3)."""

_GREY = np.full((1, 3), 1.0 / math.sqrt(3.0))
_CHROMA = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
_SLAB = 1 << 14
"""Nodes at a time."""


def train(
    materials: Sequence[Callable[[], Brdf]],
    values: int = VALUES,
    resolution: Resolution = RESOLUTION,
    *,
    separate: bool = False,
    progress: Progress | None = None,
) -> Basis:
    """Principal components of materials, each taken with its six permutations of the channels.

    Permuted materials are not made: their covariance commutes with every permutation, so its
    eigenvectors are products of a component over nodes with gray, or with two colors orthogonal
    to gray. Components come from the gray part of the materials and from the rest, each at a third
    of the size, and go in by the variance of one value. The second color of a pair may be left
    out where the code has no room for it.

    Parameters
    ----------
    materials
        Functions that give the materials, isotropic; called once each, so that files need not be
        in memory together.
    values
        k, the values of a code, at most as many as the materials support.
    resolution
        Of the grid. Memory is 12 bytes a node and material.
    separate
        Take each channel as a material of its own, as Nielsen et al. do: a component then has
        three values, for red, green and blue.
    progress
        Called as it goes on.

    Raises
    ------
    FormatError
        If a material is anisotropic.
    NacreError
        If there are fewer than two materials, no node at which all are known, or fewer components
        than values.
    """
    if len(materials) < 2:
        raise NacreError("principal components need two materials or more")
    report = progress or silent
    logs, mask, names = _tabulated(materials, resolution, report)
    centre = logs.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
    logs -= centre
    report("components", 0, 1, "")
    found: list[tuple[float, npt.NDArray[np.float32], npt.NDArray[np.float64]]] = []
    for colors in (np.eye(3),) if separate else (_GREY, _CHROMA):
        variances, vectors = _components(logs, colors, values)
        found += [(v, c, colors) for v, c in zip(variances, vectors, strict=True)]
    found.sort(key=lambda item: -item[0])
    chosen = [(v, i, rgb) for i, (v, _, colors) in enumerate(found) for rgb in colors][:values]
    if len(chosen) < values:
        raise NacreError(
            f"{len(materials)} materials give {len(chosen)} values of a code, not {values}; "
            "take more materials or fewer values"
        )
    report("components", 1, 1, "")
    used = chosen[-1][1] + 1
    return Basis(
        resolution,
        mask,
        centre,
        np.stack([component for _, component, _ in found[:used]]),
        np.array([index for _, index, _ in chosen]),
        np.array([rgb for _, _, rgb in chosen], np.float32),
        np.sqrt([variance for variance, _, _ in chosen]).astype(np.float32),
        {"materials": names, "separate": separate},
    )


def _tabulated(
    materials: Sequence[Callable[[], Brdf]], resolution: Resolution, report: Progress
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_], list[str]]:
    """ln(f w + e) at the nodes where all are known, shape (materials, 3, nodes); these; names."""
    weights = node_weights(resolution)
    mask = np.ones(resolution.dimensions, bool)
    rows: list[npt.NDArray[np.float32]] = []
    names = []
    for index, load in enumerate(materials):
        brdf = load()
        table = on_grid(brdf, resolution)
        both = mask & table.mask
        logs = encoded(reflectance(table)[both], weights[both]).T
        rows = [row if row.shape[1] == both.sum() else row[:, both[mask]] for row in rows]
        rows.append(np.ascontiguousarray(logs, np.float32))
        mask = both
        names.append(brdf.name)
        report("tabulating", index + 1, len(materials), brdf.name)
    if not mask.any():
        raise NacreError("no node of the grid is known of all materials")
    return np.stack(rows), mask, names


def _components(
    logs: npt.NDArray[np.float32], colors: npt.NDArray[np.float64], limit: int
) -> tuple[list[float], list[npt.NDArray[np.float32]]]:
    """Variances of one value, and components, of the parts of materials along some colors.

    The matrix of all nodes is never factorized: its few rows have products among each other, whose
    eigenvectors tell the components (the "method of snapshots").
    """
    materials, _, nodes = logs.shape
    slabs = [slice(start, start + _SLAB) for start in range(0, nodes, _SLAB)]

    def rows(slab: slice) -> npt.NDArray[np.float64]:
        part = np.einsum("gc,mcn->mgn", colors, logs[:, :, slab], optimize=True)
        return np.asarray(part.reshape(-1, part.shape[2]), np.float64)

    gram = sum(part @ part.T for part in map(rows, slabs))
    squares, vectors = np.linalg.eigh(gram)
    order = np.argsort(-squares)[:limit]
    order = order[squares[order] > 1e-9 * squares.max()]
    scaled = vectors[:, order] / np.sqrt(squares[order])
    components = np.concatenate([scaled.T @ rows(slab) for slab in slabs], axis=1)
    variances = squares[order] / (materials * len(colors))
    return variances.tolist(), list(components.astype(np.float32))
