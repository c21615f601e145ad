"""Spectra in bands to linear Rec. 709 RGB, or to channels that are bands."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.brdf import COLOR

_Array = npt.NDArray[np.float64]

_TO_LINEAR = (
    (3.2409699419045226, -1.537383177570094, -0.49861076029300344),
    (-0.9692436362808798, 1.8759675015077206, 0.04155505740717563),
    (0.05563007969699364, -0.20397695888897655, 1.0569715142428786),
)
"""CIE XYZ to linear Rec. 709 RGB (ITU-R BT.709). These are all digits with which colors of earlier
versions were computed; :func:`nacre.color.xyz_to_rgb` differs from them by a last bit."""


_VISIBLE = 380.0, 780.0  # wavelengths in nm
_BLUE, _RED = 490.0, 590.0  # a color needs a band up to the first, and one from the second on


def is_color(wavelengths: npt.ArrayLike) -> bool:
    """Whether bands, in nm, make a color: three visible ones, of which one is blue and one red."""
    bands = np.asarray(wavelengths, np.float64)
    seen = bands[(bands >= _VISIBLE[0]) & (bands <= _VISIBLE[1])]
    return len(seen) >= 3 and bool(seen.min() <= _BLUE and seen.max() >= _RED)


def as_channels(
    spectra: npt.ArrayLike, wavelengths: npt.ArrayLike
) -> tuple[_Array, tuple[str, str, str]]:
    """Three channels of spectra, shape (..., 3), and what they are (:attr:`nacre.Brdf.channels`).

    The color (:func:`to_rgb`) of bands that make one (:func:`is_color`); else bands as they are,
    the longest first: one of them three times, or the longest, a middle one and the shortest.
    Spectra, shape (..., bands), are at wavelengths in nm, shape (bands,), increasing.
    """
    if is_color(wavelengths):
        return to_rgb(spectra, wavelengths), COLOR
    values, bands = np.asarray(spectra, np.float64), np.asarray(wavelengths, np.float64)
    last = len(bands) - 1
    first, middle, third = chosen = last, (last + 1) // 2 if last > 1 else 0, 0
    names = (f"{bands[first]:.6g} nm", f"{bands[middle]:.6g} nm", f"{bands[third]:.6g} nm")
    return values[..., list(chosen)], names


def chosen_channels(
    spectra: npt.ArrayLike, wavelengths: npt.ArrayLike, wanted: Sequence[float] | str
) -> tuple[_Array, tuple[str, str, str]]:
    """As :func:`as_channels`, for wavelengths in nm that a user wants, or "color".

    Raises ValueError if no band is near one, if bands make no color, or not one to three are given.
    """
    values, bands = np.asarray(spectra, np.float64), np.asarray(wavelengths, np.float64)
    if isinstance(wanted, str):
        if wanted != "color":
            raise ValueError(f"{wanted!r} is neither 'color' nor wavelengths in nm")
        if not is_color(bands):
            span = f"{bands[0]:.6g} to {bands[-1]:.6g} nm"
            raise ValueError(f"bands from {span} make no color; name one to three wavelengths")
        return to_rgb(values, bands), COLOR
    if not 1 <= len(wanted) <= 3:
        raise ValueError(f"{len(wanted)} wavelengths, expected one to three")
    nearest = [int(np.abs(bands - wavelength).argmin()) for wavelength in wanted]
    for wavelength, place in zip(wanted, nearest, strict=True):
        if not abs(bands[place] - wavelength) <= 0.05 * wavelength:
            known = ", ".join(f"{band:.6g}" for band in bands[:40])
            raise ValueError(f"no band is near {wavelength:.6g} nm (known: {known})")
    ordered = sorted(set(nearest), reverse=True)
    first, last = ordered[0], ordered[-1]
    chosen = first, ordered[1] if len(ordered) == 3 else ordered[-1], last
    names = (f"{bands[chosen[0]]:.6g} nm", f"{bands[chosen[1]]:.6g} nm", f"{bands[last]:.6g} nm")
    return values[..., list(chosen)], names


def to_rgb(spectra: npt.ArrayLike, wavelengths: npt.ArrayLike) -> _Array:
    """Color of reflecting surfaces, relative to a perfect white.

    The CIE 1931 2-degree observer sees them under illuminant D65, whose color is the white of Rec.
    709: a flat spectrum of value f gives (f, f, f), to a thousandth. Spectra, shape (..., bands),
    have f_r in 1/sr or any reflectance per band; they are linear between bands, in nm, shape
    (bands,), increasing, and constant beyond the first and last. The color, shape (..., 3), has the
    unit of the spectra; a channel of a saturated color may be negative.
    """
    return np.asarray(np.asarray(spectra, np.float64) @ rgb_weights(wavelengths))


def narrowed(spectra: npt.ArrayLike, wavelengths: npt.ArrayLike, bandwidth: float) -> _Array:
    """Spectra as through the narrowest slits, from bands of a width in nm at half their height.

    Bands are triangles; spectra, shape (..., bands), are taken for smooth over one. With bands as
    far from each other as they are wide, this is the correction of Stearns and Stearns 1988, "An
    Example of a Method for Correcting Radiance Data for Bandpass Error", of ASTM E308.
    """
    values, bands = np.asarray(spectra, np.float64), np.asarray(wavelengths, np.float64)
    if len(bands) < 3:
        return values
    rise = np.diff(values, axis=-1) / np.diff(bands)
    none = np.zeros((*values.shape[:-1], 1))
    bend = np.diff(np.concatenate([none, rise, none], axis=-1), axis=-1)
    return np.asarray(values - bandwidth**2 / 12.0 * bend / np.gradient(bands))


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
    """Wavelengths (n,) every nm from 360 to 780, and RGB of a unit value at each, (n, 3).

    `cie.csv` has the color matching functions of the CIE 1931 2-degree observer (CIE 018:2019) and
    the power of D65, which CIE 015:2018 has every 5 nm and which is linear between.
    """
    table = Path(__file__).with_name("cie.csv")
    columns = np.loadtxt(table, delimiter=",", skiprows=1, encoding="utf-8").T
    nodes, observer, illuminant = columns[0], columns[1:4], columns[4]
    seen = np.stack([channel * illuminant for channel in observer], axis=1)
    return nodes, seen / seen[:, 1].sum() @ np.asarray(_TO_LINEAR).T
