"""Whether a viewer would see the difference between two materials, in words.

The verdict rests on FLIP, which approximates what a viewer sees who flips between two pictures. Its
authors give no thresholds, so these are set by color differences, for which there are: in CIE 1976
L*a*b*, observers do not notice a difference of 1, one of 2.3 is just noticeable (Mahy et al.
1994), and from 5 on there are two colors (Mokrzycki and Tatol 2011). An even change of a picture by
1, 2.3 and 5, in any direction, has a FLIP of 0.055, 0.098 and 0.170: medians over 54 colors. The
mean over a picture would miss a small highlight in another place, so the worst twentieth counts as
well. That these mean the same for an uneven change is a convention of nacre's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nacre.array import Floats

UNSEEN, NOTICED, DISTINCT = 0.05, 0.1, 0.17
"""FLIP of an even change of color that goes unnoticed, that half of the observers notice, and that
makes two colors."""

SOURCE = (
    f"FLIP of an even change of color: {UNSEEN:g} if nobody notices it, {NOTICED:g} if it is just "
    f"noticeable, {DISTINCT:g} if it makes two colors; a convention, see docs/reference/measures.md"
)
"""Where the thresholds are from, for people."""

HARDLY_SEEN = 40.0
"""PSNR of pictures in dB above which one can hardly see a difference: a convention of papers on
compression, which no study stands behind."""


@dataclass(frozen=True)
class _Level:
    """A verdict, and the highest mean and 95th percentile of FLIP that it stands for."""

    words: str
    mean: float = 1.0
    worst: float = 1.0


_LEVELS = (
    _Level("A viewer would hardly tell them apart", UNSEEN, NOTICED),
    _Level("A viewer who looks closely would see small differences", NOTICED, DISTINCT),
    _Level("A viewer would see that they differ", DISTINCT),
    _Level("A viewer would take them for different materials"),
)


@dataclass(frozen=True)
class Verdict:
    """How different two materials look in the pictures that differ most."""

    level: int  # 0 for hardly, to 3
    picture: str  # name of the pictures
    flip: float  # its mean over them, in [0, 1]
    flip_p95: float  # its 95th percentile

    @property
    def alike(self) -> bool:
        """Whether a viewer would hardly tell the materials apart."""
        return self.level == 0

    @property
    def words(self) -> str:
        return _LEVELS[self.level].words

    def __str__(self) -> str:
        if not self.flip:
            return "The pictures are equal: FLIP 0"
        crossed = _LEVELS[max(self.level - 1, 0)]
        parts = [
            f"{value:.3f}{where} ({'above' if value > limit else 'below'} {limit:g})"
            for where, value, limit in (
                ("", self.flip, crossed.mean),
                (" in the worst 5 %", self.flip_p95, crossed.worst),
            )
            if self.alike or value > limit
        ]
        return f"{self.words}: FLIP {', '.join(parts)}"

    def facts(self) -> dict[str, float | str]:
        """The verdict with its figures, the thresholds of the best one, and their source."""
        return {
            "text": str(self),
            "picture": self.picture,
            "flip": self.flip,
            "flip_threshold": UNSEEN,
            "flip_p95": self.flip_p95,
            "flip_p95_threshold": NOTICED,
            "source": SOURCE,
        }


def psnr_words(psnr: float) -> str:
    """What a PSNR of pictures in dB means to a viewer."""
    if psnr > HARDLY_SEEN:
        return f"you can hardly see a difference (above {HARDLY_SEEN:g} dB)"
    return f"you can see a difference (below {HARDLY_SEEN:g} dB)"


def verdict(pictures: Iterable[tuple[str, Floats]]) -> Verdict:
    """The verdict on pairs of pictures: that on the pair that differs most.

    A pair is its name and the FLIP error in [0, 1] of the pixels that count, any shape; see
    :func:`nacre.metrics.ldr_flip.flip`. Raises ValueError without a pair.
    """
    found = []
    for name, errors in pictures:
        mean, worst = float(errors.mean()), float(np.percentile(errors, 95.0))
        fits = (mean <= level.mean and worst <= level.worst for level in _LEVELS)
        found.append(Verdict(list(fits).index(True), name, mean, worst))
    return max(found, key=lambda one: (one.level, one.flip))
