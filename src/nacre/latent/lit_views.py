"""What views of an isotropic material see under lights that are not single directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.geometry import join, rotate, split, to_spherical, uniform_hemisphere
from nacre.sampling.moment import propose_lights

_VIEWS, _PER_VIEW, _LIGHTS = 16, 128, 4
_SHARPNESS = 3.0, 60.0
"""Of the lamps: from a third of the sky to a bulb near by."""
_SPREAD = 0.4
"""Of the lamps about the mirror direction."""


@dataclass(frozen=True)
class LitViews:
    """Views, each under some lights, and directions for the integrals over these.

    Parameters
    ----------
    wi, wo
        Directions to the light and to the viewer, shapes (v, n, 3), float32; `wo` is the same
        along n.
    weights
        Of f_r in the integrals: radiance times cos(theta_i) over the density of the directions,
        shape (v, lights, n).
    """

    wi: npt.NDArray[np.float32]
    wo: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]

    def radiance(self, f_r: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
        """What the views see, shape (..., v, lights, 3), for f_r of shape (..., v, n, 3)."""
        return np.asarray(self.weights @ f_r)


def lit_views(seed: int) -> LitViews:
    """Views as a picture of a sphere shows them, under an even sky and under lamps of many sizes.

    The sky has radiance 1, so that the albedo is seen. Lamps are von Mises-Fisher lobes of the
    irradiance that it has, half of them near the mirror direction.

    Parameters
    ----------
    seed
        The same seed gives the same lamps.
    """
    squared_sines = (np.arange(_VIEWS) + 0.5) / _VIEWS  # a sphere shows all of them alike
    wo, wi, density = propose_lights(squared_sines, _PER_VIEW, seed)
    azimuth = to_spherical(split(wo))[1]
    wo, wi = (join(rotate(split(w), -azimuth)) for w in (wo, wi))
    random = np.random.default_rng((seed, 6))
    above = join(uniform_hemisphere(*random.random((2, _VIEWS, _LIGHTS))))
    near = wo[:, :1] * (-1.0, -1.0, 1.0) + random.normal(0.0, _SPREAD, above.shape)
    near /= np.linalg.norm(near, axis=-1, keepdims=True)
    centres = np.where(np.arange(_LIGHTS)[:, None] % 2, above, near)
    low, high = np.log(_SHARPNESS)
    sharpness = np.exp(random.uniform(low, high, (_VIEWS, _LIGHTS, 1)))
    radiance = 0.5 * sharpness * np.exp(sharpness * (centres @ wi.swapaxes(1, 2) - 1.0))
    radiance[:, 0] = 1.0
    weights = radiance * (wi[..., 2] / density)[:, None] / _PER_VIEW
    return LitViews(*(array.astype(np.float32) for array in (wi, wo, weights)))
