"""MaterialX's `disney_principled` as :mod:`nacre.standard.disney`.

MaterialX 1.39.5, libraries/bxdf/disney_principled.mtlx: its inputs are those of Burley 2012 and
2015. The model is Disney's; MaterialX's graph departs from it, above all in a specular lobe that
hardly rises toward grazing angles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError
from nacre.standard.disney import AnisotropicDisney, Disney
from nacre.standard.files.materialx.surface import Surface, Turns, Values, opaque_color
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import Input

_DISNEY: Mapping[str, Input] = {
    "baseColor": (0.16, 0.16, 0.16),
    "metallic": 0.0,
    "roughness": 0.5,
    "anisotropic": 0.0,
    "specular": 0.5,
    "specularTint": 0.0,
    "sheen": 0.0,
    "sheenTint": 0.5,
    "clearcoat": 0.0,
    "clearcoatGloss": 1.0,
    "specTrans": 0.0,
    "subsurface": 0.0,
}


def _disney(values: Values, turns: Turns, _: str | None, opaque: OpaquePart) -> AnalyticBrdf:
    metal = values["metallic"]
    if metal != 1.0:
        how = "read as diffuse reflection"
        opaque.share("subsurface", values["subsurface"], "subsurface scattering", how)
    color = opaque_color("baseColor", "metallic", "specTrans", values, opaque)
    sheen = values["sheen"] * (1.0 - values["specTrans"])
    if not 0.0 <= (specular := values["specular"]) <= 1.0:
        raise FormatError(f"specular must lie in [0, 1], got {specular:g}")
    root = math.sqrt(0.08 * specular)
    opaque.notes.append("disney_principled, read as Disney's BRDF in Mitsuba's principled.")
    anisotropic = values["anisotropic"]
    model = AnisotropicDisney if anisotropic else Disney
    return model(
        base_color=color,
        metallic=metal,
        roughness=values["roughness"],
        eta=(1.0 + root) / (1.0 - root),
        spec_tint=values["specularTint"],
        flatness=0.0,
        sheen=sheen,
        sheen_tint=values["sheenTint"],
        clearcoat=values["clearcoat"],
        clearcoat_gloss=values["clearcoatGloss"],
        **({"anisotropic": anisotropic} if anisotropic else {}),
    )


DISNEY = Surface(
    {"ND_disney_principled": {}},
    _DISNEY,
    frozenset(("ior", "subsurfaceDistance")),
    (),
    (),
    _disney,
)
