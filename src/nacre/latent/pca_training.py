"""The principal components that materials have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from nacre.array import Doubles, Floats, Mask, Weights
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent.pca import PcaBasis, encoded, node_weights, on_grid, reflectance
from nacre.latent.recipes import PcaRecipe
from nacre.measured.merl import Resolution
from nacre.numerics.pca import BY_CHANNEL, BY_PERMUTATION, snapshots, strongest
from nacre.runtime.progress import Progress

_SLAB = 1 << 14  # nodes at a time


def train_components(
    materials: Sequence[Callable[[], Brdf]], recipe: PcaRecipe, _: Path | None, report: Progress
) -> PcaBasis:
    """Principal components of materials, each taken with its six permutations of the channels.

    Permuted materials are not made, see :class:`nacre.numerics.pca.ColoredComponents`. For
    parameters and errors see :meth:`nacre.latent.LatentBasis.train`; also raises NacreError if no
    node of the grid is known in all materials, or there are fewer components than values. It takes
    12 bytes of memory per node and material.
    """
    if len(materials) < 2:
        raise NacreError("principal components need two materials or more")
    logs, mask, names = _tabulated(materials, recipe.resolution, report)
    center = logs.mean(axis=(0, 1), dtype=np.float64).astype(np.float32)
    logs -= center
    report("components", 0, 1, "")
    parts = BY_CHANNEL if recipe.separate else BY_PERMUTATION
    found = [_components(logs, colors, recipe.code_dim) for colors in parts]
    chosen = strongest([variances for variances, _ in found], parts, recipe.code_dim)
    if len(chosen.variances) < recipe.code_dim:
        raise NacreError(
            f"{len(materials)} materials give {len(chosen.variances)} values of a code, not "
            f"{recipe.code_dim}; take more materials or a smaller code"
        )
    report("components", 1, 1, "")
    keys = list(zip(chosen.part.tolist(), chosen.component.tolist(), strict=True))
    used = list(dict.fromkeys(keys))
    return PcaBasis(
        recipe.resolution,
        mask,
        center,
        np.stack([found[part][1][component] for part, component in used]),
        np.array([used.index(key) for key in keys]),
        chosen.colors.astype(np.float32),
        np.sqrt(chosen.variances).astype(np.float32),
        {"materials": names, "separate": recipe.separate},
    )


def _tabulated(
    materials: Sequence[Callable[[], Brdf]], resolution: Resolution, report: Progress
) -> tuple[Weights, Mask, list[str]]:
    """ln(f w + e) at the nodes where all are known, shape (materials, 3, nodes); these; names."""
    weights = node_weights(resolution)
    mask = np.ones(resolution.dimensions, bool)
    rows: list[Weights] = []
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


def _components(logs: Weights, colors: Floats, limit: int) -> tuple[Doubles, Weights]:
    """Variances of one value, and components, of the parts of materials along some colors."""
    materials, _, nodes = logs.shape

    def slabs() -> Iterator[Doubles]:
        for start in range(0, nodes, _SLAB):
            slab = logs[:, :, start : start + _SLAB]
            part = np.einsum("gc,mcn->mgn", colors, slab, optimize=True)
            yield np.asarray(part.reshape(-1, part.shape[2]), np.float64)

    squares, components = snapshots(slabs, limit)
    return squares / (materials * len(colors)), components
