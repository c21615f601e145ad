"""Maps whose codes mean the same, so that they can be mixed and compared."""

from __future__ import annotations

from collections.abc import Sequence

from nacre.textures.codecs.codec_file import codec_fingerprint
from nacre.textures.latent_map import LatentMap


def same_codec(maps: Sequence[LatentMap]) -> int | None:
    """The index of the first map whose codec is not that of the first one, or None."""
    first = maps[0].codec
    wanted = ""
    for index, latent in enumerate(maps):
        if latent.codec is not first:
            wanted = wanted or codec_fingerprint(first)
            if codec_fingerprint(latent.codec) != wanted:
                return index
    return None


def alike(maps: Sequence[LatentMap]) -> Sequence[LatentMap]:
    """The maps with one codec, if coefficients for codes make them so; else as they are.

    Of textures at a rate, some hold codes and others coefficients.
    """
    if same_codec(maps) is None:
        return maps
    expanded = [found for latent in maps if (found := latent.expanded()) is not None]
    return expanded if len(expanded) == len(maps) and same_codec(expanded) is None else maps
