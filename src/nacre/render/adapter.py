"""Between Mitsuba's vectors and spectra and the components of this package.

A color becomes the spectrum red * r + green * g + blue * b of three smooth spectra that lie in [0,
1], sum to 1 at every wavelength and reproduce linear Rec. 709 RGB under D65 and the CIE 1931
2-degree observer to 1e-4 (Mallett and Yuksel 2019, "Spectral Primary Decomposition for Rendering
with sRGB Reflectance"). Being linear it holds for values above 1, which a reflectance in 1/sr has.
`studies/ablations/spectral_primaries.py` makes the table.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Array, Components, Floats, Table, namespace
from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.errors import require
from nacre.sampling.sequence import even_points

_ALBEDO_SAMPLES = 4096

FIRST, STEP = 360.0, 10.0
"""Wavelength of the first node and distance of two nodes, nm."""

# fmt: off
_RED = (
    0.02832, 0.02831, 0.02831, 0.02829, 0.02822, 0.02792, 0.02692, 0.02424, 0.02008, 0.01852,
    0.02929, 0.01199, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.01534, 0.20631, 0.47757, 0.73939, 0.9246,
    1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
)
_BLUE = (
    0.97168, 0.97169, 0.97169, 0.97171, 0.97178, 0.97208, 0.97308, 0.97576, 0.97992, 0.98148,
    0.97071, 0.87847, 0.70497, 0.49203, 0.2838, 0.11226, 0.00901, 0, 0, 0, 0, 0.04692, 0.052,
    0.03436, 0.0124, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
)
# fmt: on
_RED_TABLE, _BLUE_TABLE = Table(_RED), Table(_BLUE)
_LAST = len(_RED) - 1


def components(*values: Any) -> tuple[Array, ...]:
    """Numbers of a Mitsuba variant as arrays of a library that :mod:`nacre.array` knows.

    A scalar variant's floats become NumPy's: those divide by zero without raising.
    """
    return tuple(np.float64(v) if isinstance(v, float) else v for v in values)


def vector(mi: Any, values: Components) -> Any:
    """`mi.Vector3f` of three components."""
    return mi.Vector3f(*(mi.Float(v) for v in values))


def masked(mi: Any, value: Array, active: Any) -> Any:
    """`value` as `mi.Float`, 0 where not `active`."""
    if mi.Float is float:
        return float(value) if active else 0.0
    return mi.Float(value) & active


def glossy_sample(mi: Any, wo: Components, density: Array, active: Any) -> Any:
    """A `mi.BSDFSample3f` of a glossy BSDF of one component, of density 0 where not `active`."""
    sample = require("drjit", "render").zeros(mi.BSDFSample3f)
    sample.wo = vector(mi, wo)
    sample.pdf = masked(mi, density, active)
    sample.eta = 1.0
    sample.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
    sample.sampled_component = mi.UInt32(0)
    return sample


def spectrum(mi: Any, rgb: Components, wavelengths: Any, active: Any) -> Any:
    """What the variant of `mi` carries of a linear Rec. 709 color, 0 where not `active`.

    RGB, luminance, or the values of :func:`upsample` at wavelengths in nm; a depolarizing Mueller
    matrix of these in a polarized variant.
    """
    if mi.is_spectral:
        values = [upsample(rgb, w) for w in components(*wavelengths)]
    elif mi.is_monochromatic:
        values = [luminance(rgb)]
    else:
        values = list(rgb)
    unpolarized = mi.UnpolarizedSpectrum([masked(mi, v, active) for v in values])
    return mi.depolarizer(unpolarized) if mi.is_polarized else unpolarized


def albedo(brdf: Brdf) -> Floats:
    """Reflected fraction of light that arrives along the normal, linear RGB of shape (3,).

    Samples are fixed: repeatable, with an error of a few per cent where the sampler fits badly.
    """
    normal = np.array([0.0, 0.0, 1.0])
    directions, pdf = brdf.sample(normal, even_points(_ALBEDO_SAMPLES, 3))
    weight = np.divide(directions[:, 2], pdf, out=np.zeros_like(pdf), where=pdf > 0)
    return np.asarray((brdf.eval(directions, normal) * weight[:, None]).mean(0))


def primaries(wavelength: Array) -> Components:
    """The spectra of red, green and blue at wavelengths in nm: in [0, 1], with a sum of 1.

    Beyond 360 to 830 nm the end values hold.
    """
    xp = namespace(wavelength)
    place = xp.minimum(xp.maximum((wavelength - FIRST) / STEP, 0.0), float(_LAST))
    low = xp.minimum(xp.floor(place), _LAST - 1.0)
    part, index = place - low, xp.to_index(low)

    def interpolate(table: Table) -> Array:
        left, right = xp.take(table, index), xp.take(table, index + 1)
        return left + part * (right - left)

    red, blue = interpolate(_RED_TABLE), interpolate(_BLUE_TABLE)
    return red, xp.maximum(1.0 - red - blue, 0.0), blue


def upsample(rgb: Components, wavelength: Array) -> Array:
    """Value at a wavelength in nm of the spectrum of a linear Rec. 709 color."""
    red, green, blue = primaries(wavelength)
    return rgb[0] * red + rgb[1] * green + rgb[2] * blue
