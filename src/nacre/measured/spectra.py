"""Measured spectra to linear Rec. 709 RGB."""

from __future__ import annotations

import functools
import warnings

import numpy as np
import numpy.typing as npt

from nacre.errors import require

_Array = npt.NDArray[np.float64]


def to_rgb(spectra: npt.ArrayLike, wavelengths: npt.ArrayLike) -> _Array:
    """Color of reflecting surfaces, relative to a perfect white.

    The CIE 1931 2-degree observer sees them under illuminant D65, whose color is the white of Rec.
    709: a flat spectrum of value f gives (f, f, f), to a thousandth. Spectra, shape (..., bands),
    have f_r in 1/sr or any reflectance per band; they are linear between bands, in nm, shape
    (bands,), increasing, and constant beyond the first and last. The color, shape (..., 3), has the
    unit of the spectra; a channel of a saturated color may be negative.
    """
    return np.asarray(np.asarray(spectra, np.float64) @ rgb_weights(wavelengths))


def rgb_weights(wavelengths: npt.ArrayLike) -> _Array:
    """The matrix of :func:`to_rgb`, (bands, 3); a ValueError says that bands do not increase."""
    bands = np.asarray(wavelengths, np.float64)
    if bands.ndim != 1 or not (np.diff(bands) > 0.0).all():
        raise ValueError("wavelengths must be one increasing list")
    nodes, response = _response()
    below = np.clip(np.searchsorted(bands, nodes, side="right") - 1, 0, len(bands) - 1)
    above = np.minimum(below + 1, len(bands) - 1)
    span = np.where(above > below, bands[above] - bands[below], 1.0)
    fraction = np.clip((nodes - bands[below]) / span, 0.0, 1.0)[:, None]
    weights = np.zeros((len(bands), 3))
    np.add.at(weights, below, (1.0 - fraction) * response)
    np.add.at(weights, above, fraction * response)
    return weights


@functools.cache
def _response() -> tuple[_Array, _Array]:
    """Wavelengths (n,) every nm from 360 to 780, and RGB of a unit value at each, (n, 3)."""
    with warnings.catch_warnings(), np.printoptions():  # it changes how NumPy prints, for all
        warnings.simplefilter("ignore")  # it misses plotting libraries that this does not need
        colour = require("colour", "spectral")
    nodes = np.arange(360.0, 781.0)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    illuminant = colour.SDS_ILLUMINANTS["D65"]
    seen = np.stack(
        [
            np.interp(nodes, observer.wavelengths, channel)
            * np.interp(nodes, illuminant.wavelengths, illuminant.values)
            for channel in observer.values.T
        ],
        axis=1,
    )
    to_linear = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB
    return nodes, seen / seen[:, 1].sum() @ np.asarray(to_linear).T
