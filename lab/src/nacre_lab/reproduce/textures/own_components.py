"""The principal components of one texture's own texels, as they are."""

from __future__ import annotations

import numpy as np

from nacre.btf import Btf
from nacre.measured.textures.transposition import transposed
from nacre.numerics.pca import leading_components
from nacre.textures.codecs.principal.codec import PcaCodec
from nacre.textures.selection import random_texels

_TEXELS = 1 << 20
_MEMORY = 1 << 31  # bytes of texels; where there are more, fewer are chosen
_BLOCK = 1 << 26  # bytes that are read at a time
_SMALLEST_NOISE = 1e-12


def own_components(texture: Btf, code_dim: int, seed: int = 0) -> PcaCodec:
    """The codec of the components with the largest variances: of all channels together, without
    other orders of the channels, rotations or weights. There are no more than texels, nor than
    values of a texel.
    """
    pairs = texture.pair_count
    count = min(_TEXELS, max(1, _MEMORY // (12 * pairs)))
    chosen = random_texels(texture, count, np.random.default_rng(seed))
    rows = np.empty((len(chosen), 3 * pairs), np.float32)
    with transposed(texture) as source:
        for part in source.blocks(_BLOCK, stop=len(chosen)):
            texels = source.texels(chosen[part])
            rows[part] = texels.reshape(len(texels), -1)
    mean = np.ones(len(rows), np.float32) @ rows / np.float32(len(rows))
    rows -= mean
    code_dim = min(code_dim, *rows.shape)
    found, variances = leading_components(rows, [np.arange(3 * pairs)], code_dim, seed)
    variances = np.maximum(variances, 0.0)
    energy = float(np.einsum("ij,ij->", rows, rows)) / len(rows)
    noise = max((energy - float(variances.sum())) / mean.size, _SMALLEST_NOISE)
    components = np.ascontiguousarray(found.T).reshape(-1, pairs, 3)
    facts = {"materials": [texture.name], "texels": len(rows)}
    wi, wo = np.array(texture.wi), np.array(texture.wo)
    return PcaCodec(wi, wo, mean.reshape(-1, 3), components, variances, noise, facts)
