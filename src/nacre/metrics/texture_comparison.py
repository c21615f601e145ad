"""One texture against another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.textures.directions import same_pairs
from nacre.metrics.texture_errors import Errors, ErrorSums
from nacre.runtime.progress import Progress, silent

_BLOCK = 1 << 26


@dataclass(frozen=True, eq=False)
class TextureComparison:
    """What :func:`compare_textures` found."""

    errors: Errors  # over all texels
    texels: Floats  # mean squared error of every texel, shape (height, width)
    compared: int  # pairs of directions that were compared

    def worst(self) -> list[tuple[int, int, float]]:
        """Column, row and mean squared error of the five texels with the largest errors."""
        order = np.argsort(self.texels, axis=None)[::-1][:5]
        rows, columns = np.unravel_index(order, self.texels.shape)
        return [
            (int(x), int(y), float(self.texels[y, x])) for y, x in zip(rows, columns, strict=True)
        ]


def matched(truth: Btf, other: Btf) -> Btf:
    """The other texture at the pairs of directions of the first.

    Raises NacreError if they have different sizes, or the other is known only at other pairs.
    """
    sizes = [f"{btf.width} x {btf.height}" for btf in (truth, other)]
    if sizes[0] != sizes[1]:
        raise NacreError(f"textures have {sizes[0]} and {sizes[1]} texels; they must be alike")
    if same_pairs(truth.wi, truth.wo, other.wi, other.wo):
        return other
    if other.decodable:
        return other.at_directions(truth.wi, truth.wo)
    raise NacreError(
        f"textures have {truth.pair_count:,} and {other.pair_count:,} pairs of directions, not the "
        "same ones; give an encoded texture second, which is decoded at those of the first"
    )


def compare_textures(
    truth: Btf,
    other: Btf,
    *,
    pairs: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> TextureComparison:
    """Errors of a texture at the directions of the truth.

    Both textures, as :func:`matched` takes them, are read by runs of texels; see
    :func:`nacre.measured.textures.transposed` for one that lies in images. So many random `pairs`
    of directions are compared, which the seed chooses; all where None. Raises FormatError if a
    texture cannot be read, NacreError as :func:`matched`.
    """
    other = matched(truth, other)
    chosen: slice | npt.NDArray[Any] = slice(None)
    if pairs is not None and pairs < truth.pair_count:
        random = np.random.default_rng(seed)
        chosen = np.sort(random.choice(truth.pair_count, pairs, replace=False))
    wi, wo = truth.wi[chosen], truth.wo[chosen]
    # No more is decoded than is compared.
    truth, other = (
        each.at_directions(wi, wo) if each.decodable else each for each in (truth, other)
    )
    sums, texels = ErrorSums(), np.empty(truth.texel_count, np.float32)
    for block in truth.blocks(_BLOCK):
        expected, found = (
            values if values.shape[1] == len(wo) else values[:, chosen]
            for values in (truth.texels(block), other.texels(block))
        )
        texels[block] = sums.add(expected, found, wo)
        note = f"MSE x 1e4 {1e4 * sums.result().mse:.3g}"
        progress("comparing", block.stop, truth.texel_count, note)
    return TextureComparison(sums.result(), texels.reshape(truth.height, truth.width), len(wo))
