"""From RGB to spectra, linearly.

A color becomes red * r + green * g + blue * b with three smooth spectra that lie in [0, 1], sum
to 1 at every wavelength and reproduce linear Rec. 709 RGB under D65 and the CIE 1931 2-degree
observer to 1e-4 (Mallett and Yuksel 2019, "Spectral Primary Decomposition for Rendering with sRGB
Reflectance"). Being linear it holds for values above 1, which a reflectance in 1/sr has.

The table is made by `studies/ablations/spectral_primaries.py`.
"""

from __future__ import annotations

from nacre.array import Array, Components, Table, namespace

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


def primaries(wavelength: Array) -> Components:
    """The spectra of red, green and blue.

    Parameters
    ----------
    wavelength
        Wavelengths in nm, an array of any library; beyond 360 to 830 nm the end values hold.

    Returns
    -------
    three arrays
        Values in [0, 1] that sum to 1.
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
