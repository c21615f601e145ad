"""Cloth, felt and carpet."""

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
from nacre.textures.capture.patterns import (
    Cells,
    Indices,
    cells,
    fractal,
    lay_fibres,
    linear,
    noise,
    positions,
    scattered,
)

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


@dataclass(frozen=True)
class Felt(Generator):
    """Curled fibres in all directions, or mostly along x, pressed together."""

    fibres: int = whole(700, 50, 3000)
    length: float = number(0.5, 0.05, 1.5)
    radius: float = number(0.006, 0.003, 0.03)
    curl: float = number(3.0, 0.0, 15.0)
    loft: float = number(0.02, 0.0, 0.1)
    alignment: float = number(0.0, 0.0, 1.0)
    unevenness: float = number(0.3, 0.0, 2.0)
    palette: tuple[str, ...] = colors("#8c2f39")
    variation: float = number(0.15, 0.0, 1.0)
    specular: float = number(0.04, 0.0, 0.4)
    tint: float = number(0.3, 0.0, 1.0)
    along: float = number(0.6, 0.15, 1.0)
    across: float = number(0.35, 0.15, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        steps = int(np.ceil(self.length / (0.7 * self.radius))) + 1
        start = random.uniform(size=(self.fibres, 2))
        azimuth = random.uniform(0.0, np.pi, self.fibres) * (1.0 - self.alignment)
        bend = random.normal(size=(self.fibres, 3)) * self.curl
        along = np.linspace(0.0, 1.0, steps)
        wave = 0.3 * bend[:, 1:2] * np.sin(2.0 * np.pi * 2.0 * (along + bend[:, 2:3]))
        angle = azimuth[:, None] + self.length * (bend[:, :1] * along + wave)
        path = np.stack([np.cos(angle), np.sin(angle)], -1) * (self.length / steps)
        place = (start[:, None] + np.cumsum(path, 1)) % 1.0
        level = random.uniform(size=self.fibres) ** 0.5
        arch = 1.0 - (2.0 * along - 1.0) ** 4
        height = self.loft * level[:, None] * arch
        points = np.concatenate([place, height[..., None]], -1).reshape(-1, 3)
        owners = np.repeat(np.arange(self.fibres), steps)
        top, owner = lay_fibres(size, points, self.radius, owners)
        gap = owner < 0
        waves = fractal(random, size, 3.0, 3)
        height = np.where(gap, 0.0, top) + 0.5 * self.loft * self.unevenness * waves
        color = linear(self.palette)[random.integers(len(self.palette), size=self.fibres)]
        color = color * (1.0 + self.variation * random.uniform(-1, 1, (self.fibres, 1)))
        albedo = color[owner] * np.where(gap, 0.6, 1.0)[..., None]
        rough = self.along, self.across
        return cover(height, albedo, self.specular, *rough, azimuth[owner], self.tint)


@dataclass(frozen=True)
class Carpet(Generator):
    """Tufts of pile, cut or looped; lengths are in distances between tufts."""

    pile: str = choice("loop", "cut")
    tufts: int = whole(12, 4, 32)
    height: float = number(0.7, 0.1, 1.5)
    jitter: float = number(0.3, 0.0, 1.0)
    unevenness: float = number(0.2, 0.0, 1.0)
    fibres: float = number(0.08, 0.0, 0.3)
    elongation: float = number(1.5, 1.0, 3.0)
    layout: str = choice("mixed", "stripes", "checks", "rings")
    palette: tuple[str, ...] = colors("#7a6a58", "#93836f")
    variation: float = number(0.15, 0.0, 1.0)
    specular: float = number(0.04, 0.0, 0.4)
    tint: float = number(0.3, 0.0, 1.0)
    along: float = number(0.55, 0.15, 1.0)
    across: float = number(0.3, 0.15, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        centres = scattered(random, self.tufts, self.jitter)
        found = cells(size, centres)
        count = self.tufts**2
        level = 1.0 + self.unevenness * random.uniform(-0.5, 0.5, count)
        lean = random.normal(size=(count, 2)) * 0.3
        heights, strand = (self._loops if self.pile == "loop" else self._cut)(found, lean)
        heights = self.height * level[found.index] * heights
        frequency = 5.0 * self.tufts
        heights = heights + self.fibres * noise(random, size, frequency)
        albedo = linear(self.palette)[self._color_of(centres, random)]
        albedo = albedo * (1.0 + self.variation * random.uniform(-1, 1, (count, 1)))
        shade = 1.0 + 0.2 * noise(random, size, frequency) * self.variation
        shade = shade * (0.55 + 0.45 * np.clip(heights / self.height, 0.0, 1.0))
        albedo = albedo[found.index] * np.clip(shade, 0.1, 2.0)[..., None]
        rough = self.along, self.across
        return cover(heights / self.tufts, albedo, self.specular, *rough, strand, self.tint)

    def _loops(self, found: Cells, lean: Floats) -> tuple[Floats, Floats]:
        """Arches of twisted yarn along y."""
        x, y = found.offset[..., 0] * self.elongation, found.offset[..., 1]
        rotation = lean[found.index, 0]
        cosine, sine = np.cos(rotation), np.sin(rotation)
        x, y = x * cosine - y * sine, x * sine + y * cosine
        dome = np.sqrt(np.maximum(0.0, 1.0 - 2.2 * (x * x + y * y)))
        groove = 0.08 * np.cos(2.0 * np.pi * (2.0 * y + 1.5 * x)) * dome
        return dome + groove, 0.5 * np.pi + 0.5 - rotation

    def _cut(self, found: Cells, lean: Floats) -> tuple[Floats, Floats]:
        """Bunches of ends, which lean each in a direction of its own."""
        slope = lean[found.index]
        tilt = (slope * found.offset).sum(-1)
        falling = np.clip(1.0 - 0.9 * found.distance**2, 0.0, 1.0)
        edge = np.clip(found.margin / 0.25, 0.0, 1.0) ** 0.5
        return falling * (0.3 + 0.7 * edge) + 0.4 * tilt, np.arctan2(slope[..., 1], slope[..., 0])

    def _color_of(self, centres: Floats, random: np.random.Generator) -> Indices:
        """Index of each tuft's color."""
        kinds = len(self.palette)
        if self.layout == "mixed":
            return random.integers(kinds, size=len(centres))
        x, y = centres.T
        bands = {
            "stripes": np.floor(x * 2 * kinds),
            "checks": np.floor(x * 4) + np.floor(y * 4),
            "rings": np.floor(np.hypot(x - 0.5, y - 0.5) * 3 * kinds),
        }
        return np.asarray(bands[self.layout].astype(int) % kinds)
