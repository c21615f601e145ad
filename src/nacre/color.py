"""Linear Rec. 709 RGB: luminance, CIE XYZ, spectra, and tone mapping.

A color becomes the spectrum red * r + green * g + blue * b of three smooth spectra that lie in [0,
1], sum to 1 at every wavelength and reproduce linear Rec. 709 RGB under D65 and the CIE 1931
2-degree observer to 1e-4 (Mallett and Yuksel 2019, "Spectral Primary Decomposition for Rendering
with sRGB Reflectance"). Being linear it holds for values above 1, which a reflectance in 1/sr has.
`lab/studies/ablations/spectral_primaries.py` makes the table.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Colors, Components, Doubles, Floats, Table, namespace

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear Rec. 709 red, green and blue in luminance (ITU-R BT.709)."""

GAMMA = 2.2  # exponent of displays (NBRDF paper, section 3.2)

_LINE = 24.0 / 116.0  # cube root where CIELAB goes on in a straight line
_GLARE = 0.15  # slope over the logarithm above 1, where displays end

FIRST, STEP = 360.0, 10.0  # wavelength of the first node and distance of two nodes, nm

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


def luminance(rgb: Components) -> Array:
    return LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2]


# x and y of red, green, blue and white (ITU-R BT.709)
REC_709 = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))

RADIANCE_PRIMARIES = ((0.64, 0.33), (0.29, 0.60), (0.15, 0.06), (1.0 / 3.0, 1.0 / 3.0))
"""The same for Radiance's color, whose white is the spectrum of equal energy (color.h)."""


def rgb_to_xyz_matrix(chromaticities: npt.ArrayLike) -> Doubles:
    """The matrix (3, 3) from linear RGB to CIE 1931 XYZ; Y of (1, 1, 1) is 1.

    `chromaticities` are x and y of red, green, blue and white, shape (4, 2).
    """
    x, y = np.asarray(chromaticities, np.float64).T
    red, green, blue, white = np.stack([x / y, np.ones(4), (1.0 - x - y) / y], axis=1)
    primaries = np.stack([red, green, blue], axis=1)
    return np.asarray(primaries * np.linalg.solve(primaries, white))


def xyz_to_rgb(xyz: Colors) -> Doubles:
    """Linear Rec. 709 RGB from CIE 1931 XYZ, shape (..., 3); Y of (f, f, f) is f (ITU-R BT.709)."""
    to_rgb = np.linalg.inv(rgb_to_xyz_matrix(REC_709))
    return np.asarray(np.asarray(xyz, np.float64) @ to_rgb.T)


def rgb_to_xyz(rgb: Colors) -> Doubles:
    """CIE 1931 XYZ from linear Rec. 709 RGB, the inverse of :func:`xyz_to_rgb`."""
    return np.asarray(np.asarray(rgb, np.float64) @ rgb_to_xyz_matrix(REC_709).T)


def tone_map(image: Floats, gamma: float = GAMMA) -> Floats:
    """Clip linear values to [0, 1] and apply a gamma curve (NBRDF paper, section 3.2)."""
    mapped: Floats = np.clip(image, 0.0, 1.0) ** (1.0 / gamma)
    return mapped


def displayed(radiance: Floats, dark: float) -> tuple[Floats, Floats]:
    """What displays show of radiance, and its derivative; negative radiance counts as 0.

    Up to 1 it is the gamma curve, above a slow logarithm, so that highlights still count a little.
    `dark` is added to the radiance: at black, the gamma curve has no derivative.
    """
    x = np.maximum(radiance, 0.0) + dark
    below = np.minimum(x, 1.0) ** (1.0 / GAMMA)
    above = np.maximum(x, 1.0)
    return below + _GLARE * np.log(above), np.where(
        x < 1.0, 1.0 / GAMMA * below / x, _GLARE / above
    )


def srgb_to_linear(encoded: Floats) -> Floats:
    """Undo the sRGB curve (IEC 61966-2-1) of values in [0, 1], of any shape."""
    high = ((encoded + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(encoded <= 0.04045, encoded / 12.92, high))


def xyz_to_lab(xyz: npt.ArrayLike, white: npt.ArrayLike) -> Doubles:
    """CIELAB (ISO/CIE 11664-4) of tristimulus values relative to a white's, shapes (..., 3).

    Values below 0, which saturated RGB may give, continue the straight line near black.
    """
    ratio = np.asarray(xyz, np.float64) / np.asarray(white, np.float64)
    line = (841.0 / 108.0) * ratio + 16.0 / 116.0
    x, y, z = np.moveaxis(np.where(ratio > _LINE**3, np.cbrt(ratio), line), -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def lab_to_xyz(lab: npt.ArrayLike) -> Doubles:
    """Tristimulus values relative to the white's, the inverse of :func:`xyz_to_lab`."""
    lightness, a, b = np.moveaxis(np.asarray(lab, np.float64), -1, 0)
    y = (lightness + 16.0) / 116.0
    root = np.stack([y + a / 500.0, y, y - b / 200.0], axis=-1)
    return np.where(root > _LINE, root**3, (root - 16.0 / 116.0) * (108.0 / 841.0))


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


def upsampling_nodes() -> Floats:
    """Wavelengths in nm between which :func:`upsample` is linear, increasing, shape (nodes,)."""
    bends = np.abs(np.diff([_RED, _BLUE], 2)).max(axis=0) > 0.0
    inner = 1 + np.flatnonzero(bends)
    return FIRST + STEP * np.concatenate([[0], inner, [_LAST]]).astype(np.float64)
