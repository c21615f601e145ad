"""Directions of a texture as files give them: checked before they are used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join

PAIR_LIMIT = 1 << 18
"""Most pairs of directions of a texture: eleven times those of the database of Bonn."""

SAME = 2e-3
"""Distance in six dimensions below which two pairs of directions are the same: lists of them have
few digits."""

_TOLERANCE = 1e-3
_HORIZON = 1e-6


def from_degrees(theta: npt.ArrayLike, phi: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Unit vectors of polar angles and azimuths in degrees, shape (..., 3)."""
    return np.asarray(join(from_spherical(np.radians(theta), np.radians(phi))), np.float64)


def same_pairs(wi: Floats, wo: Floats, other_wi: Floats, other_wo: Floats) -> bool:
    """Whether pairs of unit directions, shape (n, 3), are the same as others, in the same order."""
    if wi.shape != other_wi.shape:
        return False
    distances = np.square(wi - other_wi).sum(axis=1) + np.square(wo - other_wo).sum(axis=1)
    return bool((distances < SAME**2).all())


def check_directions(
    directions: npt.NDArray[Any], where: str, names: Sequence[str] | None = None
) -> Floats:
    """Directions, shape (n, 3), as float32, if they are unit vectors above the horizon.

    Else a :class:`FormatError` starts with `where`, the file's path and what the directions are,
    and calls one by its name, or number: it is not finite, not of unit length to a thousandth, or
    not above the horizon.
    """
    directions = np.asarray(directions, np.float64)

    def refuse(bad: npt.NDArray[np.bool_], problem: str) -> None:
        if bad.any():
            first = int(bad.argmax())
            x, y, z = directions[first]
            name = names[first] if names else f"{first + 1} of {len(bad)}"
            raise FormatError(f"{where}: {name}, ({x:g}, {y:g}, {z:g}), {problem}")

    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.sqrt((directions**2).sum(axis=-1))
    refuse(~np.isfinite(lengths), "is not finite")
    refuse(np.abs(lengths - 1.0) > _TOLERANCE, "is not of unit length")
    refuse(directions[:, 2] < _HORIZON, "is not above the horizon")
    return directions.astype(np.float32)


def check_distinct(wi: Floats, wo: Floats, names: list[str], where: str) -> None:
    """Refuse a pair of directions, shape (n, 3), that appears twice, by its names."""
    pairs = np.concatenate([wi, wo], axis=1).round(6)
    _, first, which = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    origin = first[which.reshape(-1)]
    again = np.flatnonzero(origin != np.arange(len(pairs)))
    if len(again):
        one, other = names[origin[again[0]]], names[again[0]]
        raise FormatError(f"{where}: {one} and {other} have the same light and view; keep one")
