"""Kinds of materials, told from the names of a basis's training materials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nacre.errors import NacreError, did_you_mean
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
"""Parts of names that tell the kind of a material: that of the first kind with a part in its name,
so acrylic felt is fabric and gold paint is paint. They cover the names in MERL, RGL and Nielsen et
al. 2015, and so in the included basis; other names tell no kind."""


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
    """Indices of the training materials of a kind of :data:`KINDS`, or with a text in their names.

    Raises NacreError if there is no such material.
    """
    names = [str(name) for name in basis.metadata.get("materials", [])]
    known = kinds(names)
    found = known.get(kind.lower()) or [
        index for index, name in enumerate(names) if kind and kind.lower() in name.lower()
    ]
    if not found:
        there = f"kinds are {', '.join(known)}" if known else "their names tell no kind"
        hint = did_you_mean(kind, known, there)
        raise NacreError(f"the basis was trained on no material like {kind!r}{hint}")
    return found
