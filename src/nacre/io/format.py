"""An entry of the registry of file formats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

HEAD = 1024
"""Bytes from the start of a file that :attr:`Format.recognize` sees."""

Kind: TypeAlias = Literal["brdf", "btf"]
"""What a file holds: one material, or a texture of many."""


@dataclass(frozen=True)
class Format:
    """One entry of :data:`nacre.formats.FORMATS`."""

    name: str
    """Short name, as shown to people: "MERL"."""
    extensions: tuple[str, ...]
    """File name endings, lower case, with the dot."""
    recognize: Callable[[bytes], bool] | None
    """Whether the first bytes of a file (up to :data:`HEAD`) are of this format; None where they
    cannot tell: the file name decides, and only if no other format recognizes the content."""
    load: Callable[..., Any]
    """Reads a path into a :class:`nacre.Brdf` or, by `kind`, a :class:`nacre.Btf`; raises only
    :class:`nacre.FormatError`. Its further parameters are options of :func:`nacre.load`."""
    save: Callable[..., Any] | None = None
    """Writes a material to a path, whole or not at all; None for a format that is only read. Its
    further parameters are options of :func:`nacre.save`."""
    kind: Kind = "brdf"
    """What is read and written: "brdf", or "btf" for a texture."""
    isotropic: bool = False
    """Whether only isotropic reflectance can be written."""
    holds: str = ""
    """What alone can be written: "neural" or "analytic" materials; anything where empty."""
    model: str = ""
    """Name of the analytic model that files hold, where they hold one only; empty otherwise."""
    measured: bool = True
    """Whether a file in a folder of measurements counts as one of them."""
    resolution: type[Any] | None = None
    """Makes what `save` takes as keyword `resolution` from numbers of nodes: a dataclass whose
    fields name the numbers and which raises :class:`ValueError` for those it cannot have. None
    where the resolution is fixed."""
    keeps_bands: Callable[[Any, Path, bool], bool] = lambda brdf, path, anew: False
    """Whether `save` keeps the spectra of a reflectance that has some, rather than their color, in
    a file of a name; the last argument is whether a resolution is given."""
    several: bool = False
    """Whether a file holds several materials: `load` then takes the name of one as
    well, or None."""
    claims: Callable[[Path], bool] | None = None
    """Whether a file is of this format, where its ending and its first bytes do not tell; must not
    raise. None where they do."""
    claims_folder: Callable[[Path], bool] | None = None
    """Whether a folder of images is of this format; must not raise. None for a format of files."""
    load_material: Callable[[Path], Any] | None = None
    """Reads a texture of one texel as a reflectance, where the format has these; raises
    :class:`nacre.FormatError` for a larger one."""
