"""How the three channels that are factored become linear RGB, and back.

The formulas and constants are those of the `undecorrelate` function in btflib, the reader by the
University of Bonn (github.com/cgbonn/btflib).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt


class ColorModel(IntEnum):
    """Number that a file gives for its color model; 2, 5 to 8 are not read."""

    RGB = 0
    YUV = 1
    PCA = 3
    YCOCG = 4
    YLOG_UV = 9
    YLOG_ULOG_VLOG = 10
    YLOG_UDIVY_VDIVY = 11
    LOG_RGB = 12


EPSILON = 1e-5  # added before a logarithm is taken

LARGEST_LOGARITHM = 20.0
"""Logarithms are taken to be at most this, so that no value overflows; e^20 is 5e8."""

_YUV = np.array([[1.0, 0.0, 1.13983], [1.0, -0.39465, -0.5806], [1.0, 2.03211, 0.0]])
_YCOCG = np.array([[1.0, 1.0, -1.0], [1.0, 0.0, 1.0], [1.0, -1.0, -1.0]])
_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Decorrelation:
    """A color model; for :attr:`ColorModel.PCA` a color is `channels @ matrix + mean`."""

    model: ColorModel
    mean: npt.ArrayLike = (0.0, 0.0, 0.0)
    matrix: npt.ArrayLike = _IDENTITY

    def to_rgb(self, channels: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Linear RGB, finite where channels are: (3, ...), contiguous, which may be overwritten."""
        model = self.model
        if model is ColorModel.LOG_RGB:
            _exp(channels)
        if model in _LOGARITHMIC:
            luma, chroma = channels[0], channels[1:]
            _exp(luma)
            if model is ColorModel.YLOG_ULOG_VLOG:
                size = np.abs(chroma)
                size += np.float32(np.log(EPSILON))
                np.clip(size, -LARGEST_LOGARITHM, LARGEST_LOGARITHM, out=size)
                np.multiply(np.sign(chroma), np.exp(size, out=size), out=chroma)
            elif model is ColorModel.YLOG_UDIVY_VDIVY:
                chroma *= luma + np.float32(EPSILON)
        if model is ColorModel.PCA:
            rgb = _mixed(np.transpose(self.matrix), channels)
            rgb += np.asarray(self.mean, np.float32).reshape(3, *[1] * (channels.ndim - 1))
            return rgb
        matrix = _MATRICES.get(model)
        return channels if matrix is None else _mixed(matrix, channels)

    def from_rgb(self, rgb: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        """Channels of linear RGB, (3, ...), contiguous: the inverse of :meth:`to_rgb` from 0 up."""
        model = self.model
        if model is ColorModel.RGB:
            return rgb
        if model is ColorModel.LOG_RGB:
            return np.log(np.maximum(rgb, 0.0) + np.float32(EPSILON))
        if model is ColorModel.PCA:
            mean = np.asarray(self.mean, np.float32).reshape(3, *[1] * (rgb.ndim - 1))
            return _mixed(np.linalg.inv(np.transpose(self.matrix)), rgb - mean)
        channels = _mixed(np.linalg.inv(_MATRICES[model]), rgb)
        if model not in _LOGARITHMIC:
            return channels
        luma, chroma = channels[0], channels[1:]
        np.maximum(luma, 0.0, out=luma)
        luma += np.float32(EPSILON)
        if model is ColorModel.YLOG_ULOG_VLOG:
            size = np.log(np.maximum(np.abs(chroma), EPSILON) / np.float32(EPSILON))
            np.multiply(np.sign(chroma), size, out=chroma)
        elif model is ColorModel.YLOG_UDIVY_VDIVY:
            chroma /= luma
        np.log(luma, out=luma)
        return channels


_LOGARITHMIC = ColorModel.YLOG_UV, ColorModel.YLOG_ULOG_VLOG, ColorModel.YLOG_UDIVY_VDIVY
_MATRICES = dict.fromkeys((ColorModel.YUV, *_LOGARITHMIC), _YUV) | {ColorModel.YCOCG: _YCOCG}


def _exp(channels: npt.NDArray[np.float32]) -> None:
    np.clip(channels, -LARGEST_LOGARITHM, LARGEST_LOGARITHM, out=channels)
    np.exp(channels, out=channels)
    channels -= np.float32(EPSILON)


def _mixed(matrix: npt.NDArray[Any], channels: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Each channel as a sum of weighted channels; a matrix product, so it is fast."""
    flat = channels.reshape(3, -1)
    return (np.asarray(matrix, np.float32) @ flat).reshape(channels.shape)
