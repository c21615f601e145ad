"""The reflectance of a surface point: diffuse under an anisotropic GGX lobe.

With Fresnel reflectances F after Schlick (1994), normal n, half vector h,

    f = albedo / pi (1 - F(n.l)) (1 - F(n.v)) + D(h) G1(l) G1(v) F(h.v) / (4 n.l n.v),

D and G1 of Trowbridge-Reitz with Smith's separable shadowing (Walter et al. 2007; Heitz 2014). F
rises from the specular color to :func:`grazing_edge` at grazing angles, so that a specular color
of zero is a purely diffuse surface. Directions are in the frame of the surface: t along strands, b
across, n the normal. Reflectances and densities here are pi times their usual values.
"""

from __future__ import annotations

import math
from typing import Any

from nacre.compile.numba_code import inner_fast


@inner_fast  # type: ignore[untyped-decorator]
def fifth(x: Any) -> Any:
    square = x * x
    return square * square * x


@inner_fast  # type: ignore[untyped-decorator]
def grazing_edge(red: Any, green: Any, blue: Any) -> Any:
    """Fresnel reflectance at 90 degrees (Lagarde and de Rousiers 2014, section 3.1.1)."""
    return min(1.0, 50.0 * max(red, green, blue))


@inner_fast  # type: ignore[untyped-decorator]
def smith(t: Any, b: Any, n: Any, along: Any, across: Any) -> Any:
    """The root in G1(w) = 2 n.w / (n.w + root)."""
    return math.sqrt((along * t) * (along * t) + (across * b) * (across * b) + n * n)


@inner_fast  # type: ignore[untyped-decorator]
def lobe(
    lt: Any, lb: Any, ln: Any, vt: Any, vb: Any, vn: Any, root: Any, cosine: Any,
    along: Any, across: Any,
) -> Any:  # fmt: skip
    """The GGX lobe without its Fresnel factor, the density of its light directions, and h.v.

    Takes light and viewer in the frame of the surface, :func:`smith` of the viewer, the cosine
    between both, and roughness alpha.
    """
    ht, hb, hn = (lt + vt) / along, (lb + vb) / across, ln + vn
    square = 2.0 * (1.0 + cosine) + 1e-12
    q = (ht * ht + hb * hb + hn * hn) / square
    visible = 1.0 / (along * across * q * q * (vn + root))
    return visible / (ln + smith(lt, lb, ln, along, across)), 0.5 * visible, 0.5 * math.sqrt(square)


@inner_fast  # type: ignore[untyped-decorator]
def channel(
    albedo: Any, specular: Any, edge: Any, shine: Any, half: Any, light: Any, view: Any
) -> Any:
    """One color channel of the reflectance.

    Takes the diffuse albedo, the Fresnel reflectances at 0 and 90 degrees, the lobe without its
    Fresnel factor, and (1 - c)^5 of the cosines h.v, n.l and n.v.
    """
    rise = edge - specular
    through = (1.0 - specular - rise * light) * (1.0 - specular - rise * view)
    return albedo * through + shine * (specular + rise * half)


@inner_fast  # type: ignore[untyped-decorator]
def sample_light(
    vt: Any, vb: Any, vn: Any, along: Any, across: Any, chance: Any, choice: Any, u: Any, v: Any
) -> Any:
    """A direction from the lobe, with probability `chance`, or else by the cosine.

    Half vectors of the lobe have the distribution of visible normals (Heitz 2018, "Sampling the GGX
    Distribution of Visible Normals"). `choice`, `u` and `v` are random numbers in [0, 1).
    """
    radius, phi = math.sqrt(u), 2.0 * math.pi * v
    p1, p2 = radius * math.cos(phi), radius * math.sin(phi)
    if choice >= chance:
        return p1, p2, math.sqrt(1.0 - u)
    scale = 1.0 / smith(vt, vb, vn, along, across)
    t, b, n = along * vt * scale, across * vb * scale, vn * scale
    flat = math.sqrt(t * t + b * b)
    xt, xb = (-b / flat, t / flat) if flat > 1e-6 else (1.0, 0.0)
    fraction = 0.5 * (1.0 + n)
    p2 = (1.0 - fraction) * math.sqrt(1.0 - p1 * p1) + fraction * p2
    p3 = math.sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2))
    ht = along * (p1 * xt - p2 * n * xb + p3 * t)
    hb = across * (p1 * xb + p2 * n * xt + p3 * b)
    hn = max(1e-6, p2 * (t * xb - b * xt) + p3 * n)
    twice = 2.0 * (ht * vt + hb * vb + hn * vn) / (ht * ht + hb * hb + hn * hn)
    return twice * ht - vt, twice * hb - vb, twice * hn - vn
