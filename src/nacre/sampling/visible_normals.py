"""GGX normals as a direction sees them; mirrored about one, the direction becomes the light.

A sheared and stretched hemisphere is a distribution of normals: with roughnesses a_x and a_y and a
shift s, the point m of the unit hemisphere stands for the normal (a_x (m_x + s m_z), a_y m_y, m_z).
Without a shift this is the distribution of Trowbridge and Reitz 1975, which Walter et al. 2007
named GGX; a shift moves its mean slope along x by s roughnesses. What a direction sees of it is
what the same map, transposed, makes of that direction sees of the hemisphere: a cap of the sphere
(Heitz 2018, "Sampling the GGX Distribution of Visible Normals"; Dupuy and Benyoub 2023, "Sampling
Visible GGX Normals with Spherical Caps").
"""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.geometry import dot, normalize

MIN_ROUGHNESS = 1e-3  # below it float32 half vectors do not resolve the lobe

_MIN_SQUARES = 0.01  # below those of any unit vector; h is 0 for opposite directions at the horizon
_MIN_AREA = 1e-12  # keeps directions below the horizon, which callers discard, from dividing by 0


def distribution(h: Components, alpha: tuple[Array, Array], shift: Array = 0.0) -> Array:
    """D in 1/sr, where D cos theta_h integrates to 1 over the hemisphere."""
    # The sum of squares keeps its precision where 1 - cos^2 has none left.
    x, y = h[0] / alpha[0] - shift * h[2], h[1] / alpha[1]
    squares = namespace(*h).maximum(x * x + y * y + h[2] * h[2], _MIN_SQUARES)
    return 1.0 / (math.pi * alpha[0] * alpha[1] * squares * squares)


def stretched(w: Components, alpha: tuple[Array, Array], shift: Array = 0.0) -> Components:
    """`w` in the space in which the microfacets are a hemisphere, not of unit length."""
    x = alpha[0] * w[0]
    return x, alpha[1] * w[1], w[2] + shift * x


def stretched_length(w: Components, alpha: tuple[Array, Array]) -> Array:
    """Length of `w` in the space in which the microfacets are a hemisphere."""
    seen = stretched(w, alpha)
    return namespace(*w).sqrt(dot(seen, seen))


def visible_density(
    h: Components, wo: Components, alpha: tuple[Array, Array], shift: Array = 0.0
) -> Array:
    """Density in 1/sr of `wo` mirrored about normals that it sees, where their half vector is h.

    With D the distribution, D (wo.h) / sigma is the density of visible normals and a mirrored
    direction has 1 / (4 wo.h) of it; the projected area sigma is that of a hemisphere, half the
    stretched direction's length plus its cosine.
    """
    seen = stretched(wo, alpha, shift)
    xp = namespace(*seen)
    area = 0.5 * xp.maximum(seen[2] + xp.sqrt(dot(seen, seen)), _MIN_AREA)
    return distribution(h, alpha, shift) / (4.0 * area)


def sample_visible(
    wo: Components, u: Array, v: Array, alpha: tuple[Array, Array], shift: Array = 0.0
) -> Components:
    """A unit normal that `wo` sees, from two numbers in [0, 1)."""
    xp = namespace(*wo, u, v)
    seen = normalize(stretched(wo, alpha, shift))
    # A cap of the unit sphere about the direction: its points are half-way from that to normals.
    z = (1.0 - u) * (1.0 + seen[2]) - seen[2]
    radius = xp.sqrt(xp.maximum(1.0 - z * z, 0.0))
    phi = 2.0 * math.pi * v
    x, y, z = radius * xp.cos(phi) + seen[0], radius * xp.sin(phi) + seen[1], z + seen[2]
    return normalize((alpha[0] * (x + shift * z), alpha[1] * y, z))
