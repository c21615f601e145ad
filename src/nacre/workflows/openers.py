"""Ways to open a texture in another process, which are sent there."""

from __future__ import annotations

import io
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.formats import load_btf
from nacre.measured.textures.image_folder import Quantity
from nacre.workflows.identity import source_files, source_fingerprint

_SMALL = 1 << 20
"""Bytes of a pickled texture that is sent instead of its values."""


@dataclass(frozen=True)
class TextureFile:
    """Opens a texture by its path in another process, if it is the same there.

    Parameters
    ----------
    path, quantity, directions
        Absolute path, and as :func:`nacre.formats.load_btf` takes them.
    fingerprint
        See :func:`nacre.workflows.identity.source_fingerprint`.
    """

    path: Path
    quantity: Quantity | None
    directions: Path | None
    fingerprint: str

    def __call__(self) -> Btf:
        btf = load_btf(self.path, quantity=self.quantity, directions=self.directions)
        if source_fingerprint(self.path, source_files(self.path, btf)) != self.fingerprint:
            raise FormatError(f"{self.path}: has another size or time of change than the owner's")
        return btf


@dataclass(frozen=True)
class PickledTexture:
    """A texture that takes few bytes, such as one that is computed."""

    btf: Btf

    def __call__(self) -> Btf:
        return self.btf


class _LargeError(Exception):
    pass


class _Pickler(pickle.Pickler):
    """Refuses large arrays before they are copied."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, np.ndarray) and value.nbytes > _SMALL:
            raise _LargeError
        return NotImplemented


def pickled(btf: Btf) -> PickledTexture | None:
    """A texture to send, if it can be pickled in few bytes."""
    file = io.BytesIO()
    try:
        _Pickler(file).dump(btf)
    except Exception:  # whatever an attribute that cannot be pickled raises
        return None
    return PickledTexture(btf) if len(file.getvalue()) <= _SMALL else None
