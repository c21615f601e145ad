"""Maps of codes made larger, from texels that they have."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.numerics.pca import largest_first
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.textures.latent_map import LatentMap, check_decoded
from nacre.textures.synthesis.quilting import Quilting, Sources, quilt
from nacre.textures.synthesis.seams import (
    SeamContrast,
    overlap_of,
    patch_size,
    seam_contrast,
    seams,
    tiles,
)

_TEXELS = 4096  # texels that components are found from, at most
_LEFT_OUT = 0.01  # fraction of the variance that components may leave
_BLOCK = 1 << 12  # texels at a time


def texel_features(latent: LatentMap, max_count: int = 16) -> Floats:
    """Principal components of how texels look at the directions of a map.

    Squared distances are those of :meth:`nacre.textures.codecs.TexelCodec.embedding`, but for the
    hundredth of the variance that is left out, or more with `max_count` components. Gives shape
    (height, width, components), with means of zero. A FormatError says that a code decodes to
    values that are not finite.
    """
    height, width, values = latent.codes.shape
    codes = latent.codes.reshape(-1, values).astype(np.float32)
    total = len(codes)
    some = np.random.default_rng(0).choice(total, min(_TEXELS, total), replace=False)
    with one_blas_thread():  # the same features on any number of cores
        embed = latent.codec.embedding(latent.wi, latent.wo)
        seen = check_decoded(embed(codes[np.sort(some)]).astype(np.float64), latent.name)
        mean = seen.mean(0)
        variances, directions = largest_first(np.cov(seen, rowvar=False, bias=True))
        left_out = np.cumsum(np.maximum(variances[::-1], 0.0))
        needed = int(np.count_nonzero(left_out > _LEFT_OUT * left_out[-1]))
        kept = directions[:, : min(max(needed, 1), max_count)]
        blocks = (codes[start : start + _BLOCK] for start in range(0, total, _BLOCK))
        features = np.concatenate([(embed(block) - mean) @ kept for block in blocks])
    features -= features.mean(0)
    return check_decoded(features, latent.name).reshape(height, width, -1)


TEXEL_LIMIT = 1 << 24  # most texels of a map that is made


@dataclass(frozen=True, eq=False)
class QuiltedMap:
    """What :func:`synthesize` made."""

    latent: LatentMap
    sources: Sources  # the texel of the input that each texel is
    settings: Quilting
    contrast: SeamContrast  # of seams, in what texels look like over all directions
    used: float  # share of the input's texels that are in the output

    def facts(self) -> dict[str, Any]:
        names = {"periodic": "input tiles", "tile": "output tiles"}
        settings = {names.get(key, key): value for key, value in asdict(self.settings).items()}
        return settings | {
            "contrast of seams": self.contrast.ratio,
            "share of neighbors with a seam between": self.contrast.fraction,
            "share of the input used": self.used,
        }


def synthesize(
    latent: LatentMap,
    height: int,
    width: int,
    *,
    patch: int | None = None,
    overlap: int | None = None,
    tolerance: float = 0.1,
    periodic: bool | None = None,
    tile: bool = False,
    seed: int = 0,
    progress: Progress = silent,
) -> QuiltedMap:
    """A texture of any size, in texels, that looks like another: image quilting of its codes.

    Every texel has the code of one of the input's, bit by bit (Rainer et al. 2020, figure 10; Efros
    and Freeman 2001). Settings are those of :class:`nacre.textures.synthesis.quilting.Quilting`;
    what is None there is found from the texture: patches and their overlap, in texels, and whether
    the input tiles. Progress is called with the patches laid.

    Raises a NacreError if a size is out of range, or patches are larger than the input or the
    output, and a FormatError if a code decodes to values that are not finite.
    """
    if min(height, width) < 2 or height * width > TEXEL_LIMIT:
        raise NacreError(
            f"the output has 2 x 2 to {TEXEL_LIMIT:,} texels, not {width:,} x {height:,}"
        )
    rows, columns, values = latent.codes.shape
    edge = min(rows, columns, height, width)
    if min(rows, columns) < 2:
        raise NacreError(f"{columns} x {rows} texels are too few for patches; 2 x 2 is the minimum")
    features = texel_features(latent)
    if patch is None:
        patch = min(patch_size(features), edge)
        if overlap is not None:
            patch = min(max(patch, 2 * overlap), edge)
    elif patch > edge:
        raise NacreError(
            f"patches of {patch} texels are larger than the input ({columns} x {rows}) or the "
            f"output ({width} x {height}); {edge} at most"
        )
    try:
        overlap = overlap_of(patch) if overlap is None else overlap
        periodic = tiles(features) if periodic is None else periodic
        settings = Quilting(patch, overlap, tolerance, periodic, tile, seed)
    except ValueError as error:
        raise NacreError(str(error)) from error
    sources = quilt(features, height, width, settings, progress)
    edges = seams(sources, rows, columns, periodic=periodic, tile=tile)
    contrast = seam_contrast(features.reshape(rows * columns, -1)[sources], edges, tile=tile)
    used = int(np.count_nonzero(np.bincount(sources.reshape(-1)))) / (rows * columns)
    codes = latent.codes.reshape(-1, values)[sources]
    return QuiltedMap(replace(latent, codes=codes), sources, settings, contrast, used)
