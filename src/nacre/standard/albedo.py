"""Directional albedo of GGX microfacets, and the light that they scatter more than once."""

from __future__ import annotations

from nacre.array import Array, namespace


def ggx_albedo(cosine: Array, alpha: Array) -> tuple[Array, Array]:
    """Albedos A and B of GGX under Schlick's reflectance: F0 A + F90 B, both in [0, 1].

    The rational fit of MaterialX (libraries/pbrlib/genglsl/lib/mx_microfacet_specular.glsl,
    `mx_ggx_dir_albedo_analytic`).

    Parameters
    ----------
    cosine
        Of the direction with the normal.
    alpha
        Roughness.
    """
    xp = namespace(cosine, alpha)
    x, y = cosine, alpha
    xx, yy, xy = x * x, y * y, x * y
    terms = (x, y, xy, xx, yy, xx * y, x * yy, xx * yy)
    tops_and_bottoms = [
        constant + sum(factor * term for factor, term in zip(factors, terms, strict=True))
        for constant, factors in _FIT
    ]
    top_a, top_b, bottom_a, bottom_b = tops_and_bottoms
    a, b = (
        xp.minimum(xp.maximum(top / bottom, 0.0), 1.0)
        for top, bottom in ((top_a, bottom_a), (top_b, bottom_b))
    )
    return a, b


_FIT = (
    (0.1003, (-0.6303, 9.748, -2.038, 29.34, -8.245, -26.44, 19.99, -5.448)),
    (0.9345, (-2.323, 2.229, -3.748, 1.424, -0.7684, 1.436, 0.2913, 0.6286)),
    (1.0, (-1.765, 8.263, 11.53, 28.96, -7.507, -36.11, 15.86, 33.37)),
    (1.0, (0.2281, 15.94, -55.83, 13.08, 41.26, 54.9, 300.2, -285.1)),
)
"""Numerators of A and B, then denominators: the constant, and factors of x, y, xy, x^2, y^2, x^2 y,
x y^2 and x^2 y^2."""


def scattered_again(albedo: Array) -> Array:
    """What scattering more than once adds to a lobe, over its Fresnel reflectance and the lobe.

    Turquin 2019, "Practical multiple scattering compensation for microfacet models", equations 14
    and 16: the lobe is to be multiplied by 1 + F times this.

    Parameters
    ----------
    albedo
        That of the lobe where it reflects all.
    """
    return (1.0 - albedo) / albedo
