"""What kind of material a file is, and which commands take other kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

from click import UsageError

from nacre.cli.options import refuse
from nacre.errors import FormatError

Kind: TypeAlias = Literal["a texture", "an encoded texture", "a texture codec"]

NAMES = {"brdf": "a reflectance", "btf": "a texture"}
_TAKEN_BY: dict[Kind, str] = {
    "a texture": "nacre fit encodes it, nacre btf train trains a codec on several",
    "an encoded texture": "nacre btf decode and all commands for textures take it",
    "a texture codec": "nacre fit --codec takes it",
}


def kind_of(path: Path, *, refusing: bool = True) -> Literal["brdf", "btf"]:
    """Whether a path is a reflectance or a texture; an encoded texel counts as a reflectance.

    Raises
    ------
    UsageError
        If an option for the other kind is given, unless `refusing` is false.
    FormatError
        If it is neither, or such an option is given and the file cannot be read.
    """
    from nacre.formats import identify, load_brdf, load_btf

    entry = identify(path)
    kind: Literal["brdf", "btf"] = entry.kind
    if kind == "btf" and entry.load_material is not None and load_btf(path).texel_count == 1:
        kind = "brdf"
    if refusing:
        try:
            refuse(("brdf", "network") if kind == "btf" else ("btf",), f"{path} is {NAMES[kind]}")
        except UsageError:
            load_btf(path) if kind == "btf" else load_brdf(path)  # report a damaged file first
            raise
    return kind


def check_pixels(path: Path, pixels: str | None) -> None:
    """Raise a FormatError if --pixels is given for a texture whose file defines its values."""
    from nacre.formats import identify

    if pixels is not None and identify(path).claims_folder is None:
        raise FormatError(f"{path}: defines its values itself; --pixels is for folders of images")


def expect(path: Path, *wanted: Kind) -> None:
    """Raise a FormatError if a file is clearly of another kind, naming the commands that take it.

    Damaged, absent and unknown files are left to the reader.
    """
    from nacre.formats import describe_kind, is_btf
    from nacre.io.tensors import has_header
    from nacre.textures.codecs.codec_file import KEY as CODEC
    from nacre.textures.latent_file import KEY as CODE

    kind: Kind
    if has_header(path, CODE):
        kind = "an encoded texture"
    elif has_header(path, CODEC):
        kind = "a texture codec"
    elif is_btf(path):
        kind = "a texture"
    elif described := describe_kind(path):
        raise FormatError(f"{path}: is {described}, expected {wanted[0]}")
    else:
        return
    if kind not in wanted:
        raise FormatError(f"{path}: is {kind}, expected {wanted[0]}; {_TAKEN_BY[kind]}")
