"""FLIP: how much a viewer sees who alternates between two pictures on a display.

Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference
Evaluator for Alternating Images"; the section of each step is named there. Every filter of the
paper is a sum of products of one function per axis, so pictures are filtered along their axes.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from nacre.array import Doubles, Floats
from nacre.color import REC_709, rgb_to_xyz_matrix, srgb_to_linear, tone_map, xyz_to_lab

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180.0
"""A display 0.7 m wide with 3840 pixels, seen from 0.7 m (section 4)."""
_CONTRAST: tuple[tuple[tuple[float, float], ...], ...] = (
    ((1.0, 0.0047),),
    ((1.0, 0.0053),),
    ((34.1, 0.04), (13.5, 0.025)),
)
"""Amplitudes and widths of the eye's sensitivity to contrasts of Y, Cx and Cz (table 1)."""
_FEATURE_WIDTH = 0.082
"""Degrees between the peaks of the filter of edges (section 4.2)."""
_COLOR_EXPONENT, _FEATURE_EXPONENT = 0.7, 0.5
_KNEE, _KNEE_VALUE = 0.4, 0.95
"""Differences up to this part of the largest fill [0, 0.95] (section 4.1.3)."""


def flip(truth: Floats, other: Floats) -> Floats:
    """LDR-FLIP error map of two tone-mapped pictures at 67 pixels per degree.

    Pictures are display values in [0, 1] (sRGB), shapes (height, width, 3); the map is the
    perceived difference in [0, 1], shape (height, width), float32.
    """
    pictures = [
        _opponents(srgb_to_linear(np.asarray(image, np.float64))) for image in (truth, other)
    ]
    first, second = (_uniform(_filtered(picture)) for picture in pictures)
    color = _spread(_color_difference(first, second))
    detected = [_features((picture[..., 0] + 16.0) / 116.0) for picture in pictures]
    change = np.max(np.abs(detected[0] - detected[1]), axis=0) / math.sqrt(2.0)
    return np.asarray(color ** (1.0 - change**_FEATURE_EXPONENT), np.float32)


def displayed_flip(truth: Floats, other: Floats) -> Floats:
    """LDR-FLIP error map of two linear pictures, tone mapped as for all measures of pictures.

    Shapes as for :func:`flip`; the pictures are linear Rec. 709 RGB, 1 is white.
    """
    return flip(tone_map(truth), tone_map(other))


@cache
def _to_relative() -> Doubles:
    """From linear RGB to X, Y and Z, each by that of white."""
    to_xyz = rgb_to_xyz_matrix(REC_709)
    return np.asarray(to_xyz / to_xyz.sum(axis=1, keepdims=True))


def _opponents(linear: Floats) -> Doubles:
    """Y, Cx and Cz, which are CIELAB without its cube root (section 4.1)."""
    x, y, z = np.moveaxis(linear @ _to_relative().T, -1, 0)
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def _filtered(opponents: Doubles) -> Doubles:
    """What the eye resolves, as linear RGB in [0, 1] (section 4.1.1)."""
    y, cx, cz = (_blurred(opponents[..., index], terms) for index, terms in enumerate(_CONTRAST))
    luminance = (y + 16.0) / 116.0
    relative = np.stack([luminance + cx / 500.0, luminance, luminance - cz / 200.0], axis=-1)
    return np.asarray(np.clip(relative @ np.linalg.inv(_to_relative()).T, 0.0, 1.0))


def _blurred(channel: Doubles, terms: tuple[tuple[float, float], ...]) -> Doubles:
    widest = max(width for part in _CONTRAST for _, width in part)
    radius = math.ceil(3.0 * math.sqrt(widest / (2.0 * math.pi**2)) * PIXELS_PER_DEGREE)
    square = (np.arange(-radius, radius + 1) / PIXELS_PER_DEGREE) ** 2
    total, blurred = 0.0, np.zeros_like(channel)
    for amplitude, width in terms:
        kernel = np.exp(-(math.pi**2) / width * square)
        weight = amplitude * math.sqrt(math.pi / width)
        total += weight * float(kernel.sum()) ** 2
        blurred += weight * _along_axes(channel, kernel, kernel)
    return blurred / total


def _along_axes(channel: Doubles, across: Doubles, down: Doubles) -> Doubles:
    """Filter a picture, shape (height, width), along its rows and its columns."""
    from scipy.ndimage import correlate1d  # which commands that draw nothing need not load

    rows = correlate1d(channel, across, axis=1, mode="nearest")
    return np.asarray(correlate1d(rows, down, axis=0, mode="nearest"))


def _uniform(linear: Doubles) -> Doubles:
    """CIELAB, whose colors weaken in the dark as Hunt found (section 4.1.2)."""
    lab = xyz_to_lab(linear @ _to_relative().T, 1.0)
    lab[..., 1:] *= 0.01 * lab[..., :1]
    return lab


def _color_difference(first: Doubles, second: Doubles) -> Doubles:
    """The HyAB distance, raised (section 4.1.2)."""
    apart = np.abs(first - second)
    distance = apart[..., 0] + np.hypot(apart[..., 1], apart[..., 2])
    return np.asarray(distance**_COLOR_EXPONENT)


def _spread(difference: Doubles) -> Doubles:
    """Differences of color in [0, 1], of which that of green and blue is the largest."""
    green, blue = (_uniform(np.eye(3)[index]) for index in (1, 2))
    largest = float(_color_difference(green, blue))
    knee = _KNEE * largest
    above = _KNEE_VALUE + (difference - knee) / (largest - knee) * (1.0 - _KNEE_VALUE)
    return np.where(difference < knee, _KNEE_VALUE / knee * difference, above)


@cache
def _feature_kernels() -> tuple[Doubles, Doubles, Doubles]:
    """Filters of edges and of points along one axis, and what blurs along the other; positive and
    negative weights add up to 1 and -1 (section 4.2).
    """
    deviation = 0.5 * _FEATURE_WIDTH * PIXELS_PER_DEGREE
    radius = math.ceil(3.0 * deviation)
    place = np.arange(-radius, radius + 1) / deviation
    gaussian = np.exp(-0.5 * place**2)

    def balanced(kernel: Doubles) -> Doubles:
        positive, negative = (float(np.maximum(sign * kernel, 0.0).sum()) for sign in (1.0, -1.0))
        return np.where(kernel > 0.0, kernel / positive, kernel / negative)

    edges, points = balanced(-place * gaussian), balanced((place**2 - 1.0) * gaussian)
    return edges, points, gaussian / gaussian.sum()


def _features(luminance: Doubles) -> Doubles:
    """How strong edges and points are, shape (2, height, width)."""
    edges, points, across = _feature_kernels()
    found = (
        np.hypot(_along_axes(luminance, kernel, across), _along_axes(luminance, across, kernel))
        for kernel in (edges, points)
    )
    return np.stack(list(found))
