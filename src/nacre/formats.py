"""The registry of file formats, and load() and save() over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path

from nacre.analytic import FORMATS as ANALYTIC
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.io.files import PathLike, digest, read_head
from nacre.io.format import Format
from nacre.io.tensors import has_header
from nacre.measured import FORMATS as MEASURED
from nacre.neural.file import FORMAT as NEURAL
from nacre.neural.published import FORMATS as PUBLISHED
from nacre.textures.formats import is_btf
from nacre.textures.latent_file import KEY as CODES
from nacre.textures.latent_file import load_latent_map
from nacre.textures.uniform import material_of

_MODELS: tuple[Format, ...] = (NEURAL, *ANALYTIC, *PUBLISHED)
_formats: list[Format] = [NEURAL, *ANALYTIC, *MEASURED, *PUBLISHED]


def formats() -> tuple[Format, ...]:
    """Every known format."""
    return tuple(_formats)


def register(entry: Format) -> None:
    """Add a format; it is asked before those already known."""
    _formats.insert(0, entry)


def is_measured(path: PathLike) -> bool:
    """Whether a file in a folder is taken for measured reflectance, by its ending or its content.

    That is so if it has an ending of a format for measurements, neither of the neural nor of the
    analytic ones. Where other files have the ending too, as images do, its content must be of the
    format; else damaged files count as well.
    """
    return any(entry.claims is None or entry.claims(Path(path)) for entry in _of_ending(path))


def has_measured_ending(path: PathLike) -> bool:
    """Whether a file has an ending that measured reflectance has, whatever is in it."""
    return bool(_of_ending(path))


def _of_ending(path: PathLike) -> list[Format]:
    suffix = Path(path).suffix.lower()
    return [e for e in _formats if suffix in e.extensions and e not in _MODELS]


def load(path: PathLike, material: str | None = None) -> Brdf:
    """Read a reflectance from any known file.

    The reader is picked by content; the file name decides only between readers that both
    recognize the content, and for formats whose content starts with nothing to recognize.

    Parameters
    ----------
    path
        A measured table, a neural or analytic material, or an encoded texture of one texel.
    material
        Name of a material, for files that hold several.

    Raises
    ------
    FormatError
        If the file is absent, of no known format, or damaged, or if it has no such material.
    """
    path = Path(path)
    if is_btf(path):
        return _of_texture(path)
    head = read_head(path)
    suffix = path.suffix.lower()
    known = [entry for entry in _formats if entry.recognize and entry.recognize(head)]
    if not known:
        known = [e for e in _formats if e.recognize is None and suffix in e.extensions]
    if not known:
        endings = ", ".join(e for entry in _formats for e in entry.extensions)
        raise FormatError(f"{path}: content is of no known format (known: {endings})")
    named = [entry for entry in known if suffix in entry.extensions]
    entry = (named or known)[0]
    if material is not None and not entry.several:
        raise FormatError(f"{path}: holds one material; leave out the name {material!r}")
    brdf: Brdf = entry.load(path, material) if entry.several else entry.load(path)
    source = {"file": path.name, "sha256": digest(path)}
    return brdf.replaced(source=source, name=brdf.name or path.stem)


def _of_texture(path: Path) -> Brdf:
    """The material of an encoded texture of one texel."""
    try:
        if not has_header(path, CODES):
            raise ValueError("is a texture (BTF), not one material")
        brdf = material_of(load_latent_map(path))
    except FormatError:
        raise
    except ValueError as error:
        told = "see nacre btf info, or nacre btf average, which makes one of it"
        raise FormatError(f"{path}: {error}; {told}") from error
    source = {"file": path.name, "sha256": digest(path)}
    return brdf.replaced(source=source, name=brdf.name or path.stem)


def save(brdf: Brdf, path: PathLike) -> None:
    """Write a reflectance to the format that the file name ends in.

    Parameters
    ----------
    brdf
        A neural material for `.safetensors` and `.h5`, an analytic one for `.json`; any reflectance
        for tables.
    path
        File to write; replaced only by a whole new one.

    Raises
    ------
    FormatError
        If no format with this ending can be written, or not from this reflectance.
    """
    writer(path)(brdf, Path(path))


def target(path: PathLike) -> Format:
    """The format that is written to a file of this name.

    Raises
    ------
    FormatError
        If no format with this ending can be written.
    """
    suffix = Path(path).suffix.lower()
    for entry in _formats:
        if suffix in entry.extensions and entry.save is not None:
            return entry
    endings = ", ".join(e for entry in _formats if entry.save for e in entry.extensions)
    raise FormatError(f"{path}: no format to write ends in {suffix!r} (known: {endings})")


def loses_bands(brdf: Brdf, path: PathLike) -> bool:
    """Whether :func:`save` would write only the color of a reflectance with spectra.

    Raises
    ------
    FormatError
        If no format with this ending can be written.
    """
    return brdf.wavelengths is not None and not target(path).keeps_bands(brdf)


def writer(
    path: PathLike, resolution: Sequence[int] | None = None
) -> Callable[[Brdf, Path], object]:
    """The function that writes what a file name ends in.

    Parameters
    ----------
    path
        Name of the file.
    resolution
        Numbers of nodes of a table; those that the format has by default where None.

    Raises
    ------
    FormatError
        If there is none, or its tables cannot have this resolution.
    """
    entry = target(path)
    assert entry.save is not None
    if resolution is None:
        return entry.save
    if entry.resolution is None:
        raise FormatError(f"{path}: resolution: that of {entry.name} files is fixed")
    names = [field.name for field in fields(entry.resolution)]
    given = ",".join(map(str, resolution))
    if len(resolution) != len(names):
        raise FormatError(f"{path}: resolution: expected {','.join(names)}, got {given}")
    try:
        return partial(entry.save, resolution=entry.resolution(*resolution))
    except ValueError as error:
        raise FormatError(f"{path}: resolution {given} ({','.join(names)}): {error}") from error


def check_target(path: PathLike, brdf: Brdf) -> None:
    """Raise now what writing a reflectance would raise when the work for it is done.

    The work is to tabulate it, or to fit a network to it.

    Parameters
    ----------
    path
        File to write.
    brdf
        What is to be written, or what is fitted by that.

    Raises
    ------
    FormatError
        If the format cannot hold it.
    """
    entry = target(path)
    name = brdf.name or "this material"
    if entry.isotropic and not brdf.isotropic:
        raise FormatError(
            f"{path}: {entry.name} files hold isotropic reflectance only; {name} is anisotropic"
        )
