"""Any reflectance as scattered samples, at directions that suit interpolation between them.

Directions are a grid in the Rusinkiewicz angles (Rusinkiewicz 1998, "A New Change of Variables for
Efficient BRDF Representation"), even in the coordinates of
:func:`nacre.measured.interpolation.coordinates`: dense near the mirror direction, and with fewer
azimuths where they matter less.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.geometry import from_rusinkiewicz_angles, join
from nacre.measured.scattered import ScatteredBrdf
from nacre.sampling import check_isotropic

_HALF, _DIFFERENCE, _AZIMUTHS = 60, 48, 20
"""Nodes of an isotropic grid in theta_h and theta_d; largest number of steps in phi_d to pi."""
_HALF_2, _DIFFERENCE_2, _AZIMUTHS_2 = 24, 18, 36
"""The same for an anisotropic one, over the full circle in phi_h and phi_d."""
_GRAZING = 1e-3  # smallest cosine of a direction


def tabulate(brdf: Brdf) -> ScatteredBrdf:
    """Samples of a reflectance at :func:`directions`, with its spectra where it has them.

    Left out are directions where `brdf` is not known or not finite.

    Raises
    ------
    ValueError
        If nothing is left.
    """
    check_isotropic(brdf)
    wi, wo = directions(brdf.isotropic)
    rgb = brdf.eval(wi, wo)
    known = np.isfinite(rgb).all(axis=1) & brdf.valid(wi, wo)
    spectra = None if brdf.wavelengths is None else brdf.eval_spectral(wi, wo)
    if spectra is not None:
        known &= np.isfinite(spectra).all(axis=1)
    return ScatteredBrdf(
        wi[known],
        wo[known],
        rgb[known],
        brdf.name,
        isotropic=brdf.isotropic,
        spectra=None if spectra is None else spectra[known],
        wavelengths=brdf.wavelengths,
    )


def directions(isotropic: bool) -> tuple[Floats, Floats]:
    """Pairs of directions above the horizon, shapes (n, 3) and (n, 3), float64.

    sqrt(theta_h) and theta_d run evenly from 0 to a right angle; azimuths are evenly spread over
    numbers of steps that fall with the sines of the angles they belong to, and there is one where
    it does not matter. An isotropic grid has phi_h = 0 and phi_d from 0 to pi.
    """
    half, difference = (_HALF, _DIFFERENCE) if isotropic else (_HALF_2, _DIFFERENCE_2)
    rows = []
    for theta_h in 0.5 * math.pi * np.linspace(0.0, 1.0, half) ** 2:
        for theta_d in np.linspace(0.0, 0.5 * math.pi, difference):
            steps = _AZIMUTHS * math.sin(theta_h) * math.sin(theta_d)
            if isotropic:
                phi_h, phi_d = np.zeros(1), np.linspace(0.0, math.pi, math.ceil(steps) + 1)
            else:
                phi_h = _circle(_AZIMUTHS_2 * math.sqrt(math.sin(theta_h)))
                phi_d = _circle(_AZIMUTHS_2 * math.sin(theta_d))
            rows.append(np.stack(np.meshgrid(theta_h, phi_h, theta_d, phi_d), -1).reshape(-1, 4))
    wi, wo = (join(w) for w in from_rusinkiewicz_angles(*np.concatenate(rows).T))
    visible = np.minimum(wi[:, 2], wo[:, 2]) > _GRAZING
    return wi[visible], wo[visible]


def _circle(count: float) -> npt.NDArray[np.float64]:
    """At least one azimuth, evenly from 0 to 2 pi without its end."""
    return np.linspace(0.0, 2.0 * math.pi, max(1, math.ceil(count)), endpoint=False)
