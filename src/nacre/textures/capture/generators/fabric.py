"""Woven cloth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.textures.capture.generators.generator import (
    Generator,
    choice,
    colors,
    cover,
    number,
    whole,
)
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import linear, noise, positions

_WEAVES: dict[str, tuple[int, Callable[[Any, Any], Any]]] = {
    "plain": (2, lambda i, j: (i + j) % 2 == 0),
    "twill": (4, lambda i, j: (i + j) % 4 < 2),
    "satin": (5, lambda i, j: (2 * i + j) % 5 != 0),
    "basket": (4, lambda i, j: (i // 2 + j // 2) % 2 == 0),
    "herringbone": (8, lambda i, j: (np.where(i // 4 % 2 == 0, i, 7 - i) + j) % 4 < 2),
}
"""After how many strands it repeats, and where strand i, along y, lies above strand j, along x."""


@dataclass(frozen=True)
class Fabric(Generator):
    """Strands along y (warp) and along x (weft), one over the other, of twisted fibres.

    Lengths are in distances between strands; colors repeat from strand to strand.
    """

    weave: str = choice(*_WEAVES)
    strands: int = whole(16, 2, 64)
    warp: tuple[str, ...] = colors("#3a4a6b")
    weft: tuple[str, ...] = colors("#b8b4a8")
    thickness: float = number(0.95, 0.4, 1.0)
    crimp: float = number(0.25, 0.0, 0.8)
    roundness: float = number(0.5, 0.05, 1.0)
    twist: float = number(25.0, -60.0, 60.0)
    grooves: float = number(0.06, 0.0, 0.3)
    fuzz: float = number(0.03, 0.0, 0.3)
    variation: float = number(0.1, 0.0, 1.0)
    specular: float = number(0.05, 0.0, 0.6)
    tint: float = number(0.3, 0.0, 1.0)
    along: float = number(0.5, 0.15, 1.0)
    across: float = number(0.25, 0.15, 1.0)

    def __post_init__(self) -> None:
        repeat = _WEAVES[self.weave][0]
        for count, what in (
            (repeat, f"the {self.weave} weave repeats"),
            (len(self.warp), "colors of warp"),
            (len(self.weft), "colors of weft"),
        ):
            if self.strands % count:
                raise ValueError(f"strands: {self.strands} is no multiple of {count} ({what})")

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        x, y = positions(size)
        i, j = np.arange(self.strands), np.arange(self.strands)[:, None]
        above = np.where(_WEAVES[self.weave][1](i, j), 1.0, -1.0)
        lightness = 1.0 + self.variation * random.uniform(-0.5, 0.5, (2, self.strands))
        warp = self._strands(x, y, above.T)
        weft = self._strands(y, x, -above)
        uppermost = warp[0] >= weft[0]
        height, owner, groove = (np.where(uppermost, a, b) for a, b in zip(warp, weft, strict=True))
        height = np.maximum(height, -0.5 * (self.crimp + self.roundness))
        height = height + self.fuzz * noise(random, size, 3.0 * self.strands)
        repeat = np.arange(self.strands)
        threads = np.array([linear(c)[repeat % len(c)] for c in (self.warp, self.weft)])
        above, below = (threads * lightness[..., None])[:, owner]
        albedo = np.where(uppermost[..., None], above, below)
        mottling = 1.0 + 0.5 * self.variation * noise(random, size, 2.0 * self.strands)
        shade = (1.0 + 0.25 * groove) * np.clip(mottling, 0.3, 1.7)
        twist = np.radians(self.twist)
        height, rough = height / self.strands, (self.along, self.across)
        direction = np.where(uppermost, 0.5 * np.pi + twist, twist)
        albedo = albedo * shade[..., None]
        return cover(height, albedo, self.specular, *rough, direction, self.tint)

    def _strands(
        self, across: Floats, along: Floats, above: Floats
    ) -> tuple[Floats, npt.NDArray[np.int64], Floats]:
        """Height, index and grooves of parallel strands; `above` has a row for each strand."""
        index = np.floor(across * self.strands).astype(int)
        half = 0.5 * self.thickness
        side = (across * self.strands - index - 0.5) / half
        place = along * self.strands - 0.5
        before = np.floor(place).astype(int)
        fraction = place - before
        ease = fraction * fraction * (3.0 - 2.0 * fraction)
        first, second = (above[index, (before + k) % self.strands] for k in (0, 1))
        middle = 0.5 * self.crimp * (first + (second - first) * ease)
        windings = 2.0 * np.tan(np.radians(self.twist)) * along * self.strands
        groove = np.cos(2.0 * np.pi * (side + np.round(windings.max()) * along))
        round_part = np.sqrt(np.maximum(0.0, 1.0 - side * side))
        height = middle + self.roundness * half * round_part + self.grooves * half * groove
        return np.where(abs(side) < 1.0, height, -np.inf), index, groove
