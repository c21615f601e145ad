"""The principal components of texels of one texture or of many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.textures.transposition import transposed
from nacre.numerics.channels import LUMA, split_colors
from nacre.numerics.pca import BY_PERMUTATION, leading_components, strongest
from nacre.runtime.progress import Progress
from nacre.textures.codecs.symmetry import symmetric_rotations
from nacre.textures.selection import of_same_directions, random_texels

_DARK = 0.01  # added to the brightness of texels, so that black ones do not weigh endlessly
_SMALLEST_NOISE = 1e-12
_BLOCK = 1 << 26  # bytes that are read at a time
_Orders = Sequence[npt.NDArray[Any]]


@dataclass(frozen=True)
class PcaRecipe:
    """Which texels count; a ValueError says that a number is not positive.

    They count with all six orders of their channels, with the rotations about the normal that the
    directions allow, and by one over their brightness, so that dark materials are not forgotten.
    """

    code_dim: int = 32  # how many components
    texels: int = 100  # from each texture, at random
    memory: int = 1 << 31  # bytes of the texels; where there are more, fewer are chosen
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("code_dim", "texels", "memory"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


def strongest_components(
    textures: Sequence[Callable[[], Btf]], recipe: PcaRecipe, progress: Progress, min_count: int
) -> tuple[Floats, Floats, Floats, Floats, Floats, float, dict[str, Any]]:
    """What :func:`nacre.textures.codecs.principal.find_components` makes a codec from."""
    wi, wo, rows, names = _gathered(textures, recipe, progress, min_count)
    count = len(rows[0])
    recipe = replace(recipe, code_dim=min(recipe.code_dim, count, 3 * len(wi)))
    brightness = rows[0].mean(axis=1) * LUMA
    weights = 1.0 / (np.maximum(brightness, 0.0) + _DARK)
    weights /= weights.mean()
    progress("components", 0, 1, "")
    mean, components, variances = _components(rows, weights, symmetric_rotations(wi, wo), recipe)
    energy = sum(float(np.einsum("ij,ij->", part, part)) for part in rows) / count
    noise = max((energy - float(variances.sum())) / mean.size, _SMALLEST_NOISE)
    progress("components", 1, 1, "")
    facts = {"materials": names, "recipe": asdict(recipe), "texels": count}
    return wi, wo, mean, components, variances, noise, facts


def _components(
    rows: Sequence[Floats], weights: Floats, orders: _Orders, recipe: PcaRecipe
) -> tuple[Floats, Floats, Floats]:
    """Mean, components and variances of luma (t, n) and chroma (2 t, n).

    These are the eigenvectors of the covariance over all six orders of the channels: it has one
    block for luma and two equal ones, so that a component of chroma comes twice.
    """
    luma, chroma = rows
    mean = _centred(luma, weights, orders)
    chroma *= np.tile(np.sqrt(weights), 2)[:, None]
    luma_functions, luma_variances = leading_components(luma, orders, recipe.code_dim, recipe.seed)
    half = -(-recipe.code_dim // 2)
    pair_functions, chroma_variances = leading_components(chroma, orders, half, recipe.seed)
    functions = luma_functions.T, pair_functions.T
    best = strongest([luma_variances, chroma_variances], BY_PERMUTATION, recipe.code_dim)
    colors = best.colors.astype(np.float32)
    chosen = zip(best.part, best.component, colors, strict=True)
    components = np.stack([functions[part][k][:, None] * color for part, k, color in chosen])
    variances = np.maximum(best.variances, 0.0).astype(np.float32)
    return np.repeat(LUMA * mean[:, None], 3, axis=1), components, variances


def _centred(rows: Floats, weights: Floats, orders: _Orders) -> Floats:
    """Subtract from rows, in place, their mean, and multiply them by roots of the weights; gives
    the mean.
    """
    mean = weights @ rows / weights.sum()
    mean = np.mean([mean[order] for order in orders], axis=0)
    rows -= mean
    rows *= np.sqrt(weights)[:, None]
    return np.asarray(mean, np.float32)


def _gathered(
    textures: Sequence[Callable[[], Btf]], recipe: PcaRecipe, progress: Progress, min_count: int
) -> tuple[Floats, Floats, list[Floats], list[str]]:
    """Directions, random texels of every texture as rows, and names.

    Rows are luma, shape (t, n), and chroma, (2 t, n).
    """
    random = np.random.default_rng(recipe.seed)
    picks: list[npt.NDArray[np.intp]] = []
    names: list[str] = []
    first: Btf | None = None
    for texture in of_same_directions(textures):
        first = first or texture
        limit = max(1, recipe.memory // (12 * texture.pair_count * len(textures)))
        picks.append(random_texels(texture, min(recipe.texels, limit), random))
        names.append(texture.name)
    total = sum(map(len, picks))
    if first is None or total < min_count:
        raise NacreError(f"{total} texels are too few for {min_count} principal components")
    pairs = first.pair_count
    if 3 * pairs < min_count:
        raise NacreError(
            f"{pairs} pairs of directions are too few for {min_count} principal components"
        )
    luma = np.empty((total, pairs), np.float32)
    chroma = np.empty((2, total, pairs), np.float32)
    row = 0
    for index, (open_texture, chosen) in enumerate(zip(textures, picks, strict=True)):
        with transposed(open_texture()) as texture:
            for part in texture.blocks(_BLOCK, stop=len(chosen)):
                texels = texture.texels(chosen[part])
                place = slice(row, row + len(texels))
                luma[place], chroma[:, place] = split_colors(texels)
                row += len(texels)
        progress("reading", index + 1, len(textures), texture.name)
    return np.array(first.wi), np.array(first.wo), [luma, chroma.reshape(-1, pairs)], names
