"""Codecs of every kind as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from nacre.io.files import PathLike, write_encoded
from nacre.io.tensors import Tensors, format_errors, from_file, to_bytes
from nacre.textures.codecs.codec import CODECS, TexelCodec

PRETRAINED: Mapping[str, Path] = {
    name: Path(__file__).parents[1] / file
    for name, file in (
        ("basis", "nacre-btf.safetensors"),
        ("unified", "nacre-unified.safetensors"),
    )
}
"""Included codecs of 32 values by name: nacre's own, and the network of Rainer et al. 2020.

Trained on 77 virtual captures: by `nacre btf capture --all -o captured`, then
`nacre btf train captured/train/*.npz --precision half -o FILE`, for the network with
`--model unified` and the steps that :func:`codec_facts` tells.
"""
PUBLISHED = PRETRAINED["basis"]  # the default codec
KEY = "nacre texel network"  # name of the header in a file
LIMIT = 1 << 29  # bytes of a file
_WHAT = "a model of textures"
_OTHER_NAMES = {"principal components": "pca"}  # kinds of codecs by names that files have for them


def save_codec(codec: TexelCodec, path: PathLike, precision: str | None = "single") -> None:
    """Write a codec; the same codec gives the same bytes.

    For the weights' precision see :meth:`TexelCodec.pack`. A FormatError says that the path cannot
    be written, or that a weight is too large.
    """

    def encode(content: TexelCodec) -> bytes:
        return to_bytes(KEY, *content.pack(precision), LIMIT)

    write_encoded(path, encode, codec)


def codec_path(codec: PathLike | None) -> Path:
    """The file of a codec: one of :data:`PRETRAINED` by name, the default one for None, else the
    path as it is given.
    """
    return PUBLISHED if codec is None else PRETRAINED.get(str(codec), Path(codec))


def load_codec(path: PathLike) -> TexelCodec:
    """Read a codec: a file, or one of :data:`PRETRAINED` by name.

    Raises a FormatError if the file is not a whole codec of a known kind and version, a NacreError
    if another package brings the kind of codec and does not load, and a MissingExtraError if the
    codec is a network from the papers and PyTorch is not installed.
    """
    path = codec_path(path)
    header, tensors = from_file(path, KEY, LIMIT, _WHAT)
    with format_errors(path):
        return unpack_codec(header, tensors)


def unpack_codec(header: dict[str, Any], tensors: Tensors) -> TexelCodec:
    """The codec of any kind that :meth:`TexelCodec.pack` packed.

    Raises what :meth:`TexelCodec.unpack` does where a field is missing or bad; for other errors see
    :func:`load_codec`.
    """
    name = header["model"]
    kind = _OTHER_NAMES.get(name, name)
    if not isinstance(kind, str) or kind not in CODECS:
        raise ValueError(f"unknown model {name!r}; update nacre or install its package")
    return CODECS[kind].unpack(header, tensors)


def codec_fingerprint(codec: TexelCodec) -> str:
    """SHA-256, in hexadecimal, of what a file of the codec holds.

    It does not depend on whether the codec was embedded or lay in a file of its own, nor on the
    precision, if that changed no weight.
    """
    return hashlib.sha256(to_bytes(KEY, *codec.pack(None), LIMIT)).hexdigest()


def codec_facts(path: PathLike) -> dict[str, Any]:
    """Facts about a codec in the order to print them, JSON-able; takes and raises what
    :func:`load_codec` does.
    """
    header, tensors = from_file(path, KEY, LIMIT, _WHAT)
    with format_errors(path):
        codec = unpack_codec(header, tensors)
    weights = [array for name, array in tensors.items() if name not in ("wi", "wo")]
    facts = {
        "model": header["model"],
        "latent size": codec.code_dim,
        "directions": f"{len(tensors['wi']):,} pairs" if "wi" in tensors else "any",
        **codec.describe(),
        "weights": sum(array.size for array in weights),
        "precision": sorted({str(array.dtype) for array in weights}),
    }
    last = {"file": str(path), "bytes": Path(path).stat().st_size}
    training = {k: v for k, v in _flat(codec.metadata) if k not in facts}
    return facts | training | last


def _flat(metadata: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in metadata.items():
        if name == "materials" and isinstance(value, list):
            yield "materials in training", len(value)
        if isinstance(value, dict):
            yield from ((f"{name}, {key.replace('_', ' ')}", item) for key, item in value.items())
        else:
            yield name, value
