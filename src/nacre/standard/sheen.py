"""Fibers that stand up from a surface: Charlie sheen.

Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF": a density that is a power of
the normals' sine, and a fit for their masking, both as in KHR_materials_sheen (section
"Implementation Notes").
"""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.standard.parameter_math import of_numbers

_MIN_ALPHA = 1e-4  # below, fibers are too close to the normal to be seen
_BOUNDS = (  # the five numbers of the masking's fit, at alpha = 1 and at 0
    *((21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801)),
    *((-1.97760, -1.27393), (-4.32054, -4.85967)),
)
_MIN_FITTED = 0.1
_ALBEDO = (  # rows: 1, the cosine, its square; columns: powers of roughness - 0.5
    (-0.3338, 0.002444, 2.021, -4.924, 5.34, -4.316),
    (-2.57, 4.143, -5.65, 25.51, -109.9, 129.5),
    (-0.3006, 1.754, -9.926, 14.18, 45.33, -86.69),
)


def charlie(h: Components, wi: Components, wo: Components, alpha: Array) -> Array:
    """f_r in 1/sr for fibers with roughness alpha in [0, 1]; `h` is the half vector."""
    xp = namespace(*h, *wi, *wo)
    alpha = of_numbers("maximum", alpha, _MIN_ALPHA)
    inverse = 1.0 / alpha
    sine2 = xp.maximum(h[0] * h[0] + h[1] * h[1], 1e-12)
    density = (2.0 + inverse) * xp.exp(0.5 * inverse * xp.log(sine2)) / (2.0 * math.pi)
    masking = 1.0 + _masking(wi[2], alpha) + _masking(wo[2], alpha)
    # Viewers clamp this to 1, because fibers would glow close to the horizon.
    seen = xp.minimum(1.0 / (4.0 * xp.maximum(wi[2] * wo[2], 1e-9) * masking), 1.0)
    return density * seen


def charlie_albedo(cosine: Array, roughness: Array) -> Array:
    """Fraction of the light from a direction that the fibers reflect, at most 1.

    `roughness` is the root of alpha. The albedo is the exponential of a polynomial fitted to
    quadratures of :func:`charlie`: within 0.018 of them for roughnesses from 0.1 (0.003 on
    average). Below 0.1, only views close to the horizon see fibers, and the curve shrinks toward
    it.
    """
    xp = namespace(cosine)
    fitted = of_numbers("maximum", roughness, _MIN_FITTED)
    narrow = fitted / of_numbers("maximum", roughness, math.sqrt(_MIN_ALPHA))
    scale = of_numbers("exp", 0.8 * of_numbers("log", narrow))
    x = xp.minimum(cosine * scale, 1.0)
    constant, slope, bend = (_polynomial(factors, fitted - 0.5) for factors in _ALBEDO)
    return xp.minimum(xp.exp(constant + x * (slope + x * bend)), 1.0)


def _polynomial(factors: tuple[float, ...], x: Array) -> Array:
    value: Array = factors[-1]
    for factor in factors[-2::-1]:
        value = factor + x * value
    return value


def _masking(cosine: Array, alpha: Array) -> Array:
    """Smith's Lambda for the fibers."""
    xp = namespace(cosine)
    weight = (1.0 - alpha) * (1.0 - alpha)
    a, b, c, d, e = (rough + (smooth - rough) * weight for rough, smooth in _BOUNDS)

    def logarithm(x: Array) -> Array:
        return a / (1.0 + b * namespace(x).exp(c * namespace(x).log(x))) + d * x + e

    middle = a / (1.0 + b * of_numbers("exp", math.log(0.5) * c)) + 0.5 * d + e
    near = logarithm(xp.maximum(xp.minimum(cosine, 1.0 - cosine), 1e-6))
    return xp.exp(xp.where(cosine < 0.5, near, 2.0 * middle - near))
