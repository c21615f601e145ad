"""Encoded textures in few bytes: which codes to keep, and what is lost."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.metrics.texture_errors import Errors, ErrorSums
from nacre.runtime.journal import Journal
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent
from nacre.textures.code_space import looked_at
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.latent_map import LatentMap, NeuralBtf
from nacre.textures.limit import Rate, limited

_SAMPLED = 1 << 12  # texels, about, that two ways are compared at
_SHORTENED = 1 << 9  # texels whose codes are found at a time
_PAIRS = 512  # pairs of directions that a loss is measured at, or
_COMPARED = 1 << 23  # so many values of a channel, about
_ALIKE = 1 << 14  # texels that are compared at the same pairs
_BLOCK = 1 << 26  # bytes of measured values that are read at a time


def rated(
    latent: LatentMap,
    codec: TexelCodec,
    rate: Rate,
    progress: Progress = silent,
    journal: Journal | None = None,
) -> LatentMap:
    """A map whose codes are coefficients, in few bytes: as such, or as codes of the codec.

    The coefficients are those of :meth:`nacre.textures.codecs.TexelCodec.expanded`, or the codec's
    own codes where it has none. Codes say less about a texel than they do, and need fewer bytes; of
    the two, what looks closer to the coefficients at the rate is taken. A quality is kept by
    coefficients. With a journal, stopped work is resumed.
    """
    found: LatentMap = limited(latent, rate, progress, journal)
    if codec.expanded_dim is None or rate.bytes_per_texel is None:
        return found
    short = _shortened(latent, codec, progress)
    reference = latent.reference and replace(latent.reference, expanded=False)
    other = replace(latent, codes=short, codec=codec, reference=reference)
    other = limited(other, rate, progress, journal)
    closer: LatentMap = min(found, other, key=lambda one: _distance(one, latent))
    return closer


def _shortened(latent: LatentMap, codec: TexelCodec, progress: Progress) -> Floats:
    height, width, _ = latent.shape
    found = np.empty((height * width, codec.code_dim), np.float32)
    starts = range(0, len(found), _SHORTENED)
    parts = thread_map(
        lambda start: codec.shortened(latent.codes_of(slice(start, start + _SHORTENED))), starts
    )
    for start, part in zip(starts, parts, strict=True):
        found[start : start + _SHORTENED] = part
        progress("codes", start + len(part), len(found), "")
    return found.reshape(height, width, -1)


def _distance(one: LatentMap, truth: LatentMap) -> float:
    """The mean squared distance of texels."""
    chosen = slice(None, None, max(1, math.prod(one.shape[:2]) // _SAMPLED))

    def looks(latent: LatentMap) -> Floats:
        return latent.codec.embedding(*looked_at(latent))(latent.codes_of(chosen))

    return float(np.square(looks(one) - looks(truth)).sum(1).mean())


def rated_errors(
    btf: Btf,
    latent: LatentMap,
    pairs: int,
    progress: Progress = silent,
    journal: Journal | None = None,
) -> Errors:
    """Errors of a map against the texture that it was encoded from, or another of its directions.

    So many pairs of directions are compared, drawn anew for every few texels.
    """
    sums, other = ErrorSums(), NeuralBtf(latent)
    blocks = [
        block
        for start in range(0, btf.texel_count, _ALIKE)
        for block in btf.blocks(
            sys.maxsize if btf.decodable else _BLOCK, start, min(start + _ALIKE, btf.texel_count)
        )
    ]

    @lru_cache(1)
    def drawn(seed: int) -> tuple[npt.NDArray[np.intp], list[Btf]]:
        random = np.random.default_rng(seed)
        chosen = np.sort(random.choice(btf.pair_count, min(pairs, btf.pair_count), replace=False))
        wi, wo = btf.wi[chosen], btf.wo[chosen]
        both = (btf, other)
        return chosen, [each.at_directions(wi, wo) if each.decodable else each for each in both]

    def compare(number: int) -> None:
        block = blocks[number]
        chosen, (truth, found) = drawn(block.start // _ALIKE)
        expected = truth.texels(block)
        if not truth.decodable:
            expected = expected[:, chosen]
        sums.add(expected, found.texels(block), btf.wo[chosen])

    def restore(kept: Any) -> None:
        sums.sums[:] = ErrorSums(kept).sums

    journal = journal or Journal()
    for done in journal.steps(len(blocks), compare, lambda: sums.sums.copy(), restore):
        note = f"MSE x 1e4 {1e4 * sums.result().mse:.3g}"
        progress("comparing", blocks[done - 1].stop, btf.texel_count, note)
    return sums.result()


@dataclass(frozen=True, eq=False)
class Recoding:
    """The result of :func:`recoded`."""

    latent: LatentMap
    loss: Errors
    """Errors against the map before, at pairs of its directions."""


def recoded(
    latent: LatentMap, rate: Rate, progress: Progress = silent, journal: Journal | None = None
) -> Recoding:
    """An encoded texture in fewer bytes.

    Its error is estimated: that of the map before, if known, plus what is lost now. With a journal,
    stopped work is resumed.
    """
    found = limited(latent, rate, progress, journal)
    pairs = min(_PAIRS, max(1, _COMPARED // math.prod(latent.shape[:2])))
    loss = rated_errors(NeuralBtf(latent), found, pairs, progress, journal)
    metadata: dict[str, Any] = {key: v for key, v in latent.metadata.items() if key != "errors"}
    lost = 1e4 * loss.mse
    metadata["recoding"] = {"MSE x 1e4 against the codes before": lost}
    before = latent.metadata.get("errors", {}).get("MSE x 1e4")
    if isinstance(before, int | float):
        metadata["errors"] = {"MSE x 1e4": before + lost, "estimated": True}
    return Recoding(replace(found, codes=found.held, metadata=metadata), loss)
