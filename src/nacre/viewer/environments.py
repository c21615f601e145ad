"""Environments for a page: small maps with one exponent for three colors."""

from __future__ import annotations

import numpy as np

from nacre.array import Image

MAP_SIZE = 192, 96
"""Pixels of a page's environment, width first."""


def smaller(pixels: Image) -> Image:
    """A map (h, w, 3) in linear RGB at the page's size, by means over the cells of its texels.

    Rows have equal weights.
    """
    width, height = MAP_SIZE
    rows = np.linspace(0.0, len(pixels) - 1.0, height)
    columns = (np.arange(width) + 0.5) * pixels.shape[1] / width - 0.5
    factor = max(1, round(len(pixels) / height))
    offsets = (np.arange(factor) + 0.5) / factor - 0.5
    total = np.zeros((height, width, 3))
    for dy in offsets:
        for dx in offsets:
            y = np.clip(np.round(rows + dy * len(pixels) / height), 0, len(pixels) - 1).astype(int)
            x = np.round(columns + dx * pixels.shape[1] / width).astype(int) % pixels.shape[1]
            total += pixels[y[:, None], x]
    return np.asarray(total / factor**2, np.float32)


def shared_exponents(pixels: Image) -> bytes:
    """Linear RGB as bytes with one exponent for three colors (Ward 1991), plane by plane."""
    largest = np.maximum(pixels.max(axis=2), 1e-30)
    exponent = np.clip(np.ceil(np.log2(largest * (256.0 / 255.5))), -128, 127)
    scaled = np.clip(np.round(pixels * 2.0 ** (8.0 - exponent)[..., None]), 0, 255)
    planes = [*np.moveaxis(scaled, 2, 0), exponent + 128.0]
    return b"".join(plane.astype(np.uint8).tobytes() for plane in planes)
