"""The map of Figure 1: codes of texels of all materials in a plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from nacre.errors import NacreError
from nacre.figures.page import INK
from nacre.figures.texel_map import scatter_families
from nacre.latent.map import embed
from nacre_lab.reproduce.chart import charts
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import markdown_table
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.methods import Method
from nacre_lab.reproduce.textures.study import Study

TEXELS = 40
"""Random texels of each material."""
_NEIGHBORS = 10
_PANEL = 5.0
"""Inches."""
_DOT = 7.0
"""Square points."""


def tsne(study: Study, methods: Sequence[Method]) -> Outcome:
    """Places of codes by t-SNE, and the fraction of neighbors of the same material.

    Codes are scaled so that all values have the same spread, which no codec guarantees.

    Raises
    ------
    NacreError
        If each material has its own codec, or there are too few materials.
    """
    materials = sorted([*study.training, *study.unseen], key=lambda m: (m.family, m.name))
    rows: list[Sequence[object]] = []
    lines: list[list[str]] = []
    panels: dict[str, tuple[list[Material], npt.NDArray[np.float64]]] = {}
    for method in methods:
        if method.own:
            raise NacreError(f"{method.name}: each material has its own codes; choose another")
        found = [(material, study.codes(method, material, TEXELS)) for material in materials]
        known = [(material, codes) for material, codes in found if codes is not None]
        if not known:
            continue
        of = [material for material, codes in known for _ in codes]
        codes = np.concatenate([codes for _, codes in known]).astype(np.float64)
        codes = (codes - codes.mean(0)) / np.maximum(codes.std(0), 1e-9)
        study.progress(f"{method.name}, t-SNE", 0, 1, "")
        places = embed(codes, study.settings.seed)
        study.progress(f"{method.name}, t-SNE", 1, 1, "")
        panels[method.name] = of, places
        for material, (x, y) in zip(of, places, strict=True):
            rows.append((method.name, material.name, material.family, float(x), float(y)))
        fractions = [_alike(codes, [getattr(m, what) for m in of]) for what in ("name", "family")]
        lines.append(
            [method.name, str(len(codes)), *(f"{100.0 * part:.1f} %" for part in fractions)]
        )
    head = ["codes", "texels", f"of {_NEIGHBORS} nearest, same material", "same family"]
    columns = ("method", "material", "family", "x", "y")
    unseen = {material.name for material in study.unseen}
    pages = {"": _page(panels, unseen)} if panels else {}
    return Outcome(pages, columns, rows, markdown_table(head, lines))


def _alike(codes: npt.NDArray[np.float64], labels: Sequence[str]) -> float:
    """Fraction of the nearest codes of each code that have its label."""
    count = min(_NEIGHBORS, len(codes) - 1)
    _, nearest = KDTree(codes).query(codes, count + 1)
    names = np.unique(labels, return_inverse=True)[1].reshape(-1)
    others = nearest[:, 1:] if count else nearest
    return float((names[others] == names[:, None]).mean())


def _page(
    panels: dict[str, tuple[list[Material], npt.NDArray[np.float64]]], unseen: set[str]
) -> Any:
    """A map for each method, colored by family; texels of unseen materials are ringed."""
    figure, axes_of = charts(len(panels), _PANEL * len(panels) + 1.2, _PANEL + 0.3)
    for axes, (name, (of, places)) in zip(axes_of, panels.items(), strict=True):
        ringed = np.array([material.name in unseen for material in of])
        scatter_families(axes, places, [material.family for material in of], ringed, _DOT)
        axes.set_title(name, fontsize=9, color=INK)
    axes.legend(
        fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), markerscale=2.0
    )
    return figure
