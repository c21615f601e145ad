"""The reflectance of a surface point: diffuse under an anisotropic GGX lobe.

With Fresnel reflectances F after Schlick (1994), normal n, half vector h,

    f = albedo / pi (1 - F(n.l)) (1 - F(n.v)) + D(h) G1(l) G1(v) F(h.v) / (4 n.l n.v),

D and G1 of Trowbridge-Reitz with Smith's separable shadowing (Walter et al. 2007; Heitz 2014). F
rises from the specular colour to :func:`grazing_edge` at grazing angles, so that a specular colour
of zero is a purely diffuse surface.
"""

from __future__ import annotations

import math
from typing import Any

import numba

inner = numba.njit(error_model="numpy", forceinline=True, fastmath=True)


@inner  # type: ignore[untyped-decorator]
def fifth(x: Any) -> Any:
    """x^5."""
    square = x * x
    return square * square * x


@inner  # type: ignore[untyped-decorator]
def smith(t: Any, b: Any, n: Any, along: Any, across: Any) -> Any:
    """The root in G1(w) = 2 n.w / (n.w + root), for w in the frame of the surface."""
    return math.sqrt((along * t) * (along * t) + (across * b) * (across * b) + n * n)


@inner  # type: ignore[untyped-decorator]
def grazing_edge(red: Any, green: Any, blue: Any) -> Any:
    """Fresnel reflectance at 90 degrees (Lagarde and de Rousiers 2014, section 3.1.1)."""
    return min(1.0, 50.0 * max(red, green, blue))


@inner  # type: ignore[untyped-decorator]
def lobe(
    lt: Any, lb: Any, ln: Any, vt: Any, vb: Any, vn: Any, view_root: Any, cosine: Any,
    along: Any, across: Any,
) -> Any:  # fmt: skip
    """pi D G1 G1 / (4 n.l n.v) and D pi / 2 / (n.v + root), the lobe and its density, and h.v.

    Parameters
    ----------
    lt, lb, ln, vt, vb, vn
        Light and viewer in the frame of the surface.
    view_root
        :func:`smith` of the viewer.
    cosine
        Of the angle between light and viewer.
    along, across
        Roughness alpha.
    """
    ht, hb, hn = (lt + vt) / along, (lb + vb) / across, ln + vn
    square = 2.0 * (1.0 + cosine) + 1e-12
    q = (ht * ht + hb * hb + hn * hn) / square
    density = 1.0 / (along * across * q * q * (vn + view_root))
    return density / (ln + smith(lt, lb, ln, along, across)), 0.5 * density, 0.5 * math.sqrt(square)


@inner  # type: ignore[untyped-decorator]
def sample_half_vector(
    vt: Any, vb: Any, vn: Any, along: Any, across: Any, u: Any, phi: Any
) -> Any:
    """A half vector of the distribution of visible normals (Heitz 2018, listing 1)."""
    t, b, n = along * vt, across * vb, vn
    length = 1.0 / math.sqrt(t * t + b * b + n * n)
    t, b, n = t * length, b * length, n * length
    flat = t * t + b * b
    if flat > 1e-12:
        scale = 1.0 / math.sqrt(flat)
        xt, xb = -b * scale, t * scale
    else:
        xt, xb = 1.0, 0.0
    yt, yb, yn = -n * xb, n * xt, t * xb - b * xt
    radius = math.sqrt(u)
    p1, p2 = radius * math.cos(phi), radius * math.sin(phi)
    share = 0.5 * (1.0 + n)
    p2 = (1.0 - share) * math.sqrt(max(0.0, 1.0 - p1 * p1)) + share * p2
    p3 = math.sqrt(max(0.0, 1.0 - p1 * p1 - p2 * p2))
    ht = along * (p1 * xt + p2 * yt + p3 * t)
    hb = across * (p1 * xb + p2 * yb + p3 * b)
    hn = max(1e-6, p2 * yn + p3 * n)
    length = 1.0 / math.sqrt(ht * ht + hb * hb + hn * hn)
    return ht * length, hb * length, hn * length
