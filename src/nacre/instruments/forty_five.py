"""The geometries 45:0 of colorimetry (CIE 15:2018, section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.instruments.apertures import cone, ring
from nacre.instruments.colors import Color
from nacre.instruments.illuminants import Illuminant, Observer
from nacre.instruments.observing import Specimen
from nacre.instruments.pairs import Pairs

ANNULUS = (40.0, 50.0)
"""Half angles in degrees of the cones between which light of 45a:0 comes."""
BEAM = 5.0
"""Half angle in degrees of the cone of light of 45x:0, and of the receptor about the normal."""


@dataclass(frozen=True)
class Bidirectional:
    """Readings of a 45:0 instrument: reflectance factors, so that the perfect white has Y = 100.

    Parameters
    ----------
    annular
        45a:0: light from all around.
    directional
        45x:0: light from one azimuth.
    known
        Share of the pairs of directions at which the material is known, from 0 to 1.
    """

    annular: Color
    directional: Color
    known: float


def bidirectional(
    brdf: Brdf,
    *,
    illuminant: Illuminant = "D65",
    observer: Observer = 2,
    azimuth: float = 0.0,
) -> Bidirectional:
    """The color of a material at 45:0, which leaves the mirrored light out.

    Parameters
    ----------
    brdf
        Any reflectance.
    illuminant, observer
        What the color is for: "D65", "A" or "F11", and 2 or 10 degrees.
    azimuth
        Azimuth of the light of 45x:0 in degrees, for anisotropic materials.

    Raises NacreError if the material has no color.
    """
    specimen = Specimen(brdf, azimuth)
    signals = [specimen.sum(pairs) for pairs in (annular_pairs(), directional_pairs())]
    around, along = (specimen.color(signal, illuminant, observer) for signal in signals)
    return Bidirectional(around, along, min(signal.known for signal in signals))


def annular_pairs() -> Pairs:
    """What 45a:0 sums to a reflectance factor, 1 for the perfect white."""
    return _factor(ring(*ANNULUS, (6, 36)))


def directional_pairs() -> Pairs:
    """The same of 45x:0."""
    return _factor(cone(45.0, BEAM, (4, 12)))


def _factor(light: tuple[Doubles, Doubles]) -> Pairs:
    """Flux into the receptor about the normal, relative to the perfect white's."""
    pairs = Pairs.between(light, ring(0.0, BEAM, (3, 8)))
    return pairs.scaled(math.pi / float(pairs.weights.sum()))
