"""Illuminants and observers of the CIE, and what they make of a material's channels."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.color import primaries, rgb_to_xyz

Illuminant: TypeAlias = Literal["D65", "A", "F11", "C"]
Observer: TypeAlias = Literal[2, 10]

ILLUMINANTS: tuple[Illuminant, ...] = ("D65", "A", "F11")
"""Illuminants that shops compare colors under; F11 is the narrow-band lamp FL11 of CIE 15. Scales
of gloss take C."""
OBSERVERS: tuple[Observer, ...] = (2, 10)
"""Degrees of the field of view: the CIE 1931 and the CIE 1964 standard observer."""


@functools.cache
def _table() -> dict[str, Doubles]:
    """Columns of `cie.csv`: color matching functions (CIE 018:2019) and relative powers (CIE
    15:2018), every 5 nm from 380 to 780 nm.
    """
    path = Path(__file__).with_name("cie.csv")
    names = path.read_text("utf-8").partition("\n")[0].split(",")
    columns = np.loadtxt(path, delimiter=",", skiprows=1, encoding="utf-8").T
    return dict(zip(names, columns, strict=True))


def nodes() -> Doubles:
    """Wavelengths in nm that spectra are taken at, (81,)."""
    return _table()["nm"]


def xyz_per_node(illuminant: Illuminant, observer: Observer) -> Doubles:
    """XYZ of a reflectance of 1 at one of :func:`nodes` and 0 elsewhere, (81, 3).

    Their sum is the color of the perfect white, whose Y is 100 (CIE 15:2018, section 7). Raises
    ValueError if the illuminant or the observer is unknown.
    """
    if illuminant not in (*ILLUMINANTS, "C"):
        raise ValueError(f"illuminant must be one of {', '.join(ILLUMINANTS)}, got {illuminant!r}")
    if observer not in OBSERVERS:
        raise ValueError(f"observer must be 2 or 10 degrees, got {observer!r}")
    table = _table()
    power = table[illuminant]
    seen = np.stack([power * table[f"{axis}{observer}"] for axis in "xyz"], axis=1)
    return np.asarray(100.0 / seen[:, 1].sum() * seen)


def spectral_weights(
    wavelengths: npt.ArrayLike, illuminant: Illuminant, observer: Observer
) -> Doubles:
    """XYZ of a reflectance factor of 1 in each band of a spectrum, (bands, 3).

    Spectra are linear between bands, in nm, increasing, and constant beyond the first and last.
    """
    bands = np.asarray(wavelengths, np.float64)
    shares = np.stack([np.interp(nodes(), bands, unit) for unit in np.eye(len(bands))], axis=1)
    return np.asarray(shares.T @ xyz_per_node(illuminant, observer))


def rgb_weights(illuminant: Illuminant, observer: Observer) -> Doubles:
    """XYZ of linear Rec. 709 red, green and blue, (3, 3), one a row.

    Exact for D65 and the 2-degree observer, whose color is what RGB holds. Else each is taken as
    the smooth spectrum of :mod:`nacre.color` (Mallett and Yuksel 2019), one of the many of that
    color: a gray stays gray, and saturated colors are estimates.
    """
    if (illuminant, observer) == ("D65", 2):
        return 100.0 * rgb_to_xyz(np.eye(3))
    return np.stack(primaries(nodes())) @ xyz_per_node(illuminant, observer)
