"""Kinds of materials by the names of what a basis was trained on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nacre.errors import NacreError
from nacre.latent.basis import LatentBasis

KINDS: Mapping[str, Sequence[str]] = {
    "fabric": ("fabric", "felt", "cloth"),
    "paper": ("paper", "cardboard"),
    "paint": ("paint",),
    "wood": ("wood", "walnut", "oak", "pine", "cherry"),
    "rubber": ("rubber", "latex"),
    "metal": ("steel", "chrome", "nickel", "alumini", "bronze", "brass", "copper", "ss440"),
    "plastic": ("plastic", "acrylic", "phenolic", "nylon", "delrin", "teflon", "pvc"),
}
"""Parts of names by the kind of material that they tell of. A material is of the first kind that
its name has a part of: acrylic felt is fabric, gold paint is paint. They are those of the materials
of MERL, RGL and Nielsen et al. 2015, so of the included basis; names that tell of no kind are of
none."""


def kinds(names: Sequence[str]) -> dict[str, list[int]]:
    """Indices of the materials of each kind, by their names; kinds without any are left out."""
    found: dict[str, list[int]] = {kind: [] for kind in KINDS}
    for index, name in enumerate(names):
        lower = name.lower()
        for kind, parts in KINDS.items():
            if any(part in lower for part in parts):
                found[kind].append(index)
                break
    return {kind: indices for kind, indices in found.items() if indices}


def members(basis: LatentBasis, kind: str) -> list[int]:
    """Indices of the training materials of a kind, or of those whose names have a text in them.

    Parameters
    ----------
    basis
        Its metadata has the names of its training materials.
    kind
        One of :data:`KINDS`, or a part of a name.

    Raises
    ------
    NacreError
        If there is no such material.
    """
    names = [str(name) for name in basis.metadata.get("materials", [])]
    known = kinds(names)
    found = known.get(kind.lower()) or [
        index for index, name in enumerate(names) if kind and kind.lower() in name.lower()
    ]
    if not found:
        there = f"kinds are {', '.join(known)}" if known else "their names tell of no kind"
        raise NacreError(f"the basis was trained on no material like {kind!r}; {there}")
    return found
