"""Between Mitsuba's vectors and spectra and the components of this package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.array import Array, Components, Floats
from nacre.brdf import Brdf
from nacre.color import luminance, upsample
from nacre.errors import require
from nacre.sampling.sequence import even_points

_ALBEDO_SAMPLES = 4096


def components(*values: Any) -> tuple[Array, ...]:
    """Numbers of a Mitsuba variant as arrays of a library that :mod:`nacre.array` knows.

    A scalar variant's floats become NumPy's: those divide by zero without raising.
    """
    return tuple(np.float64(v) if isinstance(v, float) else v for v in values)


def masked(mi: Any, value: Array, active: Any) -> Any:
    """`value` as `mi.Float`, 0 where not `active`."""
    if mi.Float is float:
        return float(value) if active else 0.0
    return mi.Float(value) & active


def glossy_sample(mi: Any, wo: Components, density: Array, active: Any) -> Any:
    """A `mi.BSDFSample3f` for a glossy BSDF with one component; its density is 0 where inactive."""
    sample = require("drjit", "render").zeros(mi.BSDFSample3f)
    sample.wo = mi.Vector3f(*(mi.Float(v) for v in wo))
    sample.pdf = masked(mi, density, active)
    sample.eta = 1.0
    sample.sampled_type = mi.UInt32(int(mi.BSDFFlags.GlossyReflection))
    sample.sampled_component = mi.UInt32(0)
    return sample


def spectrum(mi: Any, rgb: Components, wavelengths: Any, active: Any) -> Any:
    """A linear Rec. 709 color in the form that the variant of `mi` uses, 0 where not `active`.

    RGB, luminance, or the values of :func:`nacre.color.upsample` at wavelengths in nm; a
    depolarizing Mueller matrix of these in a polarized variant.
    """
    if mi.is_spectral:
        values = [upsample(rgb, w) for w in components(*wavelengths)]
    elif mi.is_monochromatic:
        values = [luminance(rgb)]
    else:
        values = list(rgb)
    return unpolarized(mi, values, active)


def unpolarized(mi: Any, values: Sequence[Array], active: Any) -> Any:
    """Values for the channels or wavelengths of a variant as its spectrum, 0 where not `active`."""
    found = mi.UnpolarizedSpectrum([masked(mi, v, active) for v in values])
    return mi.depolarizer(found) if mi.is_polarized else found


def albedo(brdf: Brdf) -> Floats:
    """Reflected fraction of light that arrives along the normal, linear RGB of shape (3,).

    The samples are fixed, so results repeat, a few percent off where the sampler fits badly.
    """
    normal = np.array([0.0, 0.0, 1.0])
    directions, pdf = brdf.sample(normal, even_points(_ALBEDO_SAMPLES, 3))
    weight = np.divide(directions[:, 2], pdf, out=np.zeros_like(pdf), where=pdf > 0)
    return np.asarray((brdf.eval(directions, normal) * weight[:, None]).mean(0))
