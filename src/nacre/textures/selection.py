"""A few texels or values of a texture that stand for all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.measured.textures.directions import same_pairs

_TEXELS, _IMAGES = 64, 16


def random_texels(texture: Btf, count: int, random: np.random.Generator) -> npt.NDArray[np.intp]:
    """Distinct texels in order, `count` of them or all."""
    count = min(count, texture.texel_count)
    return np.sort(random.choice(texture.texel_count, count, replace=False))


def of_same_directions(textures: Sequence[Callable[[], Btf]], advice: str = "") -> Iterator[Btf]:
    """Open textures in turn; a :class:`NacreError` says that one has other directions."""
    first: Btf | None = None
    for open_texture in textures:
        texture = open_texture()
        first = first or texture
        if not same_pairs(texture.wi, texture.wo, first.wi, first.wo):
            raise NacreError(
                f"{texture.name}: is not measured at the directions of {first.name}{advice}"
            )
        yield texture


def some_values(btf: Btf) -> Floats:
    """Values at random texels, or at random pairs where it lies in images, shape (count, 3).

    Raises a FormatError if they cannot be read.
    """
    random = np.random.default_rng(0)
    total, count = (btf.pair_count, _IMAGES) if btf.by_image else (btf.texel_count, _TEXELS)
    chosen = np.sort(random.choice(total, min(count, total), replace=False))
    return (btf.images(chosen) if btf.by_image else btf.texels(chosen)).reshape(-1, 3)


def nearest_pair(btf: Btf, wi: Floats, wo: Floats) -> int:
    """The pair of directions whose angles to a light and a view have the least sum of squares.

    `wi` and `wo` are unit directions, shape (3,).
    """
    light, view = (
        np.arccos(np.clip(known @ w, -1.0, 1.0)) for known, w in ((btf.wi, wi), (btf.wo, wo))
    )
    return int((light**2 + view**2).argmin())
