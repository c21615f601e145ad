"""Felt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.textures.capture.generators.generator import Generator, colors, cover, number, whole
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import fractal, lay_fibres, linear


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
