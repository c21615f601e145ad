"""Reflection haze at 20 degrees (ISO 13803:2014; ASTM E430, test method B)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nacre.brdf import Brdf
from nacre.instruments.apertures import Rectangle
from nacre.instruments.forty_five import annular_pairs
from nacre.instruments.glossmeter import RECEPTORS, flux, gloss, reference, white_flux
from nacre.instruments.mirror import Mirror
from nacre.instruments.observing import Specimen

ANGLE = 20.0
"""Angle of incidence in degrees."""
BANDS = (18.1, 21.9)
"""Angles of the two receptors beside the mirror direction, in degrees. Each is as large as that of
gloss: the bands go from 17.2 to 19 and from 21 to 22.8 degrees."""


@dataclass(frozen=True)
class Haze:
    """A reading of a haze meter.

    Parameters
    ----------
    value
        Linear haze in haze units (HU): the flux in both bands in percent of the flux that black
        glass sends into the receptor of gloss.
    log
        The same on the scale that shops read, 1285 log10(HU / 20 + 1).
    compensated
        Linear haze without the diffuse light in the bands, taken as that of a diffuse surface with
        the material's luminance at 45:0; not below 0.
    gloss
        Specular gloss at 20 degrees, in gloss units.
    known
        Share of the pairs of directions at which the material is known, from 0 to 1.
    """

    value: float
    log: float
    compensated: float
    gloss: float
    known: float


def haze(material: Brdf | Mirror, *, azimuth: float = 0.0) -> Haze:
    """Reflection haze: light that a gloss receptor at 20 degrees just misses.

    Parameters and errors are those of :func:`nacre.instruments.gloss`.
    """
    specimen = Specimen(material, azimuth, color=False)
    stops = bands()
    signal = flux(specimen, ANGLE, stops)
    value = 100.0 * specimen.luminous(signal) / reference(ANGLE)
    diffuse = 0.0
    if specimen.mirror is None:
        white = 100.0 / reference(ANGLE) * white_flux(ANGLE, stops)
        diffuse = white * specimen.luminous(specimen.sum(annular_pairs()))
    specular = gloss(material, ANGLE, azimuth=azimuth)
    known = min(signal.known, specular.known)
    return Haze(value, log_haze(value), max(0.0, value - diffuse), specular.value, known)


def bands() -> list[Rectangle]:
    """The receptors beside the mirror direction."""
    return [Rectangle(-angle, *RECEPTORS[ANGLE]) for angle in BANDS]


def log_haze(value: float) -> float:
    """Haze in units of the logarithmic scale, from linear haze units."""
    return 1285.0 * math.log10(value / 20.0 + 1.0)
