"""Codecs of every kind as `.safetensors` files: tensors, and what they mean as JSON."""

from __future__ import annotations

import hashlib
from typing import Any

from nacre.errors import FormatError
from nacre.io.files import PathLike, write_encoded
from nacre.io.tensors import Tensors, format_errors, from_file, to_bytes
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.file import MODEL, pack_basis, unpack_basis
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.principal import file as principal_file
from nacre.textures.codecs.principal.codec import PcaCodec

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
