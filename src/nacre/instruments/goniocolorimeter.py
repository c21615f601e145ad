"""Color at several angles, for coatings with flakes (ASTM E2194, ASTM E2539).

An aspecular angle goes from the mirror direction toward the light, in the plane of incidence:
"45as15" is light at 45 degrees, seen 15 degrees off the mirror direction. A view outside of the
plane also has an azimuth about the mirror direction, from the side away from the light:
"45as60az125.3" is seen under 45 degrees, at a right angle to the plane of incidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.instruments.apertures import frame, mirrored
from nacre.instruments.colors import Color
from nacre.instruments.illuminants import Illuminant, Observer
from nacre.instruments.observing import Specimen
from nacre.instruments.pairs import Pairs


@dataclass(frozen=True)
class Geometry:
    """Light and view of one reading; all angles are in degrees.

    Parameters
    ----------
    light
        Angle of the light from the normal.
    aspecular
        Angle of the view from the mirror direction; negative away from the light.
    azimuth
        Azimuth about the mirror direction; None in the plane of incidence.
    """

    light: float
    aspecular: float
    azimuth: float | None = None

    @property
    def name(self) -> str:
        around = "" if self.azimuth is None else f"az{self.azimuth:g}"
        return f"{self.light:g}as{self.aspecular:g}{around}"

    def directions(self) -> tuple[Doubles, Doubles]:
        """Unit directions to the light, at azimuth 0, and to the viewer, (3,) each."""
        off = math.radians(self.aspecular)
        toward, across, mirror = frame(-self.light)
        turn = math.pi if self.azimuth is None else math.radians(self.azimuth)
        aside = -math.cos(turn) * toward + math.sin(turn) * across
        return mirrored(mirror), math.cos(off) * mirror + math.sin(off) * aside

    def pairs(self) -> Pairs:
        """The one pair of directions; its weight makes f_r a reflectance factor."""
        wi, wo = self.directions()
        return Pairs(wi[None], wo[None], np.array([math.pi]))


E2194 = tuple(Geometry(45.0, angle) for angle in (-15.0, 15.0, 25.0, 45.0, 75.0, 110.0))
"""The angles for metallic coatings."""

E2539 = (
    *E2194,
    *(Geometry(15.0, angle) for angle in (-45.0, -15.0, 15.0, 45.0, 80.0)),
    *(Geometry(45.0, 25.0, azimuth) for azimuth in (90.0, -90.0)),
    *(Geometry(45.0, 60.0, azimuth) for azimuth in (125.3, -125.3)),
    *(Geometry(15.0, 38.3, azimuth) for azimuth in (43.0, -43.0)),
    *(Geometry(15.0, 46.9, azimuth) for azimuth in (104.5, -104.5)),
)
"""All angles of instruments for interference pigments: two of the light, in the plane of incidence
and outside of it."""


@dataclass(frozen=True)
class Multiangle:
    """Readings of a multi-angle instrument: reflectance factors, the perfect white has Y = 100.

    Parameters
    ----------
    geometries, colors
        One of each per reading.
    flop_index
        From 0, a solid color, to about 20, a bright metallic; None where the lightness does not
        fall from 15 to 110 degrees, or an angle is missing.
    known
        Share of the geometries at which the material is known, from 0 to 1.
    """

    geometries: tuple[Geometry, ...]
    colors: tuple[Color, ...]
    flop_index: float | None
    known: float


def multiangle(
    brdf: Brdf,
    geometries: tuple[Geometry, ...] = E2194,
    *,
    illuminant: Illuminant = "D65",
    observer: Observer = 2,
    azimuth: float = 0.0,
) -> Multiangle:
    """The color of a material at several angles, each a single pair of directions.

    Parameters
    ----------
    brdf
        Any reflectance.
    geometries
        :data:`E2194`, :data:`E2539` or others.
    illuminant, observer
        What the color is for: "D65", "A" or "F11", and 2 or 10 degrees.
    azimuth
        Azimuth of the light in degrees, for anisotropic materials.

    Raises NacreError if the material has no color.
    """
    specimen = Specimen(brdf, azimuth)
    signals = [specimen.sum(geometry.pairs()) for geometry in geometries]
    colors = tuple(specimen.color(signal, illuminant, observer) for signal in signals)
    lightness = {g: c.lab[0] for g, c in zip(geometries, colors, strict=True)}
    known = float(np.mean([signal.known for signal in signals]))
    return Multiangle(geometries, colors, flop_index(lightness), known)


def flop_index(lightness: dict[Geometry, float]) -> float | None:
    """2.69 (L15 - L110)^1.11 / L45^0.86 of CIELAB L* at aspecular angles, light at 45 degrees
    (Alman 1987, "Directional Color Measurement of Metallic Flake Finishes").

    None where L* at one of the angles is missing or does not fall.
    """
    near, middle, far = (lightness.get(Geometry(45.0, angle)) for angle in (15.0, 45.0, 110.0))
    if near is None or middle is None or far is None or near < far or middle <= 0.0:
        return None
    return float(2.69 * (near - far) ** 1.11 / middle**0.86)
