"""A mixture of closures whose colors and shapes depend on the view.

Some renderers run no code for a reflectance but take closures, with weights, roughness and normals
that a shader computes from the view: Open Shading Language, Blender's nodes, MaterialX. None of
these can hold a function of light and view at once, so this model only has functions of one number,
the facing ratio: the cosine between normal and view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.analytic.factor import FactoredBrdf
from nacre.analytic.model import TableParameter, Values
from nacre.array import Array, Components, namespace
from nacre.brdf import Brdf
from nacre.geometry import half_vector
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import Progress
from nacre.standard.bent_closures import (
    HORIZON,
    LOBES,
    NODES,
    ROWS,
    TABLES,
    bent_facets,
    bent_normal,
    view_frame,
)
from nacre.standard.closure_fit import fit_closures


class Closures(FactoredBrdf):
    """One diffuse closure and three GGX closures that are functions of the facing ratio N . V.

    Every parameter is a table: rows of numbers at the facing ratios :data:`NODES`, linear between.

    - `diffuse`: albedo of the diffuse closure, red, green and blue.
    - `bend0`: its normal is normalize(N + bend0 V), with V toward the viewer.
    - `color1`, `color2`, `color3`: reflectance of the microfacets of each GGX closure, red, green
      and blue; there is no other Fresnel term.
    - `roughness1` ... `roughness3`: two rows, along the plane of normal and view and across it.
      Their squares are alpha_x and alpha_y of GGX, with V as the tangent.
    - `bend1` ... `bend3`: the normals are normalize(N + bend V).

    A closure whose bent normal faces away from light or viewer is black. As in Cycles, GGX closures
    are single-scattering, with Smith's height-correlated G (:mod:`nacre.analytic.ggx`). The mixture
    is not reciprocal.
    """

    model = "closures"
    by_design: ClassVar = {
        "reciprocity": "its closures change with the view alone, so that a shader can compute them"
    }
    fitted_on = "pictures"
    parameters = ()
    tables: ClassVar[tuple[TableParameter, ...]] = TABLES

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
        """Fits on pictures of its own; samples and gain are not used."""
        return fit_closures(cls, brdf, seed, report)


def _interpolated(values: Values, facing: Array) -> Sequence[Array]:
    """All rows of all tables at a facing ratio."""
    xp = namespace(facing)
    nodes = np.asarray(NODES)
    spans = zip(NODES[:-1], np.diff(nodes).tolist(), strict=True)
    parts = [xp.minimum(xp.maximum((facing - a) / width, 0.0), 1.0) for a, width in spans]
    rows: npt.NDArray[np.float32] = np.concatenate([values[table.name].values for table in TABLES])
    return xp.dense(parts, np.diff(rows, axis=1).T.copy(), rows[:, 0].copy())
