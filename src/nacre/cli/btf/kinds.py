"""What a file is, where a command takes another kind."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

from nacre.errors import FormatError, NacreError

Kind: TypeAlias = Literal["a texture", "an encoded texture", "a model of textures"]

_TAKEN_BY: dict[Kind, str] = {
    "a texture": "nacre btf encode encodes it, nacre btf train learns a model of some",
    "an encoded texture": "nacre btf decode and the commands on textures take it",
    "a model of textures": "nacre btf encode --model takes it",
}


def expect(path: Path, *wanted: Kind) -> None:
    """Refuse a file that is plainly of another kind, and say which commands take it.

    What is damaged, absent or of no known kind is left to its reader.

    Raises
    ------
    FormatError
        If it is of none that are wanted.
    """
    from nacre.formats import is_btf
    from nacre.io.tensors import has_header
    from nacre.textures.codecs.codec_file import KEY as MODEL
    from nacre.textures.latent_file import KEY as CODE

    kind: Kind
    if has_header(path, CODE):
        kind = "an encoded texture"
    elif has_header(path, MODEL):
        kind = "a model of textures"
    elif is_btf(path):
        kind = "a texture"
    elif _is_material(path):
        raise FormatError(f"{path}: is one material, expected {wanted[0]}; see nacre info")
    else:
        return
    if kind not in wanted:
        raise FormatError(f"{path}: is {kind}, expected {wanted[0]}; {_TAKEN_BY[kind]}")


def _is_material(path: Path) -> bool:
    from nacre.formats import load_brdf

    if not path.is_file():
        return False
    try:
        load_brdf(path)
    except NacreError:
        return False
    return True
