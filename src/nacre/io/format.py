"""An entry of the registry of file formats."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
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
    """File name endings, lower case, with the dot. A first one of two words, as ".zemax.bsdf", is
    the only one to write: the last word alone is another format's, or any file's."""
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
    keeps_uncertainty: bool = False
    """Whether `save` keeps the standard uncertainties of scattered samples."""
    materials: Callable[[Path], Sequence[str]] | None = None
    """Names of the materials in a file, "" for those without one, for a format whose files hold
    several; raises :class:`nacre.FormatError`. `load` then takes a second argument, what a user
    gave to choose one of them, or None (:func:`nacre.io.names.chosen`)."""
    claims: Callable[[Path], bool] | None = None
    """Whether a file is of this format, where its ending and its first bytes do not tell; must not
    raise. None where they do."""
    claims_folder: Callable[[Path], bool] | None = None
    """Whether a folder of images is of this format; must not raise. None for a format of files."""
    load_material: Callable[[Path], Any] | None = None
    """Reads a texture of one texel as a reflectance, where the format has these; raises
    :class:`nacre.FormatError` for a larger one."""

    @property
    def written(self) -> tuple[str, ...]:
        """Endings of the files that `save` makes."""
        return self.extensions[:1] if self.extensions[0].count(".") > 1 else self.extensions


@dataclass(frozen=True)
class Signature:
    """What the registry knows of a format before it imports the module that has the entry.

    It leaves out formats that a file cannot be of; among the others, the entries decide. Most files
    leave one.
    """

    place: str
    """Where the entry is: "nacre.measured.rgl:FORMAT"."""
    extensions: tuple[str, ...]
    """As in the entry, like `kind` and `measured`."""
    pattern: bytes | None
    """A regular expression of bytes, found somewhere in the first :data:`HEAD` bytes of every file
    of this format, where a dot stands for any byte: `rb"\\Atensor_file\\0"` for bytes at the start,
    `rb"<materialx"` for a word behind comments. None where the entry has no `recognize`."""
    kind: Kind = "brdf"
    measured: bool = True
    writes: bool = True
    """Whether the entry has `save`."""
    folders: bool = False
    """Whether it has `claims_folder`."""
    by_ending: bool = False
    """Whether it takes text of its endings that no format recognizes by the content."""

    def allows(self, head: bytes) -> bool:
        """Whether a file with these first bytes can be of this format by its content."""
        return self._compiled is not None and self._compiled.search(head) is not None

    @cached_property
    def _compiled(self) -> re.Pattern[bytes] | None:
        return None if self.pattern is None else re.compile(self.pattern, re.DOTALL)
