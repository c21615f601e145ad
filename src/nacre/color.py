"""Linear Rec. 709 RGB: luminance, CIE XYZ and tone mapping."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Colors, Components, Floats

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear Rec. 709 red, green and blue in luminance (ITU-R BT.709)."""


def luminance(rgb: Components) -> Array:
    """Luminance of color components."""
    return LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2]


def xyz_to_rgb(xyz: Colors) -> npt.NDArray[np.float64]:
    """Linear Rec. 709 RGB of CIE 1931 XYZ, shape (..., 3); Y of (f, f, f) is f (ITU-R BT.709)."""
    chromaticities = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
    x, y = chromaticities.T
    red, green, blue, white = np.stack([x / y, np.ones(4), (1.0 - x - y) / y], axis=1)
    primaries = np.stack([red, green, blue], axis=1)
    to_xyz = primaries * np.linalg.solve(primaries, white)
    return np.asarray(np.asarray(xyz, np.float64) @ np.linalg.inv(to_xyz).T)


def tone_map(image: Floats, gamma: float = 2.2) -> Floats:
    """Clip linear values to [0, 1] and apply a gamma curve (NBRDF paper, section 3.2).

    Parameters
    ----------
    image
        Linear values of any shape.
    gamma
        Exponent of the display.
    """
    mapped: Floats = np.clip(image, 0.0, 1.0) ** (1.0 / gamma)
    return mapped


def srgb_to_linear(encoded: Floats) -> Floats:
    """Undo the sRGB curve (IEC 61966-2-1).

    Parameters
    ----------
    encoded
        Values in [0, 1] of any shape.

    Returns
    -------
    array
        Linear values in [0, 1].
    """
    high = ((encoded + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(encoded <= 0.04045, encoded / 12.92, high))
