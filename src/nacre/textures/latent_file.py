"""Maps of codes as `.safetensors` files, with their codec or the name of its file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.io.files import PathLike, digest, write_encoded
from nacre.io.format import Format
from nacre.io.tensors import (
    HALF_LARGEST,
    Tensors,
    check_header,
    check_numbers,
    format_errors,
    from_file,
    has_header,
    header_key,
    looks_like_tensors,
    to_bytes,
)
from nacre.measured.textures.directions import PAIR_LIMIT, check_directions
from nacre.measured.textures.domes import pairs
from nacre.runtime.progress import Progress, silent
from nacre.textures.alike import alike, same_codec
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.codecs.codec_file import PRETRAINED, load_codec, unpack_codec
from nacre.textures.compact import CompactCodes
from nacre.textures.latent_map import CodecFile, LatentMap, NeuralBtf
from nacre.textures.rates.rated_codes import RatedCodes
from nacre.textures.uniform import TexelBrdf, material_of

VERSION, RATED_VERSION = 1, 2  # of files with codes as they are, and of a limited rate
KEY = "nacre latent map"
_LIMIT = 1 << 32
_LARGEST = 1e9
"""Bound of codes in single precision: the default codec has 5 for each unit of reflectance."""
_COMPACT = "codes.axes", "codes.center"  # tensors beside codes that are compact
_CODEC = "codec."  # in front of the names of an embedded codec's tensors


def check_latent_path(path: PathLike) -> Path:
    """The path, if its ending is that of an encoded texture, else a FormatError; for use before
    long work.
    """
    path = Path(path)
    if path.suffix.lower() != ".safetensors":
        raise FormatError(f"{path}: an encoded texture is a .safetensors file")
    return path


def save_latent_map(latent: LatentMap, path: PathLike) -> None:
    """Write a map of codes; the same map gives the same bytes.

    An embedded codec is written in the lowest precision that changes none of its weights. Codes
    take few bytes if they come from :func:`nacre.textures.limited` or from such a file.

    Raises a FormatError if a code is not finite or the path cannot be written.
    """
    write_encoded(path, _encode, latent)


def load_latent_map(path: PathLike, levels: int | None = None) -> LatentMap:
    """Read a map of codes and its codec.

    With `levels`, from 1, only so many levels of detail are read from codes of a limited rate: the
    first are coarse pictures. The file may be cut short after them.

    Raises a FormatError if the file is not a whole map of a known version, or the codec that it
    names is not beside it or is another one, and a MissingExtraError if the codec is a network from
    the papers and PyTorch is not installed.
    """
    path = Path(path)
    cut = levels is not None
    header, tensors = from_file(path, KEY, _LIMIT, "a texture encoded by nacre", cut=cut)
    with format_errors(path):
        return _decode(path, header, tensors, levels)


def load_latent_maps(paths: Sequence[Path]) -> list[LatentMap]:
    """Read maps of codes with one codec, so that the codes of all can be compared.

    Raises what :func:`load_latent_map` does, and a FormatError if one was encoded by another codec
    than the first.
    """
    found = alike([load_latent_map(path) for path in paths])
    if (other := same_codec(found)) is not None:
        raise FormatError(
            f"{paths[other]}: was encoded by another model than {paths[0]}; encode it again with "
            "nacre fit --codec"
        )
    return list(found)


def _encode(latent: LatentMap) -> bytes:
    codes: dict[str, Any] = {}
    if latent.rated is not None:
        numbers, tensors = latent.rated.pack()
        codes = {"codes": numbers}
    else:
        try:
            _check_codes(latent.codes)
        except ValueError as error:
            raise FormatError(str(error)) from error
        tensors = {"codes": np.ascontiguousarray(latent.codes)}
    tensors |= _pack_pairs(latent)
    if latent.reference is None:
        model, weights = latent.codec.pack(None)
        tensors |= {f"{_CODEC}{name}": array for name, array in weights.items()}
    else:
        model = {"file": latent.reference.name, "sha256": latent.reference.sha256}
        if latent.reference.expanded:
            model["expanded"] = True
    version = RATED_VERSION if codes else VERSION
    header = {"version": version, "name": latent.name, "codec": model, "metadata": latent.metadata}
    return to_bytes(KEY, header | codes, tensors, _LIMIT)


def _check_codes(codes: npt.NDArray[Any]) -> None:
    check_numbers({"codes": codes}, HALF_LARGEST if codes.itemsize < 4 else _LARGEST)


def _decode(path: Path, header: dict[str, Any], tensors: Tensors, levels: int | None) -> LatentMap:
    check_header(header, RATED_VERSION if header["version"] == RATED_VERSION else VERSION)
    metadata, name, model = header["metadata"], header["name"], header["codec"]
    if not isinstance(metadata.get("errors", {}), dict):
        raise ValueError("errors in the metadata are not an object")
    if not isinstance(name, str) or not isinstance(model, dict):
        raise ValueError("name is not a text, or codec not an object")
    codes = _codes(path, header, tensors, levels)
    wi, wo = _unpack_pairs(str(path), tensors)
    codec, reference = _codec(path, model, tensors)
    return LatentMap(codes, codec, wi, wo, name, reference, metadata)


def _codes(path: Path, header: dict[str, Any], tensors: Tensors, levels: int | None) -> Any:
    """An array, or codes of a limited rate."""
    if header["version"] == RATED_VERSION:
        return RatedCodes.unpack(header["codes"], tensors, levels, str(path))
    if levels is not None:
        raise ValueError("codes have no levels: they are not of a limited rate")
    codes = tensors["codes"]
    if codes.dtype == np.uint8:
        codes = CompactCodes(codes, *(tensors[name] for name in _COMPACT)).codes
    _check_codes(codes)
    return codes


def _codec(
    path: Path, model: dict[str, Any], tensors: Tensors
) -> tuple[TexelCodec, CodecFile | None]:
    """The codec, and the file that it was read from if it is not embedded."""
    if "file" not in model:
        inside = {k.removeprefix(_CODEC): v for k, v in tensors.items() if k.startswith(_CODEC)}
        return unpack_codec(model, inside), None
    name, expected = model["file"], model["sha256"]
    if not isinstance(name, str) or not name or PurePath(name).name != name or "\0" in name:
        raise ValueError(f"codec: file {name!r:.80} is not the name of a file")
    if not isinstance(expected, str) or not re.fullmatch("[0-9a-f]{64}", expected):
        raise ValueError("codec: sha256 is not a SHA-256 in hexadecimal")
    beside = path.with_name(name)
    if not beside.exists():
        beside = next((path for path in PRETRAINED.values() if path.name == name), beside)
    if not beside.is_file():
        raise FormatError(
            f"{path}: refers to the model {name} (SHA-256 {expected[:12]}...), which is not in its "
            "folder; copy it there"
        )
    found = digest(beside)
    if found != expected:
        raise FormatError(
            f"{beside}: is another model (SHA-256 {found[:12]}...) than {path.name} was encoded "
            f"with ({expected[:12]}...); put that one beside it, or encode again"
        )
    codec = load_codec(beside)
    if model.get("expanded", False) is not True:
        return codec, CodecFile(name, expected)
    if (expanded := codec.expanded()) is None:
        raise ValueError("codec: has no coefficients that codes can be")
    return expanded, CodecFile(name, expected, expanded=True)


def _pack_pairs(latent: LatentMap) -> Tensors:
    """Distinct lights and views; the pairs that they make only where not every two do, in order."""
    sides: list[tuple[Floats, npt.NDArray[np.intp]]] = []
    for directions in (latent.wi, latent.wo):
        distinct, first, index = np.unique(
            np.asarray(directions, np.float32), axis=0, return_index=True, return_inverse=True
        )
        order = np.argsort(first)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        sides.append((distinct[order], rank[index.reshape(-1)]))
    (lights, light), (views, view) = sides
    packed: Tensors = {"lights": lights, "views": views}
    if not np.array_equal(view * len(lights) + light, np.arange(len(lights) * len(views))):
        packed["pairs"] = np.stack([light, view], axis=1).astype(np.int32)
    return packed


def _unpack_pairs(where: str, tensors: Tensors) -> tuple[Floats, Floats]:
    sides = []
    for name in ("lights", "views"):
        directions = tensors[name]
        if directions.ndim != 2 or directions.shape[1] != 3 or directions.dtype != np.float32:
            raise ValueError(f"{name} are {directions.dtype} {directions.shape}, expected (n, 3)")
        if not 1 <= len(directions) <= PAIR_LIMIT:
            raise ValueError(f"{name} are {len(directions):,}, expected up to {PAIR_LIMIT:,}")
        sides.append(check_directions(directions, f"{where}: {name}"))
    lights, views = sides
    if "pairs" not in tensors:
        if len(lights) * len(views) > PAIR_LIMIT:
            raise ValueError(f"more than {PAIR_LIMIT:,} pairs of directions")
        return pairs(lights, views)
    index = tensors["pairs"]
    if index.ndim != 2 or index.shape[1] != 2 or index.dtype != np.int32:
        raise ValueError(f"pairs are {index.dtype} {index.shape}, expected int32 (n, 2)")
    if not 1 <= len(index) <= PAIR_LIMIT:
        raise ValueError(f"pairs are {len(index):,}, expected up to {PAIR_LIMIT:,}")
    if (index < 0).any() or (index >= (len(lights), len(views))).any():
        raise ValueError("pairs name lights or views that are not there")
    return lights[index[:, 0]], views[index[:, 1]]


def _load_material(path: Path) -> TexelBrdf:
    latent = load_latent_map(path)
    try:
        return material_of(latent)
    except ValueError as error:
        raise FormatError(f"{path}: {error}; nacre btf average turns it into one") from error


def _save(texture: Btf, path: Path, progress: Progress = silent) -> None:
    if texture.latent is None:
        raise FormatError(f"{path}: holds encoded textures only; encode this one with nacre fit")
    save_latent_map(texture.latent, path)
    texels = texture.texel_count
    progress("texels", texels, texels, "")


FORMAT = Format(
    "nacre encoded texture",
    (".safetensors",),
    lambda head: looks_like_tensors(head) and header_key(head) in (None, KEY),
    lambda path: NeuralBtf(load_latent_map(path), where=str(path)),
    _save,
    kind="btf",
    claims=lambda path: has_header(path, KEY),
    load_material=_load_material,
)
"""Entry of the registry of formats of textures."""
