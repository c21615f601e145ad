"""Materials that commands are given: what a file is, and what takes other kinds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from nacre.cli.options import refuse

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.btf import Btf
    from nacre.measured.textures.image_folder import Quantity

_NAMES = {"brdf": "a reflectance", "btf": "a texture"}


def kind_of(path: Path, *, refusing: bool = True) -> Literal["brdf", "btf"]:
    """Whether a path is a reflectance or a texture.

    A texture of one texel that was encoded is a reflectance.

    Parameters
    ----------
    path
        File or folder.
    refusing
        Refuse options on the command line that are for the other kind.

    Raises
    ------
    UsageError
        If there is an option on the command line that is for the other kind.
    """
    from nacre.io.tensors import has_header
    from nacre.textures.formats import is_btf
    from nacre.textures.latent_file import KEY, load_latent_map

    texture = is_btf(path)
    if texture and has_header(path, KEY):
        texture = load_latent_map(path).codes.shape[:2] != (1, 1)
    kind: Literal["brdf", "btf"] = "btf" if texture else "brdf"
    if refusing:
        refuse(("brdf", "network") if texture else ("btf",), f"{path} is {_NAMES[kind]}")
    return kind


def load_reflectance(path: Path, material: str | None = None) -> Brdf:
    """Read a reflectance.

    Raises
    ------
    FormatError
        If it cannot be read, or is a texture; the message names what makes a reflectance of one.
    """
    from nacre.formats import load

    return load(path, material)


def load_texture(path: Path, pixels: Quantity | None = None) -> Btf:
    """Read a texture; `pixels` is what those of a folder of images mean.

    Raises
    ------
    FormatError
        If it cannot be read, or is none.
    """
    from nacre.textures.formats import load

    return load(path, pixels)
