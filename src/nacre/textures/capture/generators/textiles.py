"""Felt and carpet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.generators.fibers import curled
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
    scattered,
)


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
        """Bunches of ends, each of which leans in a direction of its own."""
        slope = lean[found.index]
        tilt = (slope * found.offset).sum(-1)
        falling = np.clip(1.0 - 0.9 * found.distance**2, 0.0, 1.0)
        edge = np.clip(found.margin / 0.25, 0.0, 1.0) ** 0.5
        return falling * (0.3 + 0.7 * edge) + 0.4 * tilt, np.arctan2(slope[..., 1], slope[..., 0])

    def _color_of(self, centres: Floats, random: np.random.Generator) -> Indices:
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
