"""Textures of several materials, for training and unseen ones."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.figures.texel_map import family
from nacre.formats import is_btf, load_btf
from nacre.measured.textures.transposition import transposed

UNSEEN = "12"
"""Names with this ending are unseen, as in Rainer et al. 2020, section 4."""
_SAMPLED = 8
"""Number of texels or pictures that identify a texture."""


@dataclass(frozen=True)
class Material:
    """A texture in a file or folder."""

    path: Path

    @property
    def name(self) -> str:
        """The name of the file without its ending."""
        return self.path.stem

    @property
    def family(self) -> str:
        """See :func:`nacre.figures.texel_map.family`."""
        return family(self.name)

    def load(self) -> Btf:
        """The texture."""
        return load_btf(self.path)

    def opened(self) -> AbstractContextManager[Btf]:
        """The texture with fast access to texels."""
        return transposed(self.load())

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of size, directions and some values, which identifies results."""
        texture = self.load()
        total = hashlib.sha256(f"{texture.width} {texture.height}".encode())
        count = texture.pair_count if texture.by_image else texture.texel_count
        chosen = np.linspace(0, count - 1, min(_SAMPLED, count)).astype(np.intp)
        values = texture.images(chosen) if texture.by_image else texture.texels(chosen)
        for array in (texture.wi, texture.wo, values):
            total.update(np.ascontiguousarray(array).tobytes())
        return total.hexdigest()


def collect(paths: Sequence[Path]) -> list[Material]:
    """Materials from files, and from all files in folders and below, by name.

    Raises
    ------
    NacreError
        If a path does not exist, a folder has no texture, or two textures have the same name.
    """
    found: list[Path] = []
    for path in paths:
        if is_btf(path) or not path.is_dir():
            load_btf(path)  # reports what is wrong with it
            found.append(path)
            continue
        inside = [p for p in sorted(path.rglob("*")) if p.is_file() and is_btf(p)]
        if not inside:
            raise NacreError(f"{path}: has no textures; name files or a folder with some")
        found += inside
    names: dict[str, Path] = {}
    for path in found:
        other = names.setdefault(path.stem, path)
        if other != path:
            raise NacreError(f"{path}: has the name of {other}; rename one")
    return [Material(names[name]) for name in sorted(names)]


def separate(
    materials: Sequence[Material], unseen: Sequence[str] = ()
) -> tuple[list[Material], list[Material]]:
    """Materials for training, and unseen ones: the named ones, or those ending in :data:`UNSEEN`.

    Raises
    ------
    NacreError
        If there are none of one kind, or a name is unknown.
    """
    known = {material.name for material in materials}
    if unknown := [name for name in unseen if name not in known]:
        raise NacreError(f"{unknown[0]}: is not one of the textures ({', '.join(sorted(known))})")
    kept = set(unseen) or {name for name in known if name.endswith(UNSEEN)}
    training = [m for m in materials if m.name not in kept]
    if not kept:
        raise NacreError(f"no texture's name ends in {UNSEEN}; name those to keep with --unseen")
    if not training:
        raise NacreError("all textures are unseen; add others to train on")
    return training, [m for m in materials if m.name in kept]
