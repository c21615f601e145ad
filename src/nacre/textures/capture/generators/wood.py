"""Wood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.textures.capture.generators.generator import Generator, colors, cover, number, whole
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import blend, fractal, linear, noise, positions, smooth_step


@dataclass(frozen=True)
class Wood(Generator):
    """Annual rings cut lengthwise, along y, with pores; of planks that lie side by side."""

    planks: int = whole(1, 1, 8)
    gap: float = number(0.01, 0.0, 0.05)
    rings: int = whole(9, 1, 40)
    waviness: float = number(0.12, 0.0, 0.6)
    contrast: float = number(0.8, 0.0, 1.0)
    palette: tuple[str, ...] = colors("#c79a63", "#8a5a2e")
    pores: float = number(0.3, 0.0, 1.0)
    pore_depth: float = number(0.006, 0.0, 0.03)
    relief: float = number(0.003, 0.0, 0.03)
    specular: float = number(0.04, 0.0, 0.4)
    tint: float = number(0.0, 0.0, 1.0)
    along: float = number(0.4, 0.15, 1.0)
    across: float = number(0.25, 0.15, 1.0)
    chatoyance: float = number(0.0, 0.0, 40.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        x, _ = positions(size)
        plank = np.floor(x * self.planks).astype(int)
        shift = random.uniform(0.0, 1.0, (self.planks, 2))
        lightness = 1.0 + 0.15 * random.normal(size=self.planks) * (self.planks > 1)
        slow = noise(random, size, 2.0, 1.5)
        fast = noise(random, size, 8.0, 4.0)
        rows = (np.floor(shift[plank, 1] * size).astype(int) + np.arange(size)[:, None]) % size
        columns = np.broadcast_to(np.arange(size), (size, size))
        slow, fast = slow[rows, columns], fast[rows, columns]
        ring = self.rings * (x + self.waviness * (0.5 * slow + 0.08 * fast)) + shift[plank, 0]
        ring = ring - np.floor(ring)
        late = smooth_step(0.1, 0.9, ring) * smooth_step(1.0, 0.93, ring)
        streaks = noise(random, size, 60.0, 12.0)
        pore = smooth_step(1.0, 1.5, streaks + 0.7 * (self.pores - 0.5) - 0.4 * late)
        pore = pore * (self.pores > 0.0)
        fibres = noise(random, size, 90.0, 20.0)
        place = self.contrast * late + 0.06 * fibres + 0.08 * fractal(random, size, 2.0, 3)
        albedo = blend(linear(self.palette), place) * (1.0 - 0.55 * pore)[..., None]
        edge = np.zeros_like(x)
        if self.gap > 0.0 and self.planks > 1:
            side = abs(x * self.planks - plank - 0.5)
            edge = smooth_step(0.5 - self.gap * self.planks, 0.5, side)
        albedo = albedo * (lightness[plank] * (1.0 - 0.8 * edge))[..., None]
        height = self.relief * (late + 0.3 * fibres) - self.pore_depth * pore - 0.02 * edge
        specular, rough = self.specular * (1.0 - 0.6 * pore), (self.along, self.across)
        direction = 0.5 * np.pi + np.radians(self.chatoyance) * slow
        return cover(height, albedo, specular, *rough, direction, self.tint)
