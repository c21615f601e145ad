"""Codecs of every kind as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from nacre.errors import FormatError
from nacre.io.files import PathLike, write_encoded
from nacre.io.tensors import Tensors, format_errors, from_file, to_bytes
from nacre.numerics.layer import Layer
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.file import MODEL, pack_basis, unpack_basis
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.principal import file as principal_file
from nacre.textures.codecs.principal.codec import PcaCodec

PUBLISHED = Path(__file__).parents[1] / "nacre-btf.safetensors"
"""The default codec, 32 values, trained on 77 virtual captures.

By `nacre btf capture --all -o captured` and `nacre btf train captured/train/*.npz --half -o FILE`.
"""


KEY = "nacre texel network"
"""Name of the header in a file."""
LIMIT = 1 << 29
"""Bytes of a file."""
_NETWORKS = "unified", "custom"


def save_codec(codec: TexelCodec, path: PathLike, precision: str | None = "single") -> None:
    """Write a codec; the same codec gives the same bytes.

    Parameters
    ----------
    codec, path
        What to write, and where.
    precision
        Of the weights; see :func:`pack_codec`.

    Raises
    ------
    FormatError
        If the path cannot be written, or a weight is too large.
    """

    def encode(content: TexelCodec) -> bytes:
        return to_bytes(KEY, *pack_codec(content, precision), LIMIT)

    write_encoded(path, encode, codec)


def load_codec(path: PathLike) -> TexelCodec:
    """Read a codec.

    Raises
    ------
    FormatError
        If the file is not a whole codec of a kind and version we know.
    MissingExtraError
        If the codec is a network of the papers and PyTorch is not installed.
    """
    header, tensors = from_file(path, KEY, LIMIT, "a model of textures")
    with format_errors(path):
        return unpack_codec(header, tensors)


def codec_fingerprint(codec: TexelCodec) -> str:
    """SHA-256, in hexadecimal, of what a file of the codec holds: codecs of one mark are the same.

    It does not matter whether the codec was embedded or lay in a file of its own, nor in which
    precision, if that changed no weight.
    """
    header, tensors = pack_codec(codec, None)
    return hashlib.sha256(to_bytes(KEY, header, tensors, LIMIT)).hexdigest()


def pack_codec(
    codec: TexelCodec, precision: str | None = "single"
) -> tuple[dict[str, Any], Tensors]:
    """Header and tensors of a codec.

    Parameters
    ----------
    codec
        To pack.
    precision
        Of the weights, one of :data:`nacre.io.tensors.PRECISIONS`; the least that changes no weight
        where None. Principal components are single always.

    Raises
    ------
    FormatError
        If a weight is not finite or too large.
    """
    if isinstance(codec, BasisCodec):
        return pack_basis(codec, precision)
    if isinstance(codec, PcaCodec):
        return principal_file.pack_components(codec)
    from nacre.textures.codecs.networks.file import pack_network
    from nacre.textures.codecs.networks.network import TexelNetwork

    if not isinstance(codec, TexelNetwork):
        raise FormatError(f"a {type(codec).__name__} is of no kind that files hold")
    return pack_network(codec, precision)


def unpack_codec(header: dict[str, Any], tensors: Tensors) -> TexelCodec:
    """The codec that :func:`pack_codec` packed.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError, OverflowError
        If a field is missing or bad.
    MissingExtraError
        See :func:`load_codec`.
    """
    if header["model"] == MODEL:
        return unpack_basis(header, tensors)
    if header["model"] == principal_file.MODEL:
        return principal_file.unpack_components(header, tensors)
    if header["model"] not in _NETWORKS:
        raise ValueError(f"unknown model {header['model']!r}; update nacre")
    from nacre.textures.codecs.networks.file import unpack_network

    return unpack_network(header, tensors)


def codec_facts(path: PathLike) -> dict[str, Any]:
    """Facts about a codec in the order they should be shown, JSON-able.

    Parameters
    ----------
    path
        As :func:`nacre.textures.codecs.load_codec` takes it.

    Raises
    ------
    FormatError, MissingExtraError
        See :func:`nacre.textures.codecs.load_codec`.
    """
    header, tensors = from_file(path, KEY, LIMIT, "a model of textures")
    with format_errors(path):
        codec = unpack_codec(header, tensors)
    sizes = _sizes(codec) if isinstance(codec, BasisCodec) else header.get("settings", {})
    weights = [array for name, array in tensors.items() if name not in ("wi", "wo")]
    facts = {
        "model": header["model"],
        "values a code": codec.values,
        "directions": f"{len(tensors['wi']):,} pairs" if "wi" in tensors else "any",
        **{name.replace("_", " "): size for name, size in sizes.items() if name != "latent"},
        "weights": sum(array.size for array in weights),
        "precision": sorted({str(array.dtype) for array in weights}),
    }
    last = {"file": str(path), "bytes": Path(path).stat().st_size}
    training = {k: v for k, v in _flat(header["metadata"]) if k not in facts}
    return facts | training | last


def _sizes(codec: BasisCodec) -> dict[str, Any]:
    """Functions, and units of the layers of each network from inputs to outputs."""
    functions = codec.functions
    networks = {
        "functions": [*functions.hidden, functions.wide, functions.last],
        "completion": codec.complete.layers,
        "encoder": codec.encode.layers,
        "decoder": codec.decode.layers,
    }
    return {
        "functions of gray values": functions.greys,
        "functions of colors": functions.chromas,
        **{f"layers, {name}": _widths(layers) for name, layers in networks.items()},
    }


def _widths(layers: Sequence[Layer]) -> list[int]:
    return [len(layers[0].weights), *(len(layer.biases) for layer in layers)]


def _flat(metadata: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """What is known of the training, without objects within objects."""
    for name, value in metadata.items():
        if name == "materials" and isinstance(value, list):
            yield "materials in training", len(value)
        if isinstance(value, dict):
            yield from ((f"{name}, {key.replace('_', ' ')}", item) for key, item in value.items())
        else:
            yield name, value
