"""How much of a texture a pixel sees at a hit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from nacre.errors import require
from nacre.render.textures.placement import Placement

_LOWEST = 0.02
"""Cosine of the view from which on footprints grow no longer."""


@dataclass(frozen=True)
class Footprint:
    """The parallelogram about a point of a texture that a pixel sees, as its two sides.

    Parameters
    ----------
    long
        The longer side in texture coordinates, `mi.Point2f`.
    texels
        Lengths of both in texels, the longer one first.
    """

    long: Any
    texels: tuple[Any, Any]


def footprint(
    mi: Any, si: Any, placement: Placement, angle: float, height: int, width: int
) -> Footprint:
    """The footprint of a cone of rays (Akenine-Moller et al. 2021, "Improved Shader and Texture
    Level of Detail Using Ray Cones").

    A cone begins anew at each hit of a path: behind the first, footprints are smaller than they
    might be, which costs speed of convergence at most.

    Parameters
    ----------
    mi
        The `mitsuba` module with a JIT variant set.
    si
        Interactions.
    placement
        Of the texture on the surface.
    angle
        Between neighboring pixels, in radians.
    height, width
        Of the texture in texels.
    """
    dr = require("drjit", "render")
    view, normal = si.to_world(si.wi), si.sh_frame.n
    cosine = dr.dot(view, normal)
    along = view - normal * cosine
    upright = dr.squared_norm(along) < 1e-8
    along = dr.normalize(dr.select(upright, si.sh_frame.s, along))
    across = dr.cross(normal, along)
    spread = angle * si.t
    sides = []
    for side in (along * (spread / dr.maximum(dr.abs(cosine), _LOWEST)), across * spread):
        u, v = (
            dr.dot(side, axis) / dr.maximum(dr.squared_norm(axis), 1e-20)
            for axis in (si.dp_du, si.dp_dv)
        )
        uv = placement.difference(u, v)
        sides.append((uv, dr.norm(mi.Point2f(uv.x * width, uv.y * height))))
    (one, first), (other, second) = sides
    longer = first > second
    return Footprint(
        dr.select(longer, one, other), (dr.maximum(first, second), dr.minimum(first, second))
    )
