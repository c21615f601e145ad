"""Distances between texels as they look: of what codes decode to, not of the codes themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.measured.textures.domes import BONN
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.posterior import Observation
from nacre.textures.codecs.codec import TexelCodec, TexelMap, on_all_cores
from nacre.textures.latent_map import LatentMap

_PAIRS = 512
"""Pairs of directions that texels of other codecs than the default one are decoded at."""
_BLOCK = 1 << 13
"""Texels at a time."""


def appearance(codec: TexelCodec, directions: tuple[Floats, Floats] | None = None) -> TexelMap:
    """A function from codes (b, values) to coordinates (b, k) whose distances are those of looks.

    The distance of two texels is the root of the mean squared difference of their square roots of
    reflectance, over the channels of all pairs of directions. Of the default codec it is found from
    coefficients, before what is below black is cut off; of others from some of the pairs at random.

    Parameters
    ----------
    codec
        What decodes the codes.
    directions
        The pairs, shape (n, 3) each; those of :data:`nacre.measured.textures.BONN` where None.

    Raises
    ------
    NacreError
        If the codec decodes at other directions only.
    """
    wi, wo = directions or BONN.pairs()
    if isinstance(codec, BasisCodec):
        gram = Observation(codec.functions(wi, wo), codec.prior).gram / (3 * len(wi))
        variances, vectors = np.linalg.eigh(gram)
        factor = (vectors * np.sqrt(np.maximum(variances, 0.0))).astype(np.float32)
        return lambda codes: codec.decode(codes) @ factor
    chosen = np.random.default_rng(0).choice(len(wi), min(_PAIRS, len(wi)), replace=False)
    decode = on_all_cores(codec, codec.decoder(wi[chosen], wo[chosen]))
    scale = np.float32((3 * len(chosen)) ** -0.5)

    def roots(codes: Floats) -> Floats:
        found: Floats = np.sqrt(np.maximum(decode(codes), 0.0)).reshape(len(codes), -1)
        return scale * found

    return roots


@dataclass(frozen=True)
class Neighbour:
    """A texel near another.

    Parameters
    ----------
    texture
        Which of the textures that were searched it is in.
    texel
        Its number there.
    distance
        See :func:`appearance`.
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
) -> list[Neighbour]:
    """The texels that look most like one, the closest first.

    Parameters
    ----------
    code
        Of that one, shape (values,).
    textures
        Where to search; all of the codec that the code is of.
    count
        Of texels.
    one_each
        Whether of each texture only the closest counts.
    leave_out
        Number of a texture and of a texel of it that do not count: the texel itself.
    progress
        Called with the textures searched.

    Raises
    ------
    NacreError
        See :func:`appearance`.
    """
    place = appearance(textures[0].codec)
    (wanted,) = place(np.asarray(code, np.float32)[None])
    found: list[Neighbour] = []
    for index, texture in enumerate(textures):
        codes = texture.codes.reshape(-1, texture.codes.shape[2])
        distances = np.concatenate(
            [
                np.linalg.norm(place(codes[i : i + _BLOCK].astype(np.float32)) - wanted, axis=1)
                for i in range(0, len(codes), _BLOCK)
            ]
        )
        if leave_out is not None and index == leave_out[0]:
            distances[leave_out[1]] = np.inf
        closest = np.argsort(distances, kind="stable")[: 1 if one_each else count]
        found += [
            Neighbour(index, int(texel), float(distances[texel]))
            for texel in closest
            if np.isfinite(distances[texel])
        ]
        found = sorted(found, key=lambda neighbor: neighbor.distance)[:count]
        progress("searching", index + 1, len(textures), "")
    return found
