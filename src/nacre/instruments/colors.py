"""Colors of surfaces: CIE XYZ, CIELAB, and CIEDE2000 differences."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.color import xyz_to_lab as xyz_to_lab
from nacre.instruments.illuminants import Illuminant, Observer

_SEVENTH = 25.0**7


@dataclass(frozen=True)
class Color:
    """The color of a surface, seen at one geometry.

    Parameters
    ----------
    xyz
        CIE tristimulus values; Y of the perfect white is 100.
    white
        Those of the perfect white.
    illuminant, observer
        Under which, and by which observer in degrees.
    estimated
        Whether a spectrum was assumed: the material is known in RGB, and this is not D65 with the 2
        degree observer.
    """

    xyz: tuple[float, float, float]
    white: tuple[float, float, float]
    illuminant: Illuminant
    observer: Observer
    estimated: bool

    @property
    def lab(self) -> tuple[float, float, float]:
        """CIELAB L*, a*, b* (ISO/CIE 11664-4)."""
        lightness, a, b = xyz_to_lab(self.xyz, self.white).tolist()
        return lightness, a, b

    @property
    def chroma(self) -> float:
        """CIELAB C*."""
        return math.hypot(*self.lab[1:])

    @property
    def hue(self) -> float:
        """CIELAB hue angle h in degrees, from 0 to below 360."""
        _, a, b = self.lab
        return math.degrees(math.atan2(b, a)) % 360.0

    def difference(self, other: Color) -> float:
        """CIEDE2000 difference to another color."""
        return float(ciede2000(self.lab, other.lab))


def ciede2000(first: npt.ArrayLike, second: npt.ArrayLike) -> Doubles:
    """CIEDE2000 difference of CIELAB colors, shapes (..., 3), with all parametric factors 1.

    ISO/CIE 11664-6, in the form of Sharma, Wu and Dalal 2005, "The CIEDE2000 Color-Difference
    Formula: Implementation Notes, Supplementary Test Data, and Mathematical Observations".
    """
    (l1, a1, b1), (l2, a2, b2) = (
        np.moveaxis(np.asarray(lab, np.float64), -1, 0) for lab in (first, second)
    )
    stretch = 1.5 - 0.5 * _saturation(0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2)))
    a1, a2 = stretch * a1, stretch * a2
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, a)) % 360.0 for a, b in ((a1, b1), (a2, b2)))
    gray = c1 * c2 == 0.0
    turn = h2 - h1
    turn = np.where(turn > 180.0, turn - 360.0, np.where(turn < -180.0, turn + 360.0, turn))
    turn = np.where(gray, 0.0, turn)
    lightness, chroma = 0.5 * (l1 + l2), 0.5 * (c1 + c2)
    both = h1 + h2
    around = np.where(both < 360.0, both + 360.0, both - 360.0)
    hue = np.where(gray, both, 0.5 * np.where(np.abs(h1 - h2) > 180.0, around, both))
    weight = (
        1.0
        - 0.17 * _cos(hue - 30.0)
        + 0.24 * _cos(2.0 * hue)
        + 0.32 * _cos(3.0 * hue + 6.0)
        - 0.20 * _cos(4.0 * hue - 63.0)
    )
    off = (lightness - 50.0) ** 2
    delta_l = (l2 - l1) / (1.0 + 0.015 * off / np.sqrt(20.0 + off))
    delta_c = (c2 - c1) / (1.0 + 0.045 * chroma)
    delta_h = 2.0 * np.sqrt(c1 * c2) * np.sin(np.radians(0.5 * turn))
    delta_h = delta_h / (1.0 + 0.015 * chroma * weight)
    bend = 60.0 * np.exp(-(((hue - 275.0) / 25.0) ** 2))
    rotation = -2.0 * _saturation(chroma) * np.sin(np.radians(bend))
    square = delta_l**2 + delta_c**2 + delta_h**2 + rotation * delta_c * delta_h
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def _saturation(chroma: Doubles) -> Doubles:
    seventh = chroma**7
    return np.asarray(np.sqrt(seventh / (seventh + _SEVENTH)))


def _cos(degrees: Doubles) -> Doubles:
    return np.asarray(np.cos(np.radians(degrees)))
