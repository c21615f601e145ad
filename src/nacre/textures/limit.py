"""Encoded textures in a chosen number of bytes, or with a chosen loss."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.errors import NacreError
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress, silent
from nacre.textures.code_space import CodeSpace, looked_at
from nacre.textures.latent_map import LatentMap
from nacre.textures.rates.bands import LARGEST, NumberBands, encode_bands, encode_table
from nacre.textures.rates.rated_codes import RatedCodes, stream_of, tiles_of
from nacre.textures.rates.wavelet import Bands, compose, decompose

TILE, LEVELS = 128, 4
"""Texels along the edge of a tile, and levels of the wavelet in it."""
LEAST, MOST = 0.5, 64.0
"""Bytes per texel that can be asked for."""
LOWEST, HIGHEST = 10.0, 80.0
"""Qualities, in dB, that can be asked for."""
_TOWARD_ZERO = 0.35  # of a step: what is added before magnitudes are cut to whole numbers
_CORRECTIONS = 3  # of a step, by how the result looks
_SAMPLED = 1 << 14  # texels, about, that are looked at
_BIT = 0.1155
"""The squared error, in steps squared, that a bit removes from fine rounding: log(2) / 6."""
_RIDGE = 1e-9
_AXIS = 0.1  # of the size of an axis: the step of its numbers, if it is one step of rounding long
_AXIS_BITS = 4.0  # of a number of an axis, about
_CLOSE = 0.985  # of the bytes asked for; a search ends as close to it as that
_SLOPE = -1.0  # of the logarithm of bytes by that of the step, before it is known
_FEW = 8  # tiles that the step for a large map is guessed from
_ROUNDS = 14


@dataclass(frozen=True)
class Rate:
    """How many bytes codes may take: one of both, else a ValueError."""

    bytes_per_texel: float | None = None
    """All of :class:`RatedCodes`; the codec and the directions of a file come on top."""
    quality: float | None = None
    """Peak signal-to-noise ratio in dB of square roots of reflectance, against the codes given."""

    def __post_init__(self) -> None:
        if (self.bytes_per_texel is None) == (self.quality is None):
            raise ValueError("give either bytes per texel or a quality")
        for what, value, least, most in (
            ("bytes per texel", self.bytes_per_texel, LEAST, MOST),
            ("quality in dB", self.quality, LOWEST, HIGHEST),
        ):
            if value is not None and not least <= value <= most:
                raise ValueError(f"{what}: expected {least:g} to {most:g}, got {value:g}")

    @classmethod
    def of(cls, bytes_per_texel: float | None, quality: float | None) -> Rate | None:
        """The rate; None where nothing is given."""
        if bytes_per_texel is None and quality is None:
            return None
        return cls(bytes_per_texel, quality)


def limited(latent: LatentMap, rate: Rate, progress: Progress = silent) -> LatentMap:
    """The map with codes that few bytes hold: those that its file will give.

    Raises a NacreError if the texture needs more bytes, and what
    :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
    """
    tiles = _Tiles(latent)
    if rate.bytes_per_texel is not None:
        rated = tiles.within(rate.bytes_per_texel, progress)
    else:
        rated = tiles.with_loss(10.0 ** (-0.1 * float(rate.quality or 0.0)))
    return replace(latent, codes=rated.codes, rated=rated)


class _Tiles:
    """The tiles of a map, transformed, for trials of steps."""

    def __init__(self, latent: LatentMap) -> None:
        self._height, self._width, size = latent.codes.shape
        self._latent = latent
        self._codes = np.asarray(latent.codes.reshape(-1, size), np.float32)
        space = CodeSpace.of(latent)
        self._felt = space.felt.astype(np.float32)
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

        start = max(0.03 * self._largest, self._finest)
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
        """Codes that look different by a mean square of about `loss`, to a tenth or so."""
        seen = self._latent.codec.embedding(*looked_at(self._latent))
        few = slice(None, None, max(1, len(self._codes) // _SAMPLED))
        before, aim = seen(self._codes[few]), loss
        trials = []
        for _ in range(_CORRECTIONS):
            trial = self.rated(self._step_of(aim))
            after = seen(trial.codes.reshape(self._codes.shape)[few])
            off = loss / max(float(np.square(after - before).sum(1).mean()), 1e-30)
            aim *= off
            trials.append((abs(math.log(off)), trial))
        return min(trials, key=lambda pair: pair[0])[1]

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
        decoder = _fitted(along.reshape(len(self._codes), -1), self._codes, self._felt)
        return RatedCodes(self._height, self._width, stream, lengths, *decoder, tile=TILE)

    @property
    def _finest(self) -> float:
        return max(self._largest / LARGEST, 1e-30)

    @property
    def _coarsest(self) -> float:
        return max(2.0 * self._largest, 1e-30)

    @property
    def _worth(self) -> float:
        """The error of an axis that is worth its bytes, in steps squared."""
        return _BIT * _AXIS_BITS * float(self._codes.shape[1])

    def _saved(self, numbers: Sequence[NumberBands], step: float) -> Doubles:
        """By how much each axis lowers the squared error."""
        saved = np.zeros(self._codes.shape[1])
        for whole, rounded in zip(self._bands, numbers, strict=True):
            for band, number in zip(chain(*whole), chain(*rounded), strict=True):
                left = np.square(band - np.float32(step) * number)
                saved += (np.square(band) - left).sum((1, 2), dtype=np.float64)
        return saved

    def _loss(self, step: float) -> float:
        """The mean square, over texels, of what rounding takes away."""
        total: float = 0.0
        for bands in self._bands:
            for band, number in zip(chain(*bands), chain(*_rounded(bands, step)), strict=True):
                total += float(np.square(band - np.float32(step) * number).sum(dtype=np.float64))
        return total / len(self._codes)


def _rounded(bands: Bands, step: float) -> NumberBands:
    """Whole numbers of steps; those that are hardly more than one less are one less."""

    def rounded(band: Floats) -> npt.NDArray[np.int32]:
        sizes = np.floor(np.abs(band) * np.float32(1.0 / step) + np.float32(_TOWARD_ZERO))
        signed: npt.NDArray[np.int32] = np.copysign(np.minimum(sizes, LARGEST), band).astype(
            np.int32
        )
        return signed

    return [[rounded(band) for band in level] for level in bands]


def _fitted(
    along: Floats, codes: Floats, felt: Floats
) -> tuple[npt.NDArray[np.uint8], Floats, Floats, Floats]:
    """Axes, their steps, the scale of values and the center that bring sums closest to codes.

    An axis is rounded the more finely, the longer it is; `felt` is how much each value matters.
    """
    center, mean = codes.mean(0, dtype=np.float64), along.mean(0, dtype=np.float64)
    wide = along - mean
    normal = wide.T @ wide
    lengths = np.sqrt(np.maximum(np.diag(normal) / len(codes), 1e-12))
    normal += np.eye(len(normal)) * max(_RIDGE * float(np.trace(normal)), 1e-30)
    axes = np.linalg.solve(normal, wide.T @ (codes - center))
    sizes = np.sqrt(np.square(axes * felt).mean(axis=1))
    steps = (_AXIS * np.maximum(sizes, 1e-30) / lengths).astype(np.float32)
    scale = np.asarray(1.0 / felt, np.float32)
    table = np.round(axes / (steps[:, None] * scale)).clip(-LARGEST, LARGEST).astype(np.int32)
    center = center - mean @ (table * steps[:, None] * scale).astype(np.float64)
    written = np.frombuffer(encode_table(table), np.uint8)
    return written, steps, scale, center.astype(np.float32)
