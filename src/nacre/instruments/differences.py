"""Color differences of two materials under illuminants, over many pairs of directions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.brdf import COLOR, Brdf
from nacre.color import xyz_to_lab
from nacre.geometry import join, uniform_rusinkiewicz
from nacre.instruments.colors import ciede2000
from nacre.instruments.illuminants import ILLUMINANTS, Illuminant, rgb_weights, spectral_weights

PAIRS = 10_000


def mean_differences(
    truth: Brdf,
    other: Brdf,
    wi: npt.ArrayLike | None = None,
    wo: npt.ArrayLike | None = None,
    *,
    seed: int = 0,
) -> Mapping[str, float]:
    """Mean CIEDE2000 difference under D65, A and F11, for the 2-degree observer.

    At each pair of directions the color of a surface with the reflectance factor pi f_r is taken,
    from spectra where a material has them, else from RGB (see
    :func:`nacre.instruments.illuminants.rgb_weights`).

    Parameters
    ----------
    truth, other
        The reference and what is judged; their channels or spectra make colors.
    wi, wo
        Directions to the light and to the viewer, shapes (n, 3); by default :data:`PAIRS` uniform
        in the Rusinkiewicz angles, of which those above the horizon and known to `truth` count.
    seed
        Of these.

    Raises ValueError if a material has bands in place of a color, or no pair counts.
    """
    if wi is None or wo is None:
        u = np.random.default_rng(seed).random((4, PAIRS))
        wi, wo = map(join, uniform_rusinkiewicz(u))
    wi, wo = np.asarray(wi, np.float64), np.asarray(wo, np.float64)
    known = truth.valid(wi, wo)
    if not known.any() or not truth.channels == other.channels == COLOR:
        raise ValueError("no pair of directions is known, or bands make no color")
    wi, wo = wi[known], wo[known]
    labs = [_labs(brdf, wi, wo) for brdf in (truth, other)]
    return {name: float(ciede2000(*(lab[name] for lab in labs)).mean()) for name in ILLUMINANTS}


def spectral_differences(truth: Brdf, other: Brdf, *, seed: int = 0) -> Mapping[str, float]:
    """:func:`mean_differences` from a reference with spectra, where both have colors; else none."""
    if truth.wavelengths is None or not truth.channels == other.channels == COLOR:
        return {}
    return mean_differences(truth, other, seed=seed)


def _labs(brdf: Brdf, wi: Doubles, wo: Doubles) -> dict[Illuminant, Doubles]:
    """CIELAB of pi f_r under every illuminant, (n, 3)."""
    bands = brdf.wavelengths
    values = math.pi * (brdf.eval(wi, wo) if bands is None else brdf.eval_spectral(wi, wo))
    found: dict[Illuminant, Doubles] = {}
    for name in ILLUMINANTS:
        weights = rgb_weights(name, 2) if bands is None else spectral_weights(bands, name, 2)
        found[name] = xyz_to_lab(values @ weights, weights.sum(axis=0))
    return found
