"""Mixtures of two materials, texel by texel, as mixtures of their codes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.io.tensors import to_bytes
from nacre.textures.codecs.codec_file import KEY, LIMIT, pack_codec
from nacre.textures.latent_map import LatentMap
from nacre.textures.synthesis.quilted_map import TEXEL_LIMIT


def blend(
    first: LatentMap,
    second: LatentMap,
    mask: Floats,
    *,
    keep_contrast: bool = True,
) -> LatentMap:
    """A texture that goes from one material to another.

    Codes are weighed means (Rainer et al. 2020, section 5.2, on the stability of the space). Maps
    that are smaller than the mask repeat; synthesize a larger one first where that would show.

    Parameters
    ----------
    first, second
        Of the same codec.
    mask
        Share of the second, 0 to 1, shape (height, width) of the output.
    keep_contrast
        Whether deviations from each material's mean code, which are unlike and partly cancel in a
        mean, are made larger again by the root of the sum of the squared weights (Heitz and Neyret
        2018, "High-Performance By-Example Noise"). Else the middle of two textures is hazy.

    Raises
    ------
    NacreError
        If the codecs differ, or the mask is empty, too large, or not of numbers within 0 and 1.
    """
    if not same_codec(first, second):
        raise NacreError(
            f"{first.name or 'the first'} and {second.name or 'the second'} were encoded by "
            "different models, so that their codes do not mix; encode both by the same one"
        )
    if mask.ndim != 2 or not 0 < mask.size <= TEXEL_LIMIT:
        raise NacreError(f"a mask has 1 to {TEXEL_LIMIT:,} texels in rows, not {mask.shape}")
    if not ((mask >= 0.0) & (mask <= 1.0)).all():
        raise NacreError("values of a mask are numbers within 0 and 1")
    weights = np.asarray(mask, np.float32)[..., None]
    mixed = np.zeros((*mask.shape, first.codec.values), np.float32)
    if keep_contrast:
        scale = 1.0 / np.sqrt(np.square(weights) + np.square(1.0 - weights))
    else:
        scale = np.ones_like(weights)
    for latent, weight in ((first, 1.0 - weights), (second, weights)):
        mean = latent.codes.mean((0, 1), dtype=np.float64).astype(np.float32)
        mixed += weight * (mean + scale * (_repeated(latent, mask.shape) - mean))
    for latent, alone in ((first, mask == 0.0), (second, mask == 1.0)):
        mixed[alone] = _repeated(latent, mask.shape)[alone]  # free of rounding
    dtype = np.result_type(first.codes.dtype, second.codes.dtype)
    name = " to ".join(filter(None, (first.name, second.name)))
    return replace(first, codes=mixed.astype(dtype), name=name, metadata={})


def same_codec(first: LatentMap, second: LatentMap) -> bool:
    """Whether codes of two maps mean the same."""
    if first.codec is second.codec:
        return True
    one, other = (
        to_bytes(KEY, *pack_codec(latent.codec, None), LIMIT) for latent in (first, second)
    )
    return one == other


def _repeated(latent: LatentMap, shape: tuple[int, ...]) -> Floats:
    """Its codes, tiled to a height and a width."""
    rows, columns = (np.arange(n) % m for n, m in zip(shape, latent.codes.shape[:2], strict=True))
    return latent.codes[np.ix_(rows, columns)].astype(np.float32)
