"""Textures in files as `nacre.textures` reads them."""

from __future__ import annotations

from pathlib import Path

from nacre.btf import TableBtf
from nacre.formats import save


def write(texture: TableBtf, path: Path) -> None:
    """Single precision, so that nothing is lost."""
    path.parent.mkdir(exist_ok=True)
    save(texture, path, precision="single")
