"""Encoded textures in a chosen number of bytes, or with a chosen loss."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nacre.errors import NacreError
from nacre.runtime.journal import Journal
from nacre.runtime.progress import Progress, silent
from nacre.textures.code_space import CodeSpace, looked_at
from nacre.textures.latent_map import LatentMap
from nacre.textures.rates.rated_codes import RatedCodes
from nacre.textures.rates.tiled import Tiled

TILE = 128
"""Texels along the edge of a tile."""
LEAST, MOST = 0.5, 64.0
"""Bytes per texel that can be asked for."""
LOWEST, HIGHEST = 10.0, 80.0
"""Qualities, in dB, that can be asked for."""
_CORRECTIONS = 3  # of a step, by how the result looks
_SAMPLED = 1 << 14  # texels, about, that are looked at
_CLOSE = 0.985  # of the bytes asked for; a search ends as close to it as that
_SLOPE = -1.0  # of the logarithm of bytes by that of the step, before it is known
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


def limited(
    latent: LatentMap,
    rate: Rate,
    progress: Progress = silent,
    journal: Journal | None = None,
) -> LatentMap:
    """The map with codes that few bytes hold: those that its file will give.

    Besides the codes and their bytes, a few tiles are in memory. With a journal, stopped work is
    resumed.

    Raises a NacreError if the texture needs more bytes, and what
    :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
    """
    search = _Search(latent, progress, journal or Journal())
    if rate.bytes_per_texel is not None:
        rated: Any = search.within(rate.bytes_per_texel)
    else:
        rated = search.with_loss(10.0 ** (-0.1 * float(rate.quality or 0.0)))
    return replace(latent, codes=rated)


class _Search:
    """Trials of steps of rounding."""

    def __init__(self, latent: LatentMap, progress: Progress, journal: Journal) -> None:
        self._latent, self._progress, self._journal = latent, progress, journal
        self._note = ""
        space = CodeSpace.of(latent)
        axes = space.center, space.onto, space.felt
        self._tiled = Tiled(latent.codes, axes, TILE, journal, self._report)

    def _report(self, done: int, total: int) -> None:
        self._progress("rate", done, total, self._note)

    def within(self, bytes_per_texel: float) -> RatedCodes:
        """The smallest step whose bytes are not more, or nearly; large maps are tried in part."""
        tiled, best = self._tiled, self._tiled.plainest()
        if best.bytes_per_texel > bytes_per_texel:
            raise NacreError(
                f"{tiled.texels:,} texels take {best.bytes_per_texel:.2g} bytes each at least; "
                "ask for more"
            )
        fixed = best.bytes_per_texel

        def few_size(step: float) -> float:
            found: float = self._journal.once(lambda: tiled.few_bytes(step)) + fixed
            self._note = f"about {found:.3g} bytes a texel"
            self._report(0, 1)
            return found

        def size(step: float) -> float:
            nonlocal best
            trial = tiled.rated(step)
            found = trial.bytes_per_texel
            if best.bytes_per_texel < found <= bytes_per_texel:
                best = trial
            self._note = f"{found:.3g} bytes a texel"
            self._report(1, 1)
            return found

        start = tiled.guess
        if tiled.is_large:
            start = self._step(few_size, start, bytes_per_texel)
        self._step(size, start, bytes_per_texel)
        return best

    def _step(self, size: Callable[[float], float], start: float, most: float) -> float:
        """A step whose size is at most `most`, or nearly, by secants between bounds."""
        low, high = math.log(self._tiled.finest), math.log(self._tiled.coarsest)
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

    def with_loss(self, loss: float) -> RatedCodes:
        """Codes that look different by a mean square of about `loss`, to a tenth or so."""
        seen = self._latent.codec.embedding(*looked_at(self._latent))
        few = slice(None, None, max(1, self._tiled.texels // _SAMPLED))
        before, aim = seen(self._latent.codes_of(few)), loss
        trials = []
        for _ in range(_CORRECTIONS):
            trial = self._tiled.rated(self._step_of(aim))
            off = loss / max(
                float(np.square(seen(trial.codes_of(few)) - before).sum(1).mean()), 1e-30
            )
            self._note = f"{trial.bytes_per_texel:.3g} bytes a texel"
            aim *= off
            trials.append((abs(math.log(off)), trial))
        return min(trials, key=lambda pair: pair[0])[1]

    def _step_of(self, loss: float) -> float:
        """The step that rounds so much of a mean square away, by bisection."""
        low, high = math.log(self._tiled.finest), math.log(self._tiled.coarsest)
        for _ in range(2 * _ROUNDS):
            step = 0.5 * (low + high)
            low, high = (step, high) if self._tiled.few_loss(math.exp(step)) < loss else (low, step)
        return math.exp(low)
