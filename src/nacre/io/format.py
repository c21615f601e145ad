"""An entry of the registry of file formats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HEAD = 128
"""Bytes from the start of a file that :attr:`Format.recognize` sees."""


@dataclass(frozen=True)
class Format:
    """One entry of the registry of file formats.

    Parameters
    ----------
    name
        Short name, as shown to people: "MERL".
    extensions
        File name endings, lower case, with the dot.
    recognize
        Whether the first bytes of a file (up to :data:`HEAD`) are of this format; None where they
        cannot tell: the file name decides, and only if no other format recognizes the content.
    load
        Reads a path into a reflectance; raises only :class:`FormatError`.
    save
        Writes a reflectance to a path, whole or not at all; None for a format we only read.
    isotropic
        Whether only isotropic reflectance can be written.
    holds
        "neural" or "analytic" where only such materials can be written, else empty.
    resolution
        Makes of numbers of nodes what `save` takes as keyword `resolution`: a dataclass whose
        fields name the numbers and which raises :class:`ValueError` for those it cannot have. None
        where the resolution is fixed.
    keeps_bands
        Whether `save` keeps the spectra of a reflectance that has some, rather than their color.
    several
        Whether a file holds several materials: `load` then takes the name of one as well, or None.
    claims
        Whether a file that lies in a folder among others is of this format, for endings that other
        files have too; must not raise. None where the ending says it, also of a damaged file.
    """

    name: str
    extensions: tuple[str, ...]
    recognize: Callable[[bytes], bool] | None
    load: Callable[..., Any]
    save: Callable[..., Any] | None = None
    isotropic: bool = False
    holds: str = ""
    resolution: type[Any] | None = None
    keeps_bands: Callable[[Any], bool] = lambda brdf: False
    several: bool = False
    claims: Callable[[Path], bool] | None = None
