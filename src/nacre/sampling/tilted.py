"""A diffuse lobe and visible GGX normals about a tilted mean normal, and the best of some of them.

The lobe of a texel leans to where the slope of its mesostructure turns it. Parameters may be arrays
of any library, one value per texel or ray.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Sampler
from nacre.geometry import azimuth, cosine_hemisphere, half_vector, reflect, split
from nacre.sampling.mixture import in_frame
from nacre.sampling.visible_normals import sample_visible, visible_density

PARAMETERS = 4  # of a mixture: fraction, roughness, and the two coordinates of the slope

_FRACTIONS = (0.2, 0.4, 0.6, 0.8)
_ROUGHNESS = (0.15, 0.22, 0.32, 0.5, 0.8)
_SLOPES = (0.2, 0.45)
_AZIMUTHS = 8
_BLOCK = 1 << 10
_DARK = 1e-12  # added to squared products with the cosine: a black texel has a mixture too


@dataclass(frozen=True)
class TiltedMixture(Sampler):
    """Density fraction * (visible normals, mirrored) + (1 - fraction) * cos(theta_i) / pi.

    What falls below the horizon has density 0: the density integrates to at most one. The fraction
    lies in [0, 1); GGX normals have the same roughness in all directions, and the slope is x / z
    and y / z of the mean normal.
    """

    fraction: Array
    roughness: Array
    slope: tuple[Array, Array]

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; u[0] selects the lobe."""
        xp = namespace(*wo, *u)
        cos, sin, shift = self._axis()
        view = in_frame(wo, cos, sin)
        alpha = self.roughness, self.roughness
        mirrored = reflect(view, sample_visible(view, u[1], u[2], alpha, shift))
        mirrored = in_frame(mirrored, cos, -1.0 * sin)
        diffuse = cosine_hemisphere(u[1], u[2])
        chosen = u[0] < self.fraction
        x, y, z = (xp.where(chosen, m, d) for m, d in zip(mirrored, diffuse, strict=True))
        return (x, y, z), self.pdf_components((x, y, z), wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        xp = namespace(*wi, *wo)
        cos, sin, shift = self._axis()
        alpha = self.roughness, self.roughness
        h, view = in_frame(half_vector(wi, wo), cos, sin), in_frame(wo, cos, sin)
        mirrored = visible_density(h, view, alpha, shift)
        mixture = self.fraction * mirrored + (1.0 - self.fraction) / math.pi * wi[2]
        visible = (wi[2] > 0.0) & (wo[2] > 0.0)
        return xp.where(visible, mixture, 0.0 * mixture)

    def _axis(self) -> tuple[Array, Array, Array]:
        """Cosine and sine of the azimuth of the slope, and its size in roughnesses."""
        cos, sin, size = azimuth((*self.slope, 0.0))
        return cos, sin, size / self.roughness


def fit_tilted(values: Floats, wi: Floats, wo: Floats, areas: Floats) -> Floats:
    """The mixture, among some hundreds, whose sample weights vary least, for each texel: shape (t,
    4).

    Values are proportional to f_r, one per texel and pair of unit directions, shape (t, n);
    directions (n, 3) are one view after the other, each with the same number of lights, which stand
    for solid angles `areas` (n,). All views count alike, however bright they are.
    """
    views = len(np.unique(wo, axis=0))
    mixtures = _mixtures()
    densities = np.empty((len(wi), len(mixtures)), np.float32)
    light, view = split(wi), split(wo)
    for column, (fraction, roughness, *slope) in enumerate(mixtures.tolist()):
        mixture = TiltedMixture(fraction, roughness, (slope[0], slope[1]))
        densities[:, column] = mixture.pdf_components(light, view)
    inverse = areas[:, None] / densities
    found = np.empty((len(values), PARAMETERS), np.float32)
    for start in range(0, len(values), _BLOCK):
        part = values[start : start + _BLOCK] * light[2]
        flux = (part * areas).reshape(len(part), views, -1).sum(2)
        squares = np.square(part).reshape(len(part), views, -1) + _DARK
        squares /= np.square(flux)[:, :, None] + _DARK
        moments = squares.reshape(len(part), -1) @ inverse
        found[start : start + _BLOCK] = mixtures[moments.argmin(1)]
    return found


@cache
def _mixtures() -> Floats:
    slopes = [(0.0, 0.0)]
    for size in _SLOPES:
        angles = np.arange(_AZIMUTHS) * (2.0 * math.pi / _AZIMUTHS)
        slopes += [(size * math.cos(a), size * math.sin(a)) for a in angles.tolist()]
    rows = [(s, r, *slope) for s in _FRACTIONS for r in _ROUGHNESS for slope in slopes]
    return np.array([(0.0, 1.0, 0.0, 0.0), *rows], np.float32)
