"""Leather."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.textures.capture.generators.generator import Generator, colors, cover, number, whole
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import (
    blend,
    cells,
    fractal,
    linear,
    noise,
    scattered,
    smooth_step,
)


@dataclass(frozen=True)
class Leather(Generator):
    """Bumps between creases, with pores and wrinkles; lengths are in bumps."""

    bumps: int = whole(12, 3, 40)
    jitter: float = number(0.9, 0.0, 1.0)
    crease: float = number(0.25, 0.05, 0.8)
    depth: float = number(0.2, 0.0, 0.8)
    wrinkles: float = number(0.1, 0.0, 1.0)
    grain: float = number(0.015, 0.0, 0.1)
    pores: float = number(0.0, 0.0, 1.0)
    palette: tuple[str, ...] = colors("#5b3420", "#7b4a2c")
    darkening: float = number(0.5, 0.0, 1.0)
    wear: float = number(0.0, 0.0, 1.0)
    specular: float = number(0.05, 0.0, 0.6)
    roughness: float = number(0.3, 0.15, 1.0)
    tint: float = number(0.0, 0.0, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        found = cells(size, scattered(random, self.bumps, self.jitter))
        bump = smooth_step(0.0, self.crease, found.margin)
        levels = random.uniform(-0.15, 0.15, self.bumps**2)[found.index]
        height = self.depth * (bump * (1.0 + levels) - 0.15 * found.distance**2)
        height = height + self.wrinkles * 0.3 * fractal(random, size, 0.25 * self.bumps, 3)
        height = height + self.grain * fractal(random, size, 3.0 * self.bumps, 2, 0.7)
        pits = cells(size, scattered(random, 3 * self.bumps, 1.0))
        pit = smooth_step(0.35, 0.1, pits.distance) * self.pores
        height = height - 0.12 * pit
        mottling = 0.5 + 0.2 * fractal(random, size, 0.3 * self.bumps, 4)
        albedo = blend(linear(self.palette), mottling)
        shade = 1.0 - self.darkening * (1.0 - bump) - 0.4 * pit
        shade = shade + self.wear * smooth_step(0.6, 1.0, bump) * (noise(random, size, 3.0) > 0.3)
        rough = self.roughness * (1.0 + 0.6 * (1.0 - bump))
        albedo = albedo * np.maximum(shade, 0.1)[..., None]
        return cover(height / self.bumps, albedo, self.specular, rough, tint=self.tint)
