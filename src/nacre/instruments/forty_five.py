"""The geometries 45:0 of colorimetry (CIE 15:2018, section 5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.instruments.apertures import cone, ring
from nacre.instruments.colors import Color
from nacre.instruments.illuminants import Illuminant, Observer
from nacre.instruments.observing import Signal, Specimen

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
    signals = annular(specimen), directional(specimen)
    around, along = (specimen.color(signal, illuminant, observer) for signal in signals)
    return Bidirectional(around, along, min(signal.known for signal in signals))


def annular(specimen: Specimen) -> Signal:
    """Reflectance factor at 45a:0."""
    return _factor(specimen, *ring(*ANNULUS, (6, 36)))


def directional(specimen: Specimen) -> Signal:
    """Reflectance factor at 45x:0."""
    return _factor(specimen, *cone(45.0, BEAM, (4, 12)))


def _factor(specimen: Specimen, light: Doubles, solid: Doubles) -> Signal:
    """Flux into the receptor about the normal, relative to the perfect white's."""
    view, seen = ring(0.0, BEAM, (3, 8))
    wi, wo = np.repeat(light, len(view), axis=0), np.tile(view, (len(light), 1))
    weights = np.outer(solid * light[:, 2], seen * view[:, 2]).reshape(-1)
    return specimen.sum(wi, wo, weights).scaled(math.pi / float(weights.sum()))
