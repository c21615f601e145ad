"""Results of a codec on a texture: errors of texels, and pictures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec, TexelMap, on_all_cores
from nacre.textures.codecs.networks.preprocessing import OFFSET
from nacre_lab.reproduce.textures.sampling import Pairs, Sampling

_BLOCK = 1 << 26
"""Bytes of reflectance processed at a time."""


class Errors(NamedTuple):
    """Errors of each examined texel over all compared pairs, shapes (t,).

    Mean squared differences of reflectance factors, and mean absolute differences of their
    logarithms, which is the networks' loss up to a factor.
    """

    squares: npt.NDArray[np.float64]
    logarithms: npt.NDArray[np.float64]

    @property
    def mse(self) -> float:
        """Mean squared error."""
        return float(self.squares.mean())


def errors(
    texture: Btf,
    codec: TexelCodec,
    sampling: Sampling,
    texels: int | None,
    seed: int,
    progress: Progress = silent,
) -> Errors:
    """Errors of random texels, or of all, encoded from some pairs and decoded.

    Raises
    ------
    NacreError
        If the codec is for other directions only, or no pair of directions can be seen.
    """
    seen, compared = sampling.pairs(texture.wi, texture.wo, seed)
    decode = _decoder(texture, codec, seen, compared)
    chosen = np.arange(texture.texel_count)
    if texels is not None:
        chosen = np.sort(np.random.default_rng(seed).permutation(chosen)[:texels])
    found = np.empty((2, len(chosen)))
    for part in texture.blocks(_BLOCK, stop=len(chosen)):
        values = texture.texels(chosen[part])
        decoded = decode(values)
        values = _taken(values, compared)
        found[0, part] = np.square(decoded - values).mean(axis=(1, 2))
        found[1, part] = np.abs(_logarithm(decoded) - _logarithm(values)).mean(axis=(1, 2))
        progress("comparing", part.stop, len(chosen), "")
    return Errors(*found)


def picture(
    texture: Btf, codec: TexelCodec, sampling: Sampling, pair: int, seed: int
) -> npt.NDArray[np.float32]:
    """The decoded texture at one pair of directions, shape (height, width, 3).

    Raises
    ------
    NacreError
        If the codec is for other directions only, or no pair of directions can be seen.
    """
    seen, _ = sampling.pairs(texture.wi, texture.wo, seed)
    decode = _decoder(texture, codec, seen, np.array([pair]))
    rows = [decode(texture.texels(part))[:, 0] for part in texture.blocks(_BLOCK)]
    return np.concatenate(rows).reshape(texture.height, texture.width, 3).astype(np.float32)


def codes(texture: Btf, codec: TexelCodec, texels: int, seed: int) -> npt.NDArray[np.float32]:
    """Codes of random texels, shape (at most `texels`, codec.code_dim).

    Raises
    ------
    NacreError
        If the codec is for other directions only.
    """
    encode = on_all_cores(codec, codec.encoder(texture.wi, texture.wo))
    chosen = np.random.default_rng(seed).permutation(texture.texel_count)[:texels]
    parts = [
        encode(texture.texels(np.sort(chosen)[part]))
        for part in texture.blocks(_BLOCK, stop=len(chosen))
    ]
    return np.concatenate(parts).astype(np.float32)


def noise(texture: Btf, again: Btf) -> float:
    """Mean squared error that no codec can avoid, from a second measurement with other noise.

    It is half the mean squared difference: both have noise of the same variance.

    Raises
    ------
    ValueError
        If the two differ in size or directions.
    """
    same = (texture.height, texture.width) == (again.height, again.width)
    if not (same and np.array_equal(texture.wi, again.wi) and np.array_equal(texture.wo, again.wo)):
        raise ValueError("is not of the same size and directions")
    total = 0.0
    for part in texture.blocks(_BLOCK):
        total += float(np.square(texture.texels(part) - again.texels(part)).mean(axis=(1, 2)).sum())
    return 0.5 * total / texture.texel_count


def _decoder(texture: Btf, codec: TexelCodec, seen: Pairs, shown: Pairs) -> TexelMap:
    """Maps texels at all pairs of directions to the shown pairs, encoding only the seen pairs."""
    wi, wo = texture.wi, texture.wo
    encode = on_all_cores(codec, codec.encoder(wi[seen], wo[seen]))
    decode = on_all_cores(codec, codec.decoder(wi[shown], wo[shown]))
    return lambda values: decode(encode(_taken(values, seen)))


def _taken(values: Floats, pairs: Pairs) -> Floats:
    """Values at some pairs; no copy if these are all."""
    return values if len(pairs) == values.shape[1] else values[:, pairs]


def _logarithm(values: Floats) -> Floats:
    return np.asarray(np.log(np.maximum(values, 0.0) + OFFSET))
