"""Maps of codes made larger, of texels that they have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nacre.errors import NacreError
from nacre.runtime.progress import Progress, silent
from nacre.textures.latent_map import LatentMap
from nacre.textures.synthesis.features import texel_features
from nacre.textures.synthesis.quilting import Quilting, Sources, quilt
from nacre.textures.synthesis.scale import overlap_of, patch_size, tiles
from nacre.textures.synthesis.seams import SeamContrast, seam_contrast, seams

TEXEL_LIMIT = 1 << 24
"""Most texels of a map that is made."""


@dataclass(frozen=True, eq=False)
class QuiltedMap:
    """What :func:`synthesize` made.

    Parameters
    ----------
    latent
        The codes.
    sources
        Which texel of the input each is.
    settings
        How patches were laid.
    contrast
        Of seams, in what texels look like over all directions.
    used
        Share of the input's texels that are in the output.
    """

    latent: LatentMap
    sources: Sources
    settings: Quilting
    contrast: SeamContrast
    used: float

    def facts(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "patch": self.settings.patch,
            "overlap": self.settings.overlap,
            "tolerance": self.settings.tolerance,
            "input tiles": self.settings.periodic,
            "output tiles": self.settings.tile,
            "seed": self.settings.seed,
            "contrast of seams": self.contrast.ratio,
            "share of neighbors with a seam between": self.contrast.share,
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
    """A texture of any size that looks like another: image quilting of its codes.

    Every texel has the code of one of the input's, bit by bit (Rainer et al. 2020, figure 10; Efros
    and Freeman 2001).

    Parameters
    ----------
    latent
        The input.
    height, width
        Of the output, in texels.
    patch, overlap
        Edge of patches and how far they overlap, in texels; from the texture where None.
    tolerance
        See :class:`nacre.textures.synthesis.quilting.Quilting`.
    periodic
        Whether the input tiles; found out where None.
    tile
        Whether the output shall.
    seed
        The same gives the same output.
    progress
        Called with the patches laid.

    Raises
    ------
    NacreError
        If a size is out of range, or patches are larger than the input or the output.
    FormatError
        If a code decodes to what is no number.
    """
    if min(height, width) < 2 or height * width > TEXEL_LIMIT:
        raise NacreError(
            f"the output has 2 x 2 to {TEXEL_LIMIT:,} texels, not {width:,} x {height:,}"
        )
    rows, columns, values = latent.codes.shape
    edge = min(rows, columns, height, width)
    if min(rows, columns) < 2:
        raise NacreError(f"{columns} x {rows} texels are too few to lay patches of; 2 x 2 is least")
    features = texel_features(latent)
    if patch is None:
        patch = min(patch_size(features), edge)
        if overlap is not None:
            patch = min(max(patch, 2 * overlap), edge)
    elif patch > edge:
        raise NacreError(
            f"patches of {patch} texels are larger than the input ({columns} x {rows}) or the "
            f"output ({width} x {height}); {edge} is most"
        )
    try:
        settings = Quilting(
            patch,
            overlap_of(patch) if overlap is None else overlap,
            tolerance,
            tiles(features) if periodic is None else periodic,
            tile,
            seed,
        )
    except ValueError as error:
        raise NacreError(str(error)) from error
    sources = quilt(features, height, width, settings, progress)
    edges = seams(sources, rows, columns, periodic=settings.periodic, tile=tile)
    contrast = seam_contrast(features.reshape(rows * columns, -1)[sources], edges, tile=tile)
    used = int(np.count_nonzero(np.bincount(sources.reshape(-1)))) / (rows * columns)
    codes = latent.codes.reshape(-1, values)[sources]
    return QuiltedMap(replace(latent, codes=codes), sources, settings, contrast, used)
