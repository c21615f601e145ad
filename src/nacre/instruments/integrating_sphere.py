"""Integrating spheres: d:8 with the specular component in and out, and directional-hemispherical
reflectance (CIE 15:2018, section 5; CIE 130).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.instruments.apertures import cone, frame, mirrored
from nacre.instruments.colors import Color
from nacre.instruments.hemisphere import hemisphere, trap
from nacre.instruments.illuminants import Illuminant, Observer
from nacre.instruments.mirror import Mirror
from nacre.instruments.observing import Signal, Specimen
from nacre.instruments.pairs import Pairs
from nacre.instruments.quadrature import EXACT, Rule

VIEW = 8.0
"""Angle of the receptor's axis from the normal, in degrees."""
RECEPTOR = 5.0
"""Half angle of its cone in degrees."""
TRAP = 6.0
"""Half angle of the gloss trap about the mirrored axis: no light from within 1 degree of what a
mirror would send into the receptor."""


@dataclass(frozen=True)
class Sphere:
    """Readings of a sphere instrument: reflectance factors, so that the perfect white has Y = 100.

    Parameters
    ----------
    included
        di:8, with the specular component.
    excluded
        de:8, without.
    known
        Share of the pairs of directions at which the material is known, from 0 to 1.
    """

    included: Color
    excluded: Color
    known: float


def sphere(
    material: Brdf | Mirror,
    *,
    illuminant: Illuminant = "D65",
    observer: Observer = 2,
    azimuth: float = 0.0,
) -> Sphere:
    """The color of a material in an integrating sphere, at d:8.

    Parameters
    ----------
    material
        Any reflectance, or a polished surface.
    illuminant, observer
        What the color is for: "D65", "A" or "F11", and 2 or 10 degrees.
    azimuth
        Azimuth of the receptor in degrees, for anisotropic materials.

    Raises NacreError if the material has no color.
    """
    specimen = Specimen(material, azimuth)
    everything, trapped = specimen.sum(included_pairs()), specimen.sum(trapped_pairs())
    mirror = 0.0
    if specimen.mirror is not None:  # the trap takes all of it
        views, shares = _views(EXACT)
        mirror = float(shares @ specimen.mirror.reflectance(views[:, 2]))
    known = min(everything.known, trapped.known)
    included = Signal(everything.channels + mirror, known)
    excluded = Signal(everything.channels - trapped.channels, known)
    inside, out = (specimen.color(s, illuminant, observer) for s in (included, excluded))
    return Sphere(inside, out, known)


def included_pairs(rule: Rule = EXACT) -> Pairs:
    """What di:8 sums to a reflectance factor, 1 for the perfect white."""
    views, shares = _views(rule)
    return Pairs.joined(
        [
            _seen(hemisphere(view, rule), view, share)
            for view, share in zip(views, shares, strict=True)
        ]
    )


def trapped_pairs(rule: Rule = EXACT) -> Pairs:
    """What the gloss trap takes of it, which de:8 leaves out."""
    views, shares = _views(rule)
    axis = mirrored(frame(VIEW)[2])
    lights = (trap(axis, math.radians(TRAP), mirrored(view), rule) for view in views)
    return Pairs.joined(
        [_seen(light, *view) for light, *view in zip(lights, views, shares, strict=True)]
    )


def beam_pairs(angle: float, rule: Rule = EXACT) -> Pairs:
    """What the reflectance for light at an angle in degrees sums; see :func:`included_pairs`."""
    light = frame(angle)[2]
    view, solid = hemisphere(light, rule)
    return Pairs(np.broadcast_to(light, view.shape), view, solid * view[:, 2])


def directional_hemispherical(
    material: Brdf | Mirror,
    angle: float = 8.0,
    *,
    illuminant: Illuminant = "D65",
    observer: Observer = 2,
    azimuth: float = 0.0,
) -> Color:
    """The color of all light that a material reflects of a beam, 8:di at 8 degrees.

    Y / 100 is the luminous directional-hemispherical reflectance. It may be above 1 for a
    measurement that gains energy.

    Parameters
    ----------
    material
        Any reflectance, or a polished surface.
    angle
        Angle of incidence in degrees, from 0 to below 90.
    illuminant, observer, azimuth
        As in :func:`sphere`; the azimuth is that of the light.

    Raises
    ------
    ValueError
        If the angle is out of range.
    NacreError
        If the material has no color.
    """
    if not 0.0 <= angle < 90.0:
        raise ValueError(f"the angle of incidence must be in 0 to below 90, got {angle}")
    specimen = Specimen(material, azimuth)
    signal = specimen.sum(beam_pairs(angle))
    if specimen.mirror is not None:
        mirror = specimen.mirror.reflectance(frame(angle)[2][2])
        signal = Signal(signal.channels + mirror, signal.known)
    return specimen.color(signal, illuminant, observer)


def _views(rule: Rule) -> tuple[Doubles, Doubles]:
    """Directions to the receptor, (n, 3), and their shares of what it sees, (n,)."""
    views, weights = cone(VIEW, RECEPTOR, rule.views)
    return views, weights * views[:, 2] / float(weights @ views[:, 2])


def _seen(light: tuple[Doubles, Doubles], view: Doubles, share: float) -> Pairs:
    wi, solid = light
    return Pairs(wi, np.broadcast_to(view, wi.shape), share * solid * wi[:, 2])
