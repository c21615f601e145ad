"""A mixture of closures whose colors and shapes depend on the view.

Renderers that take no code for a reflectance take closures, and let a shader give them weights,
roughness and normals that depend on where it is seen from: Open Shading Language, the nodes of
Blender, MaterialX. What no such renderer can hold is a function of light and view at once, so all
that this model has is functions of one number, the facing ratio: the cosine between normal and
view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.analytic.factor import FactoredBrdf
from nacre.analytic.ggx import ggx_facets
from nacre.analytic.model import TableParameter, Values
from nacre.array import Array, Components, namespace
from nacre.brdf import Brdf
from nacre.geometry import azimuth, half_vector
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import Progress

NODES = tuple(k / 15 for k in (0, 1, 2, 3, 5, 7, 9, 12, 15))
"""Facing ratios of the numbers of every table, which are linear between them.

Fifteenths are among the 256 points at which Cycles holds curves and color ramps: there a table is
the same function, not a rounded one.
"""

LOBES = 3
"""GGX closures of the mixture."""

MIN_ROUGHNESS = 0.0317
"""Its square is the GGX roughness below which float32 half vectors do not resolve a lobe."""

HORIZON = 1e-4
"""Cosine below which light counts as coming from there: f_r of a bent normal has no bound."""


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


class Closures(FactoredBrdf):
    """One diffuse closure and three GGX closures, functions of the facing ratio N . V.

    Every parameter is a table: rows of numbers at the facing ratios :data:`NODES`, linear between.

    - `diffuse`: albedo of the diffuse closure, red, green and blue.
    - `bend0`: its normal is normalize(N + bend0 V), with V toward the viewer.
    - `color1`, `color2`, `color3`: what the microfacets of each GGX closure reflect, red, green and
      blue; there is no other Fresnel term.
    - `roughness1` ... `roughness3`: two rows, along the plane of normal and view and across it.
      Squares of them are alpha_x and alpha_y of GGX, with V as the tangent.
    - `bend1` ... `bend3`: the normals are normalize(N + bend V).

    A closure whose bent normal faces away from light or viewer is black. GGX closures are
    single-scattering, with Smith's G of correlated heights (:mod:`nacre.analytic.ggx`), as Cycles
    has them. The mixture is not reciprocal.
    """

    model = "closures"
    fitted_on = "pictures"
    parameters = ()
    tables: ClassVar[tuple[TableParameter, ...]] = _tables()

    @staticmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        at = dict(zip(ROWS, _interpolated(values, wo[2]), strict=True))
        light, view = view_frame(wi, wo)
        half = half_vector(light, view)
        horizon = xp.maximum(wi[2], HORIZON)

        bent = bent_normal(at["bend0", 0], view)
        seen = xp.maximum(bent[0] * light[0] + bent[1] * light[2], 0.0) / horizon
        total = [at["diffuse", c] * seen / math.pi for c in range(3)]
        for k in range(1, LOBES + 1):
            bent = bent_normal(at[f"bend{k}", 0], view)
            alpha = at[f"roughness{k}", 0] ** 2, at[f"roughness{k}", 1] ** 2
            facets = bent_facets(bent, alpha, light, view, half) / horizon
            total = [t + at[f"color{k}", c] * facets for c, t in enumerate(total)]
        return total[0], total[1], total[2]

    @classmethod
    def extract(
        cls, brdf: Brdf, samples: DirectionSamples, gain: float, seed: int, report: Progress
    ) -> tuple[dict[str, Any], dict[str, float]]:
        """See :mod:`nacre.standard.closure_fit`; samples and gain are not used."""
        from nacre.standard.closure_fit import fit_closures

        return fit_closures(brdf, seed, report)


ROWS = tuple((table.name, row) for table in Closures.tables for row in range(table.rows))
"""Table and row of each number that the closures take, in order."""


def view_frame(wi: Components, wo: Components) -> tuple[Components, Components]:
    """Light and view in the frame in which the view has azimuth 0."""
    cos_phi, sin_phi, sine = azimuth(wo)
    light = cos_phi * wi[0] + sin_phi * wi[1], cos_phi * wi[1] - sin_phi * wi[0], wi[2]
    return light, (sine, 0.0 * sine, wo[2])


def bent_normal(bend: Array, view: Components) -> tuple[Array, Array]:
    """Components x and z of normalize(N + bend V), for a view of azimuth 0."""
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
    """f_r cos(theta_i), in 1/sr, of GGX microfacets about a bent normal that reflect all.

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


def _interpolated(values: Values, facing: Array) -> Sequence[Array]:
    """All rows of all tables at a facing ratio."""
    xp = namespace(facing)
    nodes = np.asarray(NODES)
    spans = zip(NODES[:-1], np.diff(nodes).tolist(), strict=True)
    parts = [xp.minimum(xp.maximum((facing - a) / width, 0.0), 1.0) for a, width in spans]
    rows: npt.NDArray[np.float32] = np.concatenate(
        [values[table.name].values for table in Closures.tables]
    )
    return xp.dense(parts, np.diff(rows, axis=1).T.copy(), rows[:, 0].copy())
