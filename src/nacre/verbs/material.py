"""What verbs are given: a material, the path of one, or the name of one that comes with nacre."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.formats import identify, load, load_brdf
from nacre.included import Material, resolve
from nacre.io.files import PathLike

Given: TypeAlias = Brdf | Btf | Material | PathLike
"""A material; a file, a folder of images, or a name like "rgl:paper_white"; or an item of
:func:`nacre.materials`."""

_OUTPUTS = (".png", ".jpg", ".jpeg", ".gif", ".webp", ".svg", ".pdf", ".html")


def opened(given: Given, **options: Any) -> Brdf | Btf:
    """The material that was given, or the one in the file: an encoded texel is a reflectance.

    `options` are those of :func:`nacre.load`; they are for a path only, None counts as not given.

    Raises
    ------
    FormatError
        As :func:`nacre.load`.
    TypeError
        If it is neither a material nor a path.
    """
    if isinstance(given, Brdf | Btf):
        for name in (name for name, value in options.items() if value is not None):
            raise TypeError(f"{name} is for the path of a material, not for a material in memory")
        return given
    path = path_of(given)
    if path is None:
        raise TypeError(
            f"expected a material, or the path or name of one, got {type(given).__name__}"
        )
    if not path.exists() and path.suffix.lower() in _OUTPUTS:
        raise FormatError(
            f"{path}: there is no such file; to write it, call .save({str(path)!r}) on the result"
        )
    found = load(path, **options)
    if isinstance(found, Btf) and found.texel_count == 1 and identify(path).load_material:
        return load_brdf(path)
    return found


def path_of(given: object) -> Path | None:
    """The file that a path, a name or an item of :func:`nacre.materials` stands for; else None."""
    if isinstance(given, Material):
        return given.path
    return resolve(given) if isinstance(given, str | os.PathLike) else None


def label(given: Given) -> str:
    """What to call it: by the file where a path was given, else by the material's name."""
    if isinstance(given, Brdf | Btf | Material):
        return given.name or type(given).__name__
    path = Path(given)
    return path.resolve().name if path.exists() else str(given)


def closest(word: str, known: Iterable[str]) -> str:
    """A hint to what was probably meant, "; did you mean 'epochs'?"; else what is known."""
    names = list(known)
    near = difflib.get_close_matches(word, names, 1, 0.6)
    return f"; did you mean {near[0]!r}?" if near else f" (known: {', '.join(names)})"
