"""Wallpaper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    Indices,
    cells,
    fractal,
    linear,
    noise,
    positions,
    scattered,
    smooth_step,
)


@dataclass(frozen=True)
class Wallpaper(Generator):
    """Paper with a printed and embossed motif; the first color is the ground's, then the inks'."""

    motif: str = choice("stripes", "dots", "diamonds", "damask", "waves", "chips", "linen")
    repeats: int = whole(4, 1, 24)
    cover: float = number(0.5, 0.05, 0.95)
    emboss: float = number(0.01, -0.04, 0.04)
    softness: float = number(0.15, 0.02, 1.0)
    grain: float = number(0.002, 0.0, 0.02)
    palette: tuple[str, ...] = colors("#e6dfcf", "#a8b79a")
    fading: float = number(0.05, 0.0, 0.5)
    specular: float = number(0.03, 0.0, 0.3)
    roughness: float = number(0.6, 0.15, 1.0)
    ink_specular: float = number(0.05, 0.0, 0.8)
    ink_tint: float = number(0.0, 0.0, 1.0)
    ink_roughness: float = number(0.35, 0.15, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        field, inks = self._motif(random, size)
        low = np.quantile(field, 1.0 - self.cover)
        soft = self.softness * field.std()
        raised = smooth_step(low - soft, low + soft, field)
        printed = raised > 0.5
        height = self.emboss * raised + self.grain * fractal(random, size, 16.0, 3, 0.7)
        paint = linear(self.palette)
        ink = paint[1 + inks % (len(paint) - 1)] if len(paint) > 1 else paint[0]
        albedo = np.where(printed[..., None], ink, paint[0])
        albedo = albedo * (1.0 + self.fading * fractal(random, size, 4.0, 4))[..., None]
        specular = np.where(printed, self.ink_specular, self.specular)
        rough = np.where(printed, self.ink_roughness, self.roughness)
        return cover(height, albedo, specular, rough, tint=np.where(printed, self.ink_tint, 0.0))

    def _motif(self, random: np.random.Generator, size: int) -> tuple[Floats, Indices]:
        """A field that is high where ink goes, and which of the inks goes there."""
        x, y = (2.0 * np.pi * self.repeats * v for v in positions(size))
        columns = np.floor(x / (2.0 * np.pi) + 0.5).astype(int) % self.repeats
        rows = np.floor(y / (2.0 * np.pi) + 0.5).astype(int) % self.repeats
        if self.motif == "stripes":
            return np.cos(x), columns
        if self.motif == "dots":
            return np.cos(x) + np.cos(y), columns + rows
        if self.motif == "diamonds":
            return np.cos(x + y) * np.cos(x - y), columns + rows
        if self.motif == "waves":
            return np.cos(x + 1.5 * np.sin(y)), columns
        if self.motif == "linen":
            threads = noise(random, size, 8.0 * self.repeats, 8.0)
            return threads + noise(random, size, 8.0 * self.repeats, 8.0).T, columns
        if self.motif == "chips":
            found = cells(size, scattered(random, 3 * self.repeats, 1.0))
            chosen = random.uniform(size=(3 * self.repeats) ** 2)[found.index]
            return found.margin + 2.0 * chosen, found.index
        petals = np.cos(x) * np.cos(y) + 0.6 * np.cos(2 * x) + 0.5 * np.cos(2 * y + 2 * np.sin(x))
        leaves = 0.4 * np.sin(3 * x) * np.sin(3 * y + np.cos(x))
        return petals + leaves + 0.3 * np.cos(x + y) * np.cos(3 * y), columns + rows
