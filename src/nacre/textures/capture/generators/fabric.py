"""Cloth of strands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.textures.capture.generators.fibers import spun, strays
from nacre.textures.capture.generators.generator import (
    Generator,
    choice,
    colors,
    cover,
    number,
    whole,
)
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import Indices, linear, noise, positions

_WEAVES: dict[str, tuple[int, Callable[[Any, Any], Any]]] = {
    "plain": (2, lambda i, j: (i + j) % 2 == 0),
    "twill": (4, lambda i, j: (i + j) % 4 < 2),
    "satin": (5, lambda i, j: (2 * i + j) % 5 != 0),
    "basket": (4, lambda i, j: (i // 2 + j // 2) % 2 == 0),
    "herringbone": (8, lambda i, j: (np.where(i // 4 % 2 == 0, i, 7 - i) + j) % 4 < 2),
}
"""After how many strands it repeats, and where strand i, along y, lies above strand j, along x."""


class _Strands(NamedTuple):
    """Parallel strands: their height (-inf between them), the strand at each point, grooves, and -1
    to 1 from edge to edge.
    """

    height: Floats
    strand: Indices
    groove: Floats
    side: Floats


@dataclass(frozen=True)
class Fabric(Generator):
    """Strands along y (warp) and along x (weft), one over the other, of twisted fibers.

    Lengths are in distances between strands; colors repeat from strand to strand. Fibers may be
    spun one by one, and stray.
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
    fibers: int = whole(0, 0, 24)
    melange: float = number(0.0, 0.0, 1.0)
    unevenness: float = number(0.0, 0.0, 0.5)
    strays: int = whole(0, 0, 2000)
    stray_length: float = number(2.0, 0.2, 20.0)

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
        if self.unevenness > 0.0:
            x, y = (v + self._wander(random, size) for v in (x, y))
        warp = self._strands(x, y, above.T)
        weft = self._strands(y, x, -above)
        uppermost = warp.height >= weft.height
        height, owner, groove = (
            np.where(uppermost, a, b) for a, b in zip(warp[:3], weft[:3], strict=True)
        )
        height = np.maximum(height, -0.5 * (self.crimp + self.roundness))
        height = height + self.fuzz * noise(random, size, 3.0 * self.strands)
        repeat = np.arange(self.strands)
        threads = np.array([linear(c)[repeat % len(c)] for c in (self.warp, self.weft)])
        above, below = (threads * lightness[..., None])[:, owner]
        albedo = np.where(uppermost[..., None], above, below)
        mottling = 1.0 + 0.5 * self.variation * noise(random, size, 2.0 * self.strands)
        shade = (1.0 + 0.25 * groove) * np.clip(mottling, 0.3, 1.7)
        twist = np.radians(self.twist)
        direction = np.where(uppermost, 0.5 * np.pi + twist, twist)
        if self.fibers:
            rise, gaps, chances = self._spun(random, warp, weft, x, y, uppermost)
            height, shade = height + rise, shade * gaps
            albedo = self._mixed(albedo, chances)
        height, albedo = height / self.strands, albedo * shade[..., None]
        if self.strays:
            radius = 0.2 * self.thickness / (self.strands * max(self.fibers, 4))
            height, hair, azimuths = strays(
                random, height, self.strays, self.stray_length / self.strands, radius,
                0.4 * self.strands, 0.12 / self.strands,
            )  # fmt: skip
            paint = linear(self.warp + self.weft)
            color = paint[random.integers(len(paint), size=self.strays)]
            color = 1.1 * self._mixed(color, random.uniform(size=(self.strays, 3)))
            albedo = np.where((hair < 0)[..., None], albedo, color[hair])
            direction = np.where(hair < 0, direction, azimuths[hair])
        rough = self.along, self.across
        return cover(height, albedo, self.specular, *rough, direction, self.tint)

    def _wander(self, random: np.random.Generator, size: int) -> Floats:
        """How far strands are from where they should be, in periods."""
        slow, fast = noise(random, size, 0.25 * self.strands), noise(random, size, self.strands)
        return self.unevenness / self.strands * (0.35 * slow + 0.12 * fast)

    def _mixed(self, color: Floats, chances: Floats) -> Floats:
        """Colors (..., 3) of fibers, some of which are dyed like those of other strands.

        The chances, of the same shape, say like which strands, whether, and how light.
        """
        paint = linear(self.warp + self.weft)
        other, whether, light = np.moveaxis(chances, -1, 0)
        amount = np.where(whether < self.melange, self.melange, 0.0)[..., None]
        tone = 1.0 + self.melange * (light - 0.5)
        dyed = paint[(other * len(paint)).astype(int)]
        return np.asarray((color + amount * (dyed - color)) * tone[..., None])

    def _spun(
        self, random: np.random.Generator, warp: _Strands, weft: _Strands, x: Floats, y: Floats,
        uppermost: npt.NDArray[np.bool_],
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Height and shade of fibers, and three chances for each, shape (size, size, 3).

        Those of warp and weft wind in the same sense, so they lean to opposite sides when the axes
        of one are exchanged for the other's.
        """
        turns = round(np.tan(np.radians(self.twist)) * self.strands / (np.pi * self.thickness))
        count = self.fibers
        first = spun(random, warp.side, y, warp.strand, count, turns)
        second = spun(random, weft.side, x, weft.strand, count, -turns)
        chances = random.uniform(size=(2, 2 * count * self.strands, 3))
        return (
            0.5 * self.thickness * np.where(uppermost, first.height, second.height),
            np.where(uppermost, first.shade, second.shade),
            np.where(uppermost[..., None], chances[0][first.fiber], chances[1][second.fiber]),
        )

    def _strands(self, across: Floats, along: Floats, above: Floats) -> _Strands:
        index = np.floor(across * self.strands).astype(int)
        half = 0.5 * self.thickness
        side = (across * self.strands - index - 0.5) / half
        place = along * self.strands - 0.5
        before = np.floor(place).astype(int)
        fraction = place - before
        ease = fraction * fraction * (3.0 - 2.0 * fraction)
        index = index % self.strands
        first, second = (above[index, (before + k) % self.strands] for k in (0, 1))
        middle = 0.5 * self.crimp * (first + (second - first) * ease)
        windings = 2.0 * np.tan(np.radians(self.twist)) * along * self.strands
        groove = np.cos(2.0 * np.pi * (side + np.round(windings.max()) * along))
        round_part = np.sqrt(np.maximum(0.0, 1.0 - side * side))
        height = middle + self.roundness * half * round_part + self.grooves * half * groove
        return _Strands(np.where(abs(side) < 1.0, height, -np.inf), index, groove, side)
