"""Closures with bent normals: their f_r, and the tables of their parameters by facing ratio."""

from __future__ import annotations

from nacre.analytic.ggx import ggx_facets
from nacre.analytic.model import TableParameter
from nacre.array import Array, Components, namespace
from nacre.geometry import azimuth

NODES = tuple(k / 15 for k in (0, 1, 2, 3, 5, 7, 9, 12, 15))
"""Facing ratios at the nodes of every table, which is linear between them.

Cycles samples curves and color ramps at 256 points, which include these fifteenths, so that its
function is exactly the table's.
"""

LOBES = 3
"""GGX closures of the mixture."""

MIN_ROUGHNESS = 0.0317
"""Below the square of this, float32 half vectors do not resolve a GGX lobe."""

HORIZON = 1e-4
"""Light below this cosine counts as at it: f_r with a bent normal has no bound."""


def _tables() -> tuple[TableParameter, ...]:
    def table(name: str, rows: int, low: float, high: float) -> TableParameter:
        return TableParameter(name, rows, len(NODES), high, low)

    lobes = (
        (
            table(f"color{k}", 3, 0.0, 10.0),
            table(f"roughness{k}", 2, MIN_ROUGHNESS, 1.0),
            table(f"bend{k}", 1, -0.9, 5.0),
        )
        for k in range(1, LOBES + 1)
    )
    diffuse = table("diffuse", 3, 0.0, 10.0), table("bend0", 1, -0.9, 5.0)
    return sum(lobes, diffuse)


TABLES = _tables()
ROWS = tuple((table.name, row) for table in TABLES for row in range(table.rows))
"""Table and row of each of the closures' numbers, in order."""


def view_frame(wi: Components, wo: Components) -> tuple[Components, Components]:
    """Light and view in the frame where the view has azimuth 0."""
    cos_phi, sin_phi, sine = azimuth(wo)
    light = cos_phi * wi[0] + sin_phi * wi[1], cos_phi * wi[1] - sin_phi * wi[0], wi[2]
    return light, (sine, 0.0 * sine, wo[2])


def bent_normal(bend: Array, view: Components) -> tuple[Array, Array]:
    """Components x and z of normalize(N + bend V), for a view with azimuth 0."""
    x, z = bend * view[0], 1.0 + bend * view[2]
    scale = 1.0 / namespace(x, z).sqrt(x * x + z * z)
    return x * scale, z * scale


def bent_facets(
    bent: tuple[Array, Array],
    alpha: tuple[Array, Array],
    light: Components,
    view: Components,
    half: Components,
) -> Array:
    """f_r cos(theta_i), in 1/sr, for GGX microfacets around a bent normal that reflect everything.

    `bent` is components x and z of the normal; `view` has azimuth 0.
    """

    def local(w: Components) -> Components:
        return bent[1] * w[0] - bent[0] * w[2], w[1], bent[0] * w[0] + bent[1] * w[2]

    xp = namespace(*light)
    light, view = local(light), local(view)
    lit = xp.maximum(light[2], 0.0)
    above = light[0], light[1], xp.maximum(light[2], HORIZON)
    seen = view[0], view[1], xp.maximum(view[2], HORIZON)
    return xp.where(view[2] > 0.0, lit * ggx_facets(above, seen, local(half), alpha), 0.0)
