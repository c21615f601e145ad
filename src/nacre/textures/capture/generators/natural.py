"""Leather, wood and stone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.generators.generator import Generator, colors, cover, number, whole
from nacre.textures.capture.generators.seam import sew
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.patterns import (
    blend,
    cells,
    fractal,
    linear,
    noise,
    positions,
    scattered,
    smooth_step,
)

_INSIDE = 0.4  # fraction of diffuse light that a clear coat reflects back into the wood
_THREAD_SPECULAR = 0.05
_THREAD_ROUGHNESS = 0.5, 0.3  # along its fibers and across them


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

    wander: float = number(0.0, 0.0, 1.0)
    fine_creases: float = number(0.0, 0.0, 1.0)
    stitches: int = whole(0, 0, 32)
    thread: tuple[str, ...] = colors("#d9c7a0", max_count=1)
    thread_width: float = number(0.022, 0.01, 0.04)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        shift: Floats | float = 0.0
        if self.wander > 0.0:
            bends = [noise(random, size, 1.2 * self.bumps) for _ in range(2)]
            shift = 0.15 * self.wander / self.bumps * np.stack(bends, -1)
        found = cells(size, scattered(random, self.bumps, self.jitter), shift)
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
        if self.fine_creases > 0.0:
            net = cells(size, scattered(random, 4 * self.bumps, 1.0), 0.4 * shift)
            fine = self.fine_creases * smooth_step(0.5, 0.0, net.margin)
            height, shade = height - 0.06 * fine, shade - 0.3 * self.darkening * fine
        height = height / self.bumps
        albedo = albedo * np.maximum(shade, 0.1)[..., None]
        if self.stitches:
            return self._sewn(random, height, albedo, rough)
        return cover(height, albedo, self.specular, rough, tint=self.tint)

    def _sewn(
        self, random: np.random.Generator, height: Floats, albedo: Floats, rough: Floats
    ) -> Mesostructure:
        seam = sew(random, len(height), self.stitches, self.thread_width)
        height = height - height.mean() + seam.rise
        albedo = albedo * seam.shade[..., None]
        sewn = seam.thread > height
        return cover(
            np.where(sewn, seam.thread, height),
            np.where(sewn[..., None], linear(self.thread) * seam.tone[..., None], albedo),
            np.where(sewn, _THREAD_SPECULAR, self.specular * seam.shade),
            np.where(sewn, _THREAD_ROUGHNESS[0], rough),
            np.where(sewn, _THREAD_ROUGHNESS[1], rough),
            np.where(sewn, seam.direction, 0.0),
            np.where(sewn, 0.0, self.tint),
        )


@dataclass(frozen=True)
class Wood(Generator):
    """Annual rings cut lengthwise, along y, with pores and ends of rays; in planks that lie side by
    side, bare or under a clear finish.
    """

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
    figure: float = number(1.5, 0.5, 12.0)
    variation: float = number(0.0, 0.0, 1.0)
    fine_pores: float = number(0.0, 0.0, 1.0)
    rays: float = number(0.0, 0.0, 1.0)
    finish: float = number(0.0, 0.0, 1.0)
    finish_roughness: float = number(0.2, 0.15, 1.0)

    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        x, _ = positions(size)
        plank = np.floor(x * self.planks).astype(int)
        shift = random.uniform(0.0, 1.0, (self.planks, 2))
        lightness = 1.0 + 0.15 * random.normal(size=self.planks) * (self.planks > 1)
        slow = noise(random, size, 2.0, self.figure)
        fast = noise(random, size, 8.0, 4.0)
        rows = (np.floor(shift[plank, 1] * size).astype(int) + np.arange(size)[:, None]) % size
        columns = np.broadcast_to(np.arange(size), (size, size))
        slow, fast = slow[rows, columns], fast[rows, columns]
        ring = self.rings * (x + self.waviness * (0.5 * slow + 0.08 * fast)) + shift[plank, 0]
        year = np.floor(ring).astype(int) % self.rings
        ring = ring - np.floor(ring)
        late = smooth_step(0.1, 0.9, ring) * smooth_step(1.0, 0.93, ring)
        streaks = noise(random, size, 60.0, 12.0)
        pore = smooth_step(1.0, 1.5, streaks + 0.7 * (self.pores - 0.5) - 0.4 * late)
        pore = pore * (self.pores > 0.0)
        fibres = noise(random, size, 90.0, 20.0)
        place = self.contrast * late + 0.06 * fibres + 0.08 * fractal(random, size, 2.0, 3)
        if self.variation > 0.0:
            width, tone = self.variation * random.uniform(-1.0, 1.0, (2, self.rings))[:, year]
            place = place + 0.4 * late * width + 0.15 * tone
        fine, ray = self._details(random, late)
        place = place + 0.6 * fine + 0.4 * ray  # as brown as late wood, and darker still
        albedo = blend(linear(self.palette), place) * (1.0 - 0.55 * pore)[..., None]
        albedo = albedo * (1.0 - 0.4 * np.maximum(fine, ray))[..., None]
        pore = np.maximum(pore, fine)
        edge = np.zeros_like(x)
        if self.gap > 0.0 and self.planks > 1:
            side = abs(x * self.planks - plank - 0.5)
            edge = smooth_step(0.5 - self.gap * self.planks, 0.5, side)
        albedo = albedo * (lightness[plank] * (1.0 - 0.8 * edge))[..., None]
        height = self.relief * (late + 0.3 * fibres) - self.pore_depth * pore
        bare = 1.0 - self.finish
        # What light loses inside of a coat: it is reflected back and absorbed again.
        lost = _INSIDE * self.finish
        albedo = albedo * (1.0 - lost) / (1.0 - lost * albedo)
        specular = self.specular * (1.0 - 0.6 * pore * bare)
        along, across = (
            bare * alpha + self.finish * self.finish_roughness
            for alpha in (self.along, self.across)
        )
        direction = 0.5 * np.pi + np.radians(self.chatoyance) * slow
        height = (1.0 - 0.8 * self.finish) * height - 0.02 * edge
        return cover(height, albedo, specular, along, across, direction, self.tint * bare)

    def _details(self, random: np.random.Generator, late: Floats) -> tuple[Floats, Floats]:
        """Fine pores, most of them in early wood, and ends of rays, each 0 to 1."""
        size, fine, ray = len(late), np.zeros_like(late), np.zeros_like(late)
        if self.fine_pores > 0.0:
            streaks = noise(random, size, 150.0, 24.0) + 0.9 * (self.fine_pores - 0.5)
            fine = smooth_step(0.9, 1.7, streaks + 0.9 * (0.5 - late))
        if self.rays > 0.0:
            ray = smooth_step(1.2, 2.0, noise(random, size, 100.0, 8.0) + 0.9 * (self.rays - 0.5))
        return fine, ray


@dataclass(frozen=True)
class Stone(Generator):
    """Rough or polished, made from grains of several minerals, with veins, pits and layers."""

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
