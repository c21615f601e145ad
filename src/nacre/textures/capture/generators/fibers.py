"""Fibers that strands are spun from, and fibers that stray from a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.patterns import Indices, lay_fibres, noise


@dataclass(frozen=True, eq=False)
class Curls:
    """Curled fibers as points along them, one closer to the next than the radius that all have."""

    points: Floats  # position in the plane and height, in periods, shape (k, 3)
    owner: Indices  # the fiber of each point, shape (k,)
    azimuth: Floats  # in which each fiber sets out, radians, shape (fibers,)
    radius: float

    def seen(self, size: int) -> tuple[Floats, Indices]:
        """Heights of the uppermost fibers and which these are; see
        :func:`nacre.textures.capture.patterns.lay_fibres`.
        """
        return lay_fibres(size, self.points, self.radius, self.owner)


def curled(
    random: np.random.Generator,
    count: int,
    length: float,
    radius: float,
    curl: float,
    loft: float,
    alignment: float = 0.0,
) -> Curls:
    """Fibers that rise from 0 at their ends, in any direction, or all along x at an alignment of 1.

    Lengths are in periods; the curl is how much they bend, one standard deviation, in radians per
    period; the loft is what the highest ones rise to.
    """
    steps = int(np.ceil(length / (0.7 * radius))) + 1
    start = random.uniform(size=(count, 2))
    azimuth = random.uniform(0.0, np.pi, count) * (1.0 - alignment)
    bend = random.normal(size=(count, 3)) * curl
    along = np.linspace(0.0, 1.0, steps)
    wave = 0.3 * bend[:, 1:2] * np.sin(2.0 * np.pi * 2.0 * (along + bend[:, 2:3]))
    angle = azimuth[:, None] + length * (bend[:, :1] * along + wave)
    path = np.stack([np.cos(angle), np.sin(angle)], -1) * (length / steps)
    place = (start[:, None] + np.cumsum(path, 1)) % 1.0
    level = random.uniform(size=count) ** 0.5
    arch = 1.0 - (2.0 * along - 1.0) ** 4
    height = loft * level[:, None] * arch
    points = np.concatenate([place, height[..., None]], -1).reshape(-1, 3)
    return Curls(points, np.repeat(np.arange(count), steps), azimuth, radius)


def strays(
    random: np.random.Generator,
    height: Floats,
    count: int,
    length: float,
    radius: float,
    curl: float,
    loft: float,
) -> tuple[Floats, Indices, Floats]:
    """Heights with stray fibers that follow the surface; the fiber seen at each point, -1 where
    none is; and the azimuth of each fiber, in radians.

    For `count` to `loft` see :func:`curled`; heights are in periods, shape (size, size).
    """
    size = len(height)
    hairs = curled(random, count, length, radius, curl, loft)
    ground = _smoothed(height, 2.0 * radius * size)
    columns, rows = (np.floor(hairs.points[:, :2] * size).astype(int) % size).T
    points = hairs.points.copy()
    points[:, 2] += ground[rows, columns]
    hairs = Curls(points, hairs.owner, hairs.azimuth, radius)
    top, owner = hairs.seen(size)
    visible = top > height
    return np.where(visible, top, height), np.where(visible, owner, -1), hairs.azimuth


def _smoothed(height: Floats, cells: float) -> Floats:
    """Heights as something meets them that is too stiff for less than so many cells."""
    waves = np.fft.fftfreq(len(height)) * (2.0 * np.pi * cells)
    keep = np.exp(-0.5 * (waves[:, None] ** 2 + waves**2))
    return np.asarray(np.fft.ifft2(np.fft.fft2(height) * keep).real)


class Spun(NamedTuple):
    """Fibers that wind around strands, all of shape (size, size)."""

    height: Floats  # in half widths of a strand
    shade: Floats  # 0 to 1, by the light that reaches between fibers
    fiber: Indices  # which one, from 0 to below 2 count strands


def spun(
    random: np.random.Generator,
    side: Floats,
    along: Floats,
    strand: Indices,
    count: int,
    turns: int,
) -> Spun:
    """Fibers on strands, `count` of which are seen side by side.

    `side` is -1 to 1 from edge to edge of the strand, `along` the place along it in periods, and
    `strand` its number. Fibers turn so often around a strand in a period; below 0 they wind the
    other way.
    """
    size, around = len(side), 2 * count
    angle = np.arcsin(np.clip(side, -1.0, 1.0)) / np.pi
    strands = int(strand.max()) + 1
    wander = noise(random, size, 0.8 * strands)
    place = around * (0.5 * angle + turns * along) + 0.08 * around * wander / np.pi
    fiber = np.floor(place).astype(int)
    middle = 2.0 * (place - fiber) - 1.0
    number = strand * around + fiber % around
    chance = random.uniform(size=strands * around)[number]
    # A fiber lies now above its neighbors and now below.
    level = np.sin(2.0 * np.pi * (chance + 0.25 * noise(random, size, 0.8 * strands)))
    round_part = np.sqrt(np.maximum(0.0, 1.0 - middle * middle))
    shade = np.clip(0.55 + 0.45 * round_part + 0.1 * level, 0.0, 1.0)
    return Spun((round_part - 0.8 + 0.5 * level) / count, shade, number)
