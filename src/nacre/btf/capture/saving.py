"""Textures as NumPy archives."""

from __future__ import annotations

import numpy as np

from nacre.btf.texture import TableBtf
from nacre.files import PathLike, atomic_path


def save(btf: TableBtf, path: PathLike) -> None:
    """Write values, directions and the name, whole or not at all."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, values=btf.values, wi=btf.wi, wo=btf.wo, name=btf.name)
