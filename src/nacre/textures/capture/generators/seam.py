"""Seams: two edges that meet, and a row of stitches of twisted thread along each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.patterns import noise, positions, smooth_step

_ROW = 0.075  # from the middle of the seam to each row of stitches
_EDGE = 0.012  # half the width of the groove between the edges
_PLIES = 3.0
_TWIST = np.radians(28.0)


class Seam(NamedTuple):
    """A seam along y in the middle of a period; arrays have shape (size, size)."""

    rise: Floats  # of what is sewn, in periods
    shade: Floats  # how bright that is: less in the groove and in holes, 0 to 1
    thread: Floats  # height of the thread in periods; -inf where none is
    tone: Floats  # of the thread: brighter on plies than between them, about 1
    direction: float  # azimuth of the thread's fibers in radians


def sew(random: np.random.Generator, size: int, stitches: int, width: float) -> Seam:
    """A seam with so many stitches per period in each row, and thread so wide, in periods.

    Edges curl down into a groove, stitches pull down what they lie on, and what is between two
    rises in puckers. Both ends of a stitch vanish in holes that it shares with its neighbors.
    """
    x, y = positions(size)
    away = x - 0.5 + 0.1 * width * noise(random, size, 6.0)
    side = np.where(away < 0.0, -1.0, 1.0)
    across = abs(away) - _ROW  # from the row of stitches
    place = stitches * y + np.where(side < 0.0, 0.0, 0.37)
    hole = place - np.round(place)
    number = np.floor(place).astype(int) % stitches
    along = 2.0 * (place - np.floor(place)) - 1.0  # -1 to 1 from hole to hole

    groove = smooth_step(2.2 * _EDGE, 0.2 * _EDGE, abs(away))
    roll = np.exp(-((abs(away) - 0.45 * _ROW) ** 2) / (2.0 * (0.3 * _ROW) ** 2))
    trough = np.exp(-(across**2) / (2.0 * (1.1 * width) ** 2))
    pucker = np.cos(2.0 * np.pi * place) * np.exp(-(across**2) / (2.0 * (0.5 * _ROW) ** 2))
    reach = np.hypot(hole / stitches, across) / width
    opening = smooth_step(0.75, 0.35, reach)
    rise = 0.012 * roll - 0.035 * groove - 0.55 * width * trough - 0.1 * width * pucker
    rise = rise - 0.8 * width * opening
    shade = 1.0 - 0.75 * groove - 0.75 * smooth_step(0.9, 0.4, reach)

    lean = random.uniform(0.08, 0.2, (2, stitches))[(side > 0.0).astype(int), number]
    offset = (across + lean * width * along) / (0.5 * width)
    taut = 1.0 - (along / 0.9) ** 6
    round_part = np.sqrt(np.maximum(0.0, 1.0 - offset * offset))
    turns = np.tan(_TWIST) / (np.pi * width * stitches)
    angle = np.arcsin(np.clip(offset, -1.0, 1.0)) / np.pi
    ply = abs(np.cos(np.pi * (_PLIES * angle + 0.5 * _PLIES * turns * along)))
    thread = width * (0.5 * round_part + 0.1 * ply + 0.55 * taut - 0.75)
    within = (abs(offset) < 1.0) & (abs(along) < 0.9)
    tone = (0.45 + 0.55 * ply) * (0.4 + 0.6 * taut)
    return Seam(rise, shade, np.where(within, thread, -np.inf), tone, 0.5 * np.pi + _TWIST)
