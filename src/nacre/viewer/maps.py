"""Environments in few bytes, for pages: wavelets of logarithms, as `page/maps.js` reads them.

A map's green light and the ratios of red and blue to it become logarithms to base 2, over which the
lifting scheme of CDF 9/7 wavelets runs (Daubechies and Sweldens 1998), around rows and mirrored at
the poles. Rounded coefficients are variable-length bytes, band by band, which pages compress well.
"""

from __future__ import annotations

import numpy as np

from nacre.array import Floats, Image

LEVELS = 6
_STEPS = 1 / 20, 1 / 14, 1 / 14
"""In octaves, of green and of the ratios: errors are about a third of them."""
_FLOOR = 2.0**-10
"""Of the mean light, below which a map counts as black."""

_LIFTS = -1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971
_SCALE = 1.230174104914001


def coded(pixels: Image) -> tuple[bytes, dict[str, object]]:
    """The bytes of a map (h, w, 3) and what else is needed to read them."""
    height, width, _ = pixels.shape
    floor = float(_FLOOR * pixels.mean())
    light = np.log2(np.asarray(pixels, np.float64) + floor)
    channels = light[..., 1], light[..., 0] - light[..., 1], light[..., 2] - light[..., 1]
    levels = _levels(width, height)
    parts = []
    for channel, step in zip(channels, _STEPS, strict=True):
        bands = _forward(channel, levels)
        parts += [_varints(np.round(band / step).astype(np.int64)) for band in bands]
    facts = {"width": width, "height": height, "levels": levels, "steps": _STEPS, "floor": floor}
    return b"".join(parts), facts


def _levels(width: int, height: int) -> int:
    levels = 0
    while levels < LEVELS and not (width >> levels) % 2 and not (height >> levels) % 2:
        levels += 1
    return levels


def _forward(values: Floats, levels: int) -> list[Floats]:
    """Bands of a picture, the coarsest first; of each level across, down, and both."""
    bands: list[Floats] = []
    for _ in range(levels):
        low, high = _split(values, periodic=True)
        (values, down), (across, both) = (
            (each.T for each in _split(part.T, periodic=False)) for part in (low, high)
        )
        bands = [across, down, both, *bands]
    return [values, *bands]


def _split(values: Floats, *, periodic: bool) -> tuple[Floats, Floats]:
    """Even and odd columns, lifted: means and details."""
    even, odd = values[:, ::2].copy(), values[:, 1::2].copy()
    for k, lift in enumerate(_LIFTS):
        if k % 2:
            before = np.concatenate([odd[:, -1:] if periodic else odd[:, :1], odd[:, :-1]], 1)
            even += lift * (odd + before)
        else:
            after = np.concatenate([even[:, 1:], even[:, :1] if periodic else even[:, -1:]], 1)
            odd += lift * (even + after)
    return even * _SCALE, odd / _SCALE


def _varints(numbers: np.ndarray) -> bytes:
    """Signed integers, zigzag, seven bits a byte, the lowest first."""
    left = ((numbers << 1) ^ (numbers >> 63)).ravel()
    columns, used = [], []
    more = np.ones(left.shape, bool)
    while more.any():
        columns.append(np.where(left > 127, left & 127 | 128, left & 127).astype(np.uint8))
        used.append(more)
        more, left = more & (left > 127), left >> 7
    return bytes(np.stack(columns, 1)[np.stack(used, 1)])
