"""The registry of formats of textures, and load() and save() over it."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.io.files import PathLike, first_bytes, read_head
from nacre.io.format import Format
from nacre.measured.textures import archive, photographs, ubo2014, utia_folder
from nacre.measured.textures.image_folder import Quantity
from nacre.measured.textures.ubo2014.writer import Loss
from nacre.textures import latent_file

_FOLDERS: tuple[Format, ...] = (utia_folder.FORMAT, photographs.FORMAT)
FORMATS: tuple[Format, ...] = (
    ubo2014.FORMAT,
    archive.FORMAT,
    latent_file.FORMAT,
    *_FOLDERS,
)
"""Every format of textures, the most recognizable first."""


def load(path: PathLike, quantity: Quantity | None = None) -> Btf:
    """Read a texture from any known file or folder.

    Parameters
    ----------
    path
        A file, recognized by its content; a folder of images; or a list of photographs (`.csv`).
    quantity
        What the pixels of a folder of images hold, where its files do not say; see
        :data:`nacre.measured.textures.image_folder.Quantity`.

    Raises
    ------
    FormatError
        If the path is absent, of no known format, or damaged, or `quantity` is given for a file
        that is no folder of images.
    """
    path = Path(path)
    entry = recognized(path)
    if quantity is None:
        btf: Btf = entry.load(path)
        return btf
    if entry not in _FOLDERS:
        raise FormatError(f"{path}: {entry.name} files say what their values are; state nothing")
    btf = entry.load(path, quantity=quantity)
    return btf


def save(btf: Btf, path: PathLike, **options: Any) -> Loss | None:
    """Write a texture to the format that the file name ends in.

    Parameters
    ----------
    btf
        Any texture.
    path
        File to write; replaced only by a whole new one.
    options
        As its writer has them: `progress`, `precision` of an archive, `components` of a `.btf`.

    Returns
    -------
    loss
        Of a format that keeps some components of the values (`.btf`); else None.

    Raises
    ------
    FormatError
        If no format with this ending can be written, or it has no such option, or the path cannot
        be written.
    """
    entry = target(path)
    assert entry.save is not None
    for name in options.keys() - inspect.signature(entry.save).parameters.keys():
        raise FormatError(f"{path}: {name}: is not for {entry.name} files; leave it out")
    loss: Loss | None = entry.save(btf, Path(path), **options)
    return loss


def target(path: PathLike) -> Format:
    """The format that is written to a file of this name.

    Raises
    ------
    FormatError
        If no format with this ending can be written.
    """
    suffix = Path(path).suffix.lower()
    for entry in FORMATS:
        if suffix in entry.extensions and entry.save is not None:
            return entry
    endings = ", ".join(e for entry in FORMATS if entry.save for e in entry.extensions)
    if not suffix and Path(path).is_dir():
        raise FormatError(f"{path}: is a directory, expected a file name (known: {endings})")
    raise FormatError(f"{path}: no format of textures ends in {suffix!r} (known: {endings})")


def recognized(path: PathLike) -> Format:
    """The format of what lies at a path.

    Raises
    ------
    FormatError
        If there is nothing, or it is of no known format.
    """
    path = Path(path)
    if path.is_dir():
        for entry in _FOLDERS:
            if entry.claims is not None and entry.claims(path):
                return entry
        raise FormatError(
            f"{path}: is a directory with neither images named like tl000_pl000_tv000_pv000.png "
            f"nor a list {photographs.LIST}; where files in it are textures, name these"
        )
    head = read_head(path)
    for entry in FORMATS:
        if entry.recognize is not None and entry.recognize(head):
            return entry
    for entry in FORMATS:
        if entry.recognize is None and path.suffix.lower() in entry.extensions:
            return entry
    endings = ", ".join(e for entry in FORMATS for e in entry.extensions)
    raise FormatError(f"{path}: is no texture of a known format (known: {endings}, folders)")


def lies_in_images(path: PathLike) -> bool:
    """Whether a texture is a folder of images or a list of photographs.

    Raises
    ------
    FormatError
        If there is nothing, or it is of no known format.
    """
    return recognized(path) in _FOLDERS


def is_btf(path: PathLike) -> bool:
    """Whether a file or folder is a texture rather than one material; does not raise."""
    path = Path(path)
    if path.is_dir():
        return any(entry.claims is not None and entry.claims(path) for entry in _FOLDERS)
    head = first_bytes(path)
    return any(
        entry.recognize(head) and (entry.claims is None or entry.claims(path))
        for entry in FORMATS
        if entry.recognize is not None
    )
