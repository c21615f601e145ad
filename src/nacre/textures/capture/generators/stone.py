"""Stone."""

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
class Stone(Generator):
    """Rough or polished, of grains of several minerals, with veins, pits and layers."""

    amplitude: float = number(0.01, 0.0, 0.06)
    frequency: float = number(3.0, 1.0, 20.0)
    gain: float = number(0.55, 0.2, 0.9)
    layers: float = number(0.0, 0.0, 1.0)
    grains: int = whole(30, 4, 60)
    grain_height: float = number(0.002, 0.0, 0.03)
    palette: tuple[str, ...] = colors("#8f8a80", "#6b665e", "#b0aa9c")
    mixing: float = number(0.5, 0.0, 1.0)
    veins: float = number(0.0, 0.0, 1.0)
    vein_color: tuple[str, ...] = colors("#e8e4da", max_count=1)
    pits: float = number(0.0, 0.0, 1.0)
    specular: float = number(0.04, 0.0, 0.4)
    roughness: float = number(0.45, 0.15, 1.0)
    sparkle: float = number(0.0, 0.0, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        shape = fractal(random, size, self.frequency, 6, self.gain)
        steps = 2.5 * shape
        stepped = (np.floor(steps) + smooth_step(0.7, 1.0, steps - np.floor(steps))) / 2.5
        height = self.amplitude * ((1.0 - self.layers) * shape + self.layers * stepped)
        found = cells(size, scattered(random, self.grains, 1.0))
        mineral = random.uniform(size=self.grains**2)
        grain = smooth_step(0.0, 0.5, found.margin) + 0.5 * mineral[found.index]
        height = height + self.grain_height * grain
        patches = 0.5 + 0.25 * fractal(random, size, self.frequency, 5, 0.6)
        place = self.mixing * mineral[found.index] + (1.0 - self.mixing) * patches
        albedo = blend(linear(self.palette), place)
        ridge = abs(fractal(random, size, 2.0, 4, 0.5))
        vein = smooth_step(0.12, 0.02, ridge) * self.veins
        albedo = albedo * (1.0 - vein[..., None]) + vein[..., None] * linear(self.vein_color)
        hollow = smooth_step(1.0, 1.6, noise(random, size, 10.0) + self.pits - 0.5)
        hollow = hollow * (self.pits > 0.0)
        height = height - 0.03 * hollow
        albedo = albedo * (1.0 - 0.45 * hollow)[..., None]
        bright = (mineral > 0.9)[found.index] * self.sparkle
        rough = self.roughness * (1.0 - 0.4 * bright) + 0.3 * hollow
        return cover(height, albedo, self.specular + 0.4 * bright, rough)
