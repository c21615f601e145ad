"""Texels of many textures by how they look: the nearest ones, and maps of them in the plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.io.files import PathLike, write_encoded
from nacre.io.tensors import check_header, check_numbers, format_errors, from_file, to_bytes
from nacre.latent.map import embed, embed_into
from nacre.measured.textures.domes import BONN
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec, on_all_cores
from nacre.textures.codecs.codec_file import codec_fingerprint
from nacre.textures.latent_map import LatentMap

_BLOCK = 1 << 13  # texels at a time


@dataclass(frozen=True)
class Neighbor:
    """A texel near another: the index of its texture among those searched, its number there, and
    the distance; see :meth:`nacre.textures.codecs.TexelCodec.embedding`.
    """

    texture: int
    texel: int
    distance: float


def nearest_texels(
    code: Floats,
    textures: Sequence[LatentMap],
    count: int,
    *,
    one_each: bool = False,
    leave_out: tuple[int, int] | None = None,
    progress: Progress = silent,
) -> list[Neighbor]:
    """The `count` texels that look most like one, the closest first.

    The textures all have the codec that `code`, shape (code_dim,), comes from. With `one_each`,
    only the closest texel of each texture counts. `leave_out`, the numbers of a texture and of a
    texel in it, does not count: the texel itself. Progress is called with the textures searched.
    Raises what :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
    """
    place = textures[0].codec.embedding(*BONN.pairs())
    (wanted,) = place(np.asarray(code, np.float32)[None])
    found: list[Neighbor] = []
    for index, texture in enumerate(textures):
        codes = texture.codes.reshape(-1, texture.codes.shape[2])
        blocks = (codes[start : start + _BLOCK] for start in range(0, len(codes), _BLOCK))
        places = (place(block.astype(np.float32)) for block in blocks)
        distances = np.concatenate([np.linalg.norm(p - wanted, axis=1) for p in places])
        if leave_out is not None and index == leave_out[0]:
            distances[leave_out[1]] = np.inf
        closest = np.argsort(distances, kind="stable")[: 1 if one_each else count]
        closest = closest[np.isfinite(distances[closest])]
        found += [Neighbor(index, int(texel), float(distances[texel])) for texel in closest]
        found = sorted(found, key=lambda neighbor: neighbor.distance)[:count]
        progress("searching", index + 1, len(textures), "")
    return found


VERSION = 1
KEY = "nacre map of texels"
_LIMIT = 1 << 28
_LARGEST = 1e9
_TYPES = {"texture": "i8", "xy": "i8", "codes": "f4", "places": "f8", "colors": "f4"}
"""Of arrays in files."""
_COLOR_PAIRS = 64  # pairs of directions whose mean reflectance is the color of a texel


@dataclass(frozen=True, eq=False)
class EmbeddingMap:
    """Texels of several textures in the plane; a ValueError says that shapes do not fit."""

    names: tuple[str, ...]  # the textures'
    texture: npt.NDArray[np.int64]  # the texture that each texel comes from, shape (n,)
    xy: npt.NDArray[np.int64]  # column and row of each texel there, shape (n, 2)
    codes: Floats  # shape (n, code_dim)
    places: npt.NDArray[np.float64]  # in the plane, shape (n, 2)
    colors: Floats  # mean reflectance factors at some pairs of directions, linear RGB, shape (n, 3)
    fingerprint: str  # the codec's, see :func:`nacre.textures.codecs.codec_file.codec_fingerprint`

    def __post_init__(self) -> None:
        count = len(self.texture)
        shapes = [self.texture.shape, self.xy.shape, self.places.shape, self.colors.shape]
        if shapes != [(count,), (count, 2), (count, 2), (count, 3)] or not count:
            raise ValueError(f"texels have shapes {shapes}")
        if self.codes.ndim != 2 or len(self.codes) != count:
            raise ValueError(f"codes are {self.codes.shape} for {count} texels")
        if self.texture.min() < 0 or self.texture.max() >= len(self.names):
            raise ValueError(f"texels come from more than {len(self.names)} textures")

    @property
    def labels(self) -> list[str]:
        """The name of the texture of every texel."""
        return [self.names[k] for k in self.texture]


def embed_texels(
    textures: Sequence[LatentMap],
    names: Sequence[str],
    count: int,
    seed: int = 0,
    onto: EmbeddingMap | None = None,
) -> EmbeddingMap:
    """A map of random texels by t-SNE, or an earlier one with further texels on it.

    Distances are those of :meth:`nacre.textures.codecs.TexelCodec.embedding`. The textures all have
    one codec, see :func:`nacre.textures.latent_file.load_latent_maps`, and their names differ. Each
    gives `count` texels, or all that it has. The same seed makes the same choice and the same map.
    On the earlier map, `onto`, texels stay where they are.

    Raises a NacreError if a name appears twice, there are too few texels, or the codec is not that
    of the map, or decodes at its own directions only, and a MissingExtraError if openTSNE is not
    installed.
    """
    known = () if onto is None else onto.names
    for index, name in enumerate(names):
        if name in (*known, *names[:index]):
            raise NacreError(f"{name}: appears twice on the map; rename one of the files")
    fingerprint = codec_fingerprint(textures[0].codec)
    if onto is not None and fingerprint != onto.fingerprint:
        raise NacreError(
            f"{names[0]}: was encoded by another model than the map's textures; encode it again"
        )
    random = np.random.default_rng(seed)
    codes, which, xy = [], [], []
    for index, texture in enumerate(textures):
        height, width, values = texture.codes.shape
        chosen = np.sort(random.choice(height * width, min(count, height * width), replace=False))
        codes.append(texture.codes.reshape(-1, values)[chosen].astype(np.float32))
        which.append(np.full(len(chosen), len(known) + index))
        xy.append(np.stack([chosen % width, chosen // width], axis=1))
    codec = textures[0].codec
    new = np.concatenate(codes)
    coordinates = codec.embedding(*BONN.pairs())
    if onto is None:
        places = embed(coordinates(new), seed, "texels")
    else:
        places = embed_into(coordinates(onto.codes), onto.places, coordinates(new), seed)
    found = (np.concatenate(which), np.concatenate(xy), new, places, _colors(codec, new))
    arrays = dict(zip(_TYPES, found, strict=True))
    if onto is not None:
        arrays = {name: np.concatenate([getattr(onto, name), arrays[name]]) for name in _TYPES}
    return EmbeddingMap((*known, *names), **arrays, fingerprint=fingerprint)


def _colors(codec: TexelCodec, codes: Floats) -> Floats:
    wi, wo = BONN.pairs()
    chosen = np.random.default_rng(0).choice(len(wi), _COLOR_PAIRS, replace=False)
    decode = on_all_cores(codec, codec.decoder(wi[chosen], wo[chosen]))
    return np.asarray(decode(codes).mean(axis=1))


def save_embedding_map(places: EmbeddingMap, path: PathLike) -> None:
    """Write a map; the same map gives the same bytes.

    Raises a FormatError if a number is not finite or the path cannot be written.
    """
    write_encoded(path, _encode, places)


def _encode(places: EmbeddingMap) -> bytes:
    tensors = {name: np.ascontiguousarray(getattr(places, name)) for name in _TYPES}
    names, model = list(places.names), places.fingerprint
    header = {"version": VERSION, "names": names, "model": model, "metadata": {}}
    return to_bytes(KEY, header, tensors, _LIMIT)


def load_embedding_map(path: PathLike) -> EmbeddingMap:
    """Read a map; a FormatError says that the file is not a whole map of a known version."""
    what = "a map of texels; nacre btf map --save makes one"
    header, tensors = from_file(path, KEY, _LIMIT, what)
    with format_errors(path):
        check_header(header, VERSION)
        return _decode(header, tensors)


def _decode(header: dict[str, Any], tensors: dict[str, npt.NDArray[Any]]) -> EmbeddingMap:
    names, fingerprint = header["names"], header["model"]
    if not isinstance(fingerprint, str) or not isinstance(names, list):
        raise ValueError("model is not a text, or names are not a list")
    if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ValueError("names are not distinct texts")
    for name, kind in _TYPES.items():
        if tensors[name].dtype != np.dtype(kind):
            raise ValueError(f"{name} is of type {tensors[name].dtype}, expected {np.dtype(kind)}")
    check_numbers({name: tensors[name] for name in ("codes", "places", "colors")}, _LARGEST)
    if (tensors["xy"] < 0).any():
        raise ValueError("xy has numbers below 0")
    arrays = {name: tensors[name] for name in _TYPES}
    return EmbeddingMap(tuple(names), **arrays, fingerprint=fingerprint)
