"""Specular gloss at 20, 60 and 85 degrees (ISO 2813:2014; ASTM D523).

Parallel light from a slit falls on the surface, and a lens images the slit in a field stop. The
angles of both stops are those of the standards. A reading is the flux through the receptor's,
relative to that of polished black glass of index 1.567, which is 100 units.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from nacre.brdf import Brdf
from nacre.instruments.apertures import Rectangle, mirrored
from nacre.instruments.mirror import BLACK_GLASS, Mirror
from nacre.instruments.observing import Signal, Specimen
from nacre.instruments.pairs import Pairs
from nacre.instruments.quadrature import EXACT, Rule

ANGLES = (20.0, 60.0, 85.0)
"""Angles of incidence in degrees."""

SOURCE = (0.75, 2.5)
"""Angles of the source's image in degrees, in the plane of incidence and across it."""
RECEPTORS = {20.0: (1.80, 3.6), 60.0: (4.4, 11.7), 85.0: (4.0, 6.0)}
"""The same of the receptor, by angle of incidence."""


@dataclass(frozen=True)
class Gloss:
    """A reading of a glossmeter.

    Parameters
    ----------
    angle
        Angle of incidence in degrees.
    value
        Specular gloss in gloss units (GU): 100 for black glass, 0 for no light.
    known
        Share of the pairs of directions at which the material is known, from 0 to 1.
    """

    angle: float
    value: float
    known: float


def gloss(material: Brdf | Mirror, angle: float = 60.0, *, azimuth: float = 0.0) -> Gloss:
    """Specular gloss of a material.

    Parameters
    ----------
    material
        Any reflectance, or a polished surface.
    angle
        20, 60 or 85 degrees.
    azimuth
        Azimuth of the plane of incidence in degrees, for anisotropic materials.

    Raises
    ------
    ValueError
        If the angle is another one.
    NacreError
        If the material has several bands that make no color. One band is read for itself.

    Examples
    --------
    >>> gloss(BLACK_GLASS, 20).value
    100.0
    """
    if angle not in RECEPTORS:
        raise ValueError(f"gloss is measured at 20, 60 or 85 degrees, not {angle:g}")
    specimen = Specimen(material, azimuth, color=False)
    signal = flux(specimen, angle, [receptor(angle)])
    return Gloss(float(angle), 100.0 * specimen.luminous(signal) / reference(angle), signal.known)


def receptor(angle: float) -> Rectangle:
    """The receptor in the mirror direction."""
    return Rectangle(-angle, *RECEPTORS[angle])


@functools.cache
def reference(angle: float) -> float:
    """Flux that black glass sends into the receptor; see :func:`flux`."""
    specimen = Specimen(BLACK_GLASS)
    return specimen.luminous(flux(specimen, angle, [receptor(angle)]))


def flux(specimen: Specimen, angle: float, receptors: Sequence[Rectangle]) -> Signal:
    """Flux through all receptors, per area and radiance of the source's image, in sr.

    It is the integral of f_r cos(theta_i) cos(theta_o) over the directions of source and receptor.
    """
    signal = specimen.sum(flux_pairs(angle, receptors))
    if specimen.mirror is None:
        return signal
    # Source nodes are either all in a receptor or all outside: the slit's image is smaller.
    source, weights = Rectangle(angle, *SOURCE).smooth()
    inside = sum(stop.holds(mirrored(source)) for stop in receptors)
    part = specimen.mirror.reflectance(source[:, 2]) * source[:, 2] * weights
    return Signal(signal.channels + float(part @ inside), signal.known)


def flux_pairs(angle: float, receptors: Sequence[Rectangle], rule: Rule = EXACT) -> Pairs:
    """The pairs behind :func:`flux`."""
    source, weights = Rectangle(angle, *SOURCE).smooth(rule.slit)
    return Pairs.joined(
        [
            Pairs.between((wi, weight), stop.around(mirrored(wi), rule))
            for wi, weight in zip(source, weights, strict=True)
            for stop in receptors
        ]
    )


def white_flux(angle: float, receptors: Sequence[Rectangle]) -> float:
    """What :func:`flux` is for the perfect white diffuse surface."""
    light, weights = Rectangle(angle, *SOURCE).smooth()
    seen = sum(float(solid @ view[:, 2]) for view, solid in (stop.smooth() for stop in receptors))
    return float(weights @ light[:, 2]) * seen / math.pi
