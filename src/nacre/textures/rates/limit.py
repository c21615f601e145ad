"""Encoded textures in a chosen number of bytes, or with a chosen loss."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent
from nacre.textures.latent_map import LatentMap
from nacre.textures.rates.bands import LARGEST, NumberBands, encode_bands
from nacre.textures.rates.rated_codes import LEVELS, TILE, RatedCodes, stream_of, tiles_of
from nacre.textures.rates.space import CodeSpace, looked_at
from nacre.textures.rates.wavelet import Bands, compose, decompose

LEAST, MOST = 0.5, 64.0
"""Bytes per texel that can be asked for."""
LOWEST, HIGHEST = 10.0, 80.0
"""Qualities, in dB, that can be asked for."""
_TOWARD_ZERO = 0.35  # of a step: what is added before magnitudes are cut to whole numbers
_CORRECTIONS = 3  # of a step, by how the result looks
_SAMPLED = 1 << 12  # texels, about, that are looked at
_BIT = 0.1155
"""The squared error, in steps squared, that a bit removes from fine rounding: log(2) / 6."""
_RIDGE = 1e-9
_CLOSE = 0.985  # of the bytes asked for; a search ends as close to it as that
_SLOPE = -1.0  # of the logarithm of bytes by that of the step, before it is known
_FEW = 8  # tiles that the step for a large map is guessed from
_ROUNDS = 14


def limited(
    latent: LatentMap,
    *,
    bytes_per_texel: float | None = None,
    quality: float | None = None,
    progress: Progress = silent,
) -> LatentMap:
    """The map with codes that few bytes hold: `bytes_per_texel`, or as many as the quality takes.

    Bytes are all of :class:`RatedCodes`; the codec and the directions of a file come on top. The
    quality is the peak signal-to-noise ratio in dB of square roots of reflectance, against those of
    the codes given. The codes of the result are those that its file will give.

    Raises ValueError unless one of both is given, within its range; a NacreError if the texture
    needs more bytes, and what :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
    """
    if (bytes_per_texel is None) == (quality is None):
        raise ValueError("give bytes per texel or a quality")
    tiles = _Tiles(latent)
    if bytes_per_texel is None:
        if quality is None or not LOWEST <= quality <= HIGHEST:
            raise ValueError(f"a quality is {LOWEST:g} to {HIGHEST:g} dB, not {quality}")
        rated = tiles.with_loss(10.0 ** (-0.1 * quality))
    else:
        if not LEAST <= bytes_per_texel <= MOST:
            raise ValueError(f"bytes per texel are {LEAST:g} to {MOST:g}, not {bytes_per_texel:g}")
        rated = tiles.within(bytes_per_texel, progress)
    return replace(latent, codes=rated.codes, rated=rated)


class _Tiles:
    """The tiles of a map, transformed, for trials of steps."""

    def __init__(self, latent: LatentMap) -> None:
        self._height, self._width, size = latent.codes.shape
        self._latent, self._pairs = latent, looked_at(latent)
        self._codes = latent.codes.reshape(-1, size).astype(np.float32)
        space = CodeSpace.of(latent)
        onto, center = space.onto.astype(np.float32), space.center.astype(np.float32)
        places = tiles_of(self._height, self._width, TILE)

        def transformed(place: tuple[slice, slice]) -> Bands:
            along = (latent.codes[place].astype(np.float32) - center) @ onto
            return decompose(np.moveaxis(along, -1, 0), LEVELS)

        self._bands: list[Bands] = list(thread_map(transformed, places))
        self._places = places
        self._largest = max(
            float(np.abs(band).max(initial=0.0)) for bands in self._bands for band in chain(*bands)
        )

    def within(self, bytes_per_texel: float, progress: Progress) -> RatedCodes:
        """The smallest step whose bytes are not more, or nearly; large maps are tried in part."""
        coarsest = self.rated(self._coarsest)
        if coarsest.bytes_per_texel > bytes_per_texel:
            raise NacreError(
                f"{len(self._codes):,} texels take {coarsest.bytes_per_texel:.2g} bytes each at "
                "least; ask for more"
            )
        fixed = coarsest.bytes_per_texel - coarsest.stream.size / len(self._codes)
        tried: list[RatedCodes] = [coarsest]

        def size(step: float) -> float:
            tried.append(self.rated(step))
            found = tried[-1].bytes_per_texel
            progress("rate", len(tried) - 1, _ROUNDS, f"{found:.3g} bytes a texel")
            return found

        start = 0.03 * self._largest
        if len(self._bands) > 2 * _FEW:
            few = np.linspace(0, len(self._bands) - 1, _FEW).astype(int).tolist()
            start = self._search(
                lambda step: self._stream_size(step, few) + fixed, start, bytes_per_texel
            )
        self._search(size, start, bytes_per_texel)
        return max(
            (rated for rated in tried if rated.bytes_per_texel <= bytes_per_texel),
            key=lambda rated: rated.bytes_per_texel,
        )

    def _search(self, size: Callable[[float], float], start: float, most: float) -> float:
        """A step whose size is at most `most`, or nearly, by secants between bounds."""
        low, high = math.log(self._finest), math.log(self._coarsest)
        wanted = math.log(_CLOSE * most)
        step, slope, last = math.log(start), _SLOPE, None
        for _ in range(_ROUNDS):
            step = min(max(step, low), high)
            found = math.log(size(math.exp(step)))
            if abs(found - wanted) <= -math.log(_CLOSE) or high - low < 1e-3:
                break
            low, high = (step, high) if found > wanted else (low, step)
            if last is not None and step != last[0]:
                slope = min(max((found - last[1]) / (step - last[0]), -3.0), -0.2)
            last = step, found
            step += (wanted - found) / slope
            if not low < step < high:
                step = 0.5 * (low + high)
        return math.exp(step)

    def _stream_size(self, step: float, few: Sequence[int]) -> float:
        """Bytes of chunks per texel, from some tiles."""
        numbers = [_rounded(self._bands[k], step) for k in few]
        chunks = chain(*thread_map(encode_bands, numbers))
        sides = [(places.stop - places.start for places in self._places[k]) for k in few]
        return sum(map(len, chunks)) / sum(map(math.prod, sides))

    def with_loss(self, loss: float) -> RatedCodes:
        """Codes that look different by a mean square of about `loss`."""
        aim = loss
        for _ in range(_CORRECTIONS):
            found = self.rated(self._step_of(aim))
            seen = self._latent.codec.embedding(*self._pairs)
            few = slice(None, None, max(1, len(self._codes) // _SAMPLED))
            changed = seen(found.codes.reshape(self._codes.shape)[few]) - seen(self._codes[few])
            aim *= loss / max(float(np.square(changed).sum(1).mean()), 1e-30)
        return found

    def _step_of(self, loss: float) -> float:
        """The step that rounds so much of a mean square away, by bisection."""
        low, high = math.log(self._finest), math.log(self._coarsest)
        for _ in range(2 * _ROUNDS):
            step = 0.5 * (low + high)
            low, high = (step, high) if self._loss(math.exp(step)) < loss else (low, step)
        return math.exp(low)

    def rated(self, step: float) -> RatedCodes:
        """The map at a step of rounding, decoded by axes that are fitted to the rounded numbers."""
        numbers = [_rounded(bands, step) for bands in self._bands]
        kept = np.flatnonzero(self._saved(numbers, step) > self._worth * step * step)
        numbers = [[[band[kept] for band in level] for level in bands] for bands in numbers]
        stream, lengths = stream_of(list(thread_map(encode_bands, numbers)))
        along = np.empty((self._height, self._width, len(kept)), np.float32)
        for place, bands in zip(self._places, numbers, strict=True):
            maps = compose([[band.astype(np.float32) for band in level] for level in bands])
            along[place] = np.moveaxis(maps, 0, -1)
        decoder = _fitted(along.reshape(len(self._codes), -1), self._codes)
        return RatedCodes(self._height, self._width, stream, lengths, *decoder)

    @property
    def _finest(self) -> float:
        return max(self._largest / LARGEST, 1e-30)

    @property
    def _coarsest(self) -> float:
        return max(2.0 * self._largest, 1e-30)

    @property
    def _worth(self) -> float:
        """The error of an axis that is worth its bytes, in steps squared."""
        return _BIT * 16.0 * self._codes.shape[1]

    def _saved(self, numbers: Sequence[NumberBands], step: float) -> npt.NDArray[np.float64]:
        """By how much each axis lowers the squared error."""
        return sum(
            (np.square(band) - np.square(band - step * number)).sum((1, 2), dtype=np.float64)
            for whole, rounded in zip(self._bands, numbers, strict=True)
            for band, number in zip(chain(*whole), chain(*rounded), strict=True)
        )

    def _loss(self, step: float) -> float:
        """The mean square, over texels, of what rounding takes away."""
        total = sum(
            np.square(band - step * number).sum(dtype=np.float64)
            for bands in self._bands
            for band, number in zip(chain(*bands), chain(*_rounded(bands, step)), strict=True)
        )
        return float(total) / len(self._codes)


def _rounded(bands: Bands, step: float) -> NumberBands:
    """Whole numbers of steps; those that are hardly more than one less are one less."""

    def rounded(band: Floats) -> npt.NDArray[np.int32]:
        sizes = np.floor(np.abs(band) * np.float32(1.0 / step) + np.float32(_TOWARD_ZERO))
        return np.copysign(np.minimum(sizes, LARGEST), band).astype(np.int32)

    return [[rounded(band) for band in level] for level in bands]


def _fitted(along: Floats, codes: Floats) -> tuple[npt.NDArray[np.float16], Floats, Floats]:
    """Axes, the scale of values and the center that bring sums closest to codes."""
    center, mean = codes.mean(0, dtype=np.float64), along.mean(0, dtype=np.float64)
    wide = along - mean
    normal = wide.T @ wide
    normal += np.eye(len(normal)) * max(_RIDGE * float(np.trace(normal)), 1e-30)
    axes = np.linalg.solve(normal, wide.T @ (codes - center))
    scale = np.maximum(np.abs(axes).max(axis=0, initial=0.0), 1e-30).astype(np.float32)
    half = (axes / scale).astype(np.float16)
    center = center - mean @ (half.astype(np.float64) * scale)
    return half, scale, center.astype(np.float32)
