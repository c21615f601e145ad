"""Interference in a thin transparent film on a surface.

Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying
Iridescence": the Airy summation, with terms antialiased over the spectrum by the color matching
functions, which are sums of Gaussians in the wave number. Films and the media below do not absorb
here, so phases are 0 or pi and enter as signs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from nacre.array import Array, Components, namespace

_GAUSSIANS = (
    ((5.4856e-13, 1.6810, 4.3278e9), (9.7470e-14, 2.2399, 4.5282e9)),
    ((4.4201e-13, 1.7953, 9.3046e9),),
    ((5.2481e-13, 2.2084, 6.6121e9),),
)
"""Height, place in 1/um and variance in 1/m^2 for x, y and z (section 4.2, supplemental code)."""

_NORM = 1.0685e-7  # of the color matching functions

_TO_CIE_RGB = (
    (2.3706743, -0.9000405, -0.4706338),
    (-0.5138850, 1.4253036, 0.0885814),
    (0.0052982, -0.0146949, 1.0093968),
)
"""From XYZ to the RGB of CIE 1931 with equal energy as white, as in the paper's code."""


def refracted(cosine: Array, index: Array) -> Array:
    """Cosine inside a medium whose index relative to the outside is at least 1."""
    xp = namespace(cosine)
    return xp.sqrt(xp.maximum(1.0 - (1.0 - cosine * cosine) / (index * index), 1e-12))


def amplitudes(outside: Array, inside: Array, index: Array) -> tuple[Array, Array]:
    """Fresnel's reflection coefficients at an interface, parallel and perpendicular.

    Both are positive at normal incidence if `index`, inside relative to outside, exceeds 1; the
    cosines are those of the ray outside and inside.
    """
    parallel = (index * outside - inside) / (index * outside + inside)
    perpendicular = (index * inside - outside) / (index * inside + outside)
    return parallel, perpendicular


def fringes(path: Array) -> tuple[Components, Components]:
    """Means of cos(phase) and cos(2 phase) over x, y and z (equation 10).

    They are the interference of light that crosses the film once more, or twice. The path is the
    difference between neighboring reflections in micrometers: twice the thickness times the
    refractive index times the cosine inside.
    """
    xp = namespace(path)
    phase = 2.0 * math.pi * path
    square = phase * phase
    once: list[Array] = []
    twice: list[Array] = []
    for gaussians in _GAUSSIANS:
        waves = []
        for height, place, variance in gaussians:
            scale = height * math.sqrt(2.0 * math.pi * variance) / _NORM
            cosine = xp.cos(place * phase)
            damping = xp.exp((-1e-12 * variance) * square)
            squared = damping * damping
            double = (2.0 * cosine * cosine - 1.0) * squared * squared
            waves.append((scale * cosine * damping, scale * double))
        once.append(sum(wave for wave, _ in waves))
        twice.append(sum(wave for _, wave in waves))
    return (once[0], once[1], once[2]), (twice[0], twice[1], twice[2])


def series(outer: Array, inner: Array, product: Array) -> tuple[Array, Array, Array]:
    """Weights of 1 and of both :func:`fringes` in a film's reflectance (equation 7, two orders).

    `outer` and `inner` are reflectances of its two sides in one polarization; `product` is the
    square root of their product, negative if the phase shifts by pi between neighboring
    reflections.
    """
    through = 1.0 - outer
    all_orders = through * through * inner / (1.0 - outer * inner)
    one = 2.0 * (all_orders - through) * product
    return outer + all_orders, one, one * product


def dielectric_series(
    outside: Array, inside: Array, film: Array, index: Array
) -> tuple[Array, Array, Array]:
    """:func:`series` for a film on a dielectric, unpolarized.

    `outside` and `inside` are cosines of the ray, `film` and `index` refractive indices of the film
    and the medium below, both at least 1.
    """
    relative = index / film
    xp = namespace(inside)
    sine = (1.0 - inside * inside) / (relative * relative)
    below = xp.sqrt(xp.maximum(1.0 - sine, 1e-12))
    outer, inner = amplitudes(outside, inside, film), amplitudes(inside, below, relative)
    p, s = (series(a * a, b * b, -1.0 * a * b) for a, b in zip(outer, inner, strict=True))
    return mean(p, s)


def mean(p: Sequence[Array], s: Sequence[Array]) -> tuple[Array, Array, Array]:
    """The series for unpolarized light, from those for both polarizations."""
    zero, one, two = (0.5 * (a + b) for a, b in zip(p, s, strict=True))
    return zero, one, two


def reflectance(
    weights: Sequence[tuple[Array, Array, Array]], found: tuple[Components, Components]
) -> Components:
    """Color of a film, in [0, 1], from a series for each of x, y and z, and fringes."""
    xp = namespace(*found[0])
    xyz = [
        zero + one * first + two * second
        for (zero, one, two), first, second in zip(weights, *found, strict=True)
    ]
    red, green, blue = (
        xp.minimum(xp.maximum(r[0] * xyz[0] + r[1] * xyz[1] + r[2] * xyz[2], 0.0), 1.0)
        for r in _TO_CIE_RGB
    )
    return red, green, blue
