"""What is in a file of a codec, in words and numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from nacre.io.files import PathLike
from nacre.io.tensors import format_errors, from_file
from nacre.numerics.mlp import Layer
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.codec_file import KEY, LIMIT, unpack_codec


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
