"""Cloth, felt and carpet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.generators.fibers import Spun, curled, spun, strays
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


class _Strands(NamedTuple):
    """Parallel strands: their height (-inf between them), whose it is, grooves, and -1 to 1 from
    edge to edge.
    """

    height: Floats
    index: Indices
    groove: Floats
    side: Floats


@dataclass(frozen=True)
class Fabric(Generator):
    """Strands along y (warp) and along x (weft), one over the other, of twisted fibres.

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
            yarns = self._spin(random, warp, y, 1), self._spin(random, weft, x, -1)
            chances = random.uniform(size=(2, 2 * self.fibers * self.strands, 3))
            rise, gaps = (
                np.where(uppermost, *two) for two in zip(*(v[:2] for v in yarns), strict=True)
            )
            fiber = np.where(
                uppermost[..., None], *(c[v.fiber] for c, v in zip(chances, yarns, strict=True))
            )
            height = height + 0.5 * self.thickness * rise
            shade = shade * gaps
            albedo = self._mixed(albedo, fiber)
        height, albedo = height / self.strands, albedo * shade[..., None]
        if self.strays:
            height, hair, curls = strays(
                random, height, self.strays, self.stray_length / self.strands, self._hair,
                0.4 * self.strands, 0.12 / self.strands,
            )  # fmt: skip
            paint = linear(self.warp + self.weft)
            color = paint[random.integers(len(paint), size=self.strays)]
            color = 1.1 * self._mixed(color, random.uniform(size=(self.strays, 3)))
            albedo = np.where((hair < 0)[..., None], albedo, color[hair])
            direction = np.where(hair < 0, direction, curls.azimuth[hair])
        rough = self.along, self.across
        return cover(height, albedo, self.specular, *rough, direction, self.tint)

    @property
    def _hair(self) -> float:
        """Radius of stray fibers in periods."""
        return 0.2 * self.thickness / (self.strands * max(self.fibers, 4))

    def _wander(self, random: np.random.Generator, size: int) -> Floats:
        """How far strands are from where they should be, in periods."""
        slow, fast = noise(random, size, 0.25 * self.strands), noise(random, size, self.strands)
        return self.unevenness / self.strands * (0.35 * slow + 0.12 * fast)

    def _mixed(self, color: Floats, chances: Floats) -> Floats:
        """Colors (..., 3) of fibers, some of which are dyed as those of other strands are.

        The chances, of the same shape, say as which, whether, and how light.
        """
        paint = linear(self.warp + self.weft)
        other, whether, light = np.moveaxis(chances, -1, 0)
        amount = np.where(whether < self.melange, self.melange, 0.0)[..., None]
        tone = 1.0 + self.melange * (light - 0.5)
        dyed = paint[(other * len(paint)).astype(int)]
        return np.asarray((color + amount * (dyed - color)) * tone[..., None])

    def _spin(
        self, random: np.random.Generator, strands: _Strands, along: Floats, hand: int
    ) -> Spun:
        """Fibers of strands; a hand of -1 winds them as in a mirror."""
        circumference = np.pi * self.thickness
        turns = round(np.tan(np.radians(self.twist)) * self.strands / circumference)
        return spun(random, strands.side, along, strands.index, self.fibers, hand * turns)

    def _strands(self, across: Floats, along: Floats, above: Floats) -> _Strands:
        """Parallel strands; `above` has a row for each."""
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
        fibers = curled(
            random, self.fibres, self.length, self.radius, self.curl, self.loft, self.alignment
        )
        top, owner = fibers.seen(size)
        gap = owner < 0
        waves = fractal(random, size, 3.0, 3)
        height = np.where(gap, 0.0, top) + 0.5 * self.loft * self.unevenness * waves
        color = linear(self.palette)[random.integers(len(self.palette), size=self.fibres)]
        color = color * (1.0 + self.variation * random.uniform(-1, 1, (self.fibres, 1)))
        albedo = color[owner] * np.where(gap, 0.6, 1.0)[..., None]
        rough = self.along, self.across
        return cover(height, albedo, self.specular, *rough, fibers.azimuth[owner], self.tint)


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
