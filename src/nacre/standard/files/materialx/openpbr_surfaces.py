"""Surfaces of MaterialX that become OpenPBR: its own and Autodesk's Standard Surface.

MaterialX 1.39.5, libraries/bxdf: open_pbr_surface.mtlx, which :mod:`nacre.standard.openpbr`
follows, and translation/standard_surface_to_open_pbr.mtlx. Rotations of tangents, which the
translation drops, are kept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError
from nacre.standard.files import openpbr_inputs
from nacre.standard.files.materialx.surface import WHITE, Surface, Turns, Values, as_color
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import NODE_DEFINITION, TANGENTS, Input


def _open_pbr(values: Values, turns: Turns, facts: str | None, opaque: OpaquePart) -> AnalyticBrdf:
    names = ("specular_roughness_anisotropy", "coat_roughness_anisotropy")
    stretched = [(turns.get(t), values[a]) for t, a in zip(TANGENTS, names, strict=True)]
    return openpbr_inputs.read(values, _one_angle(*stretched), facts, opaque)


def _one_angle(base: tuple[float | None, float], coat: tuple[float | None, float]) -> float | None:
    """The angle of both tangents, or of the one that matters; None if no tangent is turned.

    Takes the angles, None for those that are not given, and the anisotropies.
    """
    given = [angle for angle, _ in (base, coat) if angle is not None]
    mattering = {angle or 0.0 for angle, anisotropy in (base, coat) if anisotropy}
    if len(mattering) > 1 or (not mattering and len(set(given)) > 1):
        raise FormatError("the tangents of base and coat are not the same; make them equal")
    if not given:
        return None
    return mattering.pop() if mattering else given[0]


_STANDARD: Mapping[str, Input] = {
    "base": 1.0,
    "base_color": (0.8, 0.8, 0.8),
    "diffuse_roughness": 0.0,
    "metalness": 0.0,
    "specular": 1.0,
    "specular_color": WHITE,
    "specular_roughness": 0.2,
    "specular_IOR": 1.5,
    "specular_anisotropy": 0.0,
    "specular_rotation": 0.0,
    "transmission": 0.0,
    "subsurface": 0.0,
    "subsurface_color": WHITE,
    "subsurface_anisotropy": 0.0,
    "sheen": 0.0,
    "sheen_color": WHITE,
    "sheen_roughness": 0.3,
    "coat": 0.0,
    "coat_color": WHITE,
    "coat_roughness": 0.1,
    "coat_anisotropy": 0.0,
    "coat_rotation": 0.0,
    "coat_IOR": 1.5,
    "coat_affect_color": 0.0,
    "coat_affect_roughness": 0.0,
    "thin_film_thickness": 0.0,
    "thin_film_IOR": 1.5,
    "emission": 0.0,
    "opacity": WHITE,
    "thin_walled": 0.0,
}

_TO_OPEN_PBR = {
    "base_weight": "base",
    "base_diffuse_roughness": "diffuse_roughness",
    "base_metalness": "metalness",
    "specular_roughness": "specular_roughness",
    "specular_ior": "specular_IOR",
    "specular_roughness_anisotropy": "specular_anisotropy",
    "transmission_weight": "transmission",
    "subsurface_weight": "subsurface",
    "subsurface_color": "subsurface_color",
    "subsurface_scatter_anisotropy": "subsurface_anisotropy",
    "fuzz_weight": "sheen",
    "fuzz_color": "sheen_color",
    "coat_color": "coat_color",
    "coat_roughness": "coat_roughness",
    "coat_roughness_anisotropy": "coat_anisotropy",
    "coat_ior": "coat_IOR",
    "coat_darkening": "coat_affect_roughness",
    "thin_film_ior": "thin_film_IOR",
    "emission_luminance": "emission",
    "geometry_thin_walled": "thin_walled",
}
"""Inputs of `standard_surface` that become one of OpenPBR as they are."""


def _standard_surface(
    values: Values, turns: Turns, facts: str | None, opaque: OpaquePart
) -> AnalyticBrdf:
    inputs = {ours: values[theirs] for ours, theirs in _TO_OPEN_PBR.items()}
    coat, metal, tint = values["coat"], values["metalness"], values["specular_color"]
    # Color of a coat over a metal is a way to color metals, so the coat becomes color.
    color = zip(values["base_color"], values["coat_color"], strict=True)
    inputs["base_color"] = as_color([c * (1.0 + coat * (through - 1.0)) for c, through in color])
    inputs["coat_weight"] = 0.0 if coat * metal > 0.0 else coat
    inputs["specular_weight"] = 1.0 if metal > 0.0 else values["specular"]
    inputs["specular_color"] = WHITE if sum(tint) == 0.0 else tint
    inputs["fuzz_roughness"] = max(values["sheen_roughness"], 0.0) ** 0.4
    inputs["thin_film_thickness"] = 1e-3 * values["thin_film_thickness"]
    inputs["thin_film_weight"] = 1.0 if values["thin_film_thickness"] > 0.0 else 0.0
    inputs["geometry_opacity"] = values["opacity"][0]
    turn = turns.get("tangent")
    stretched = []
    for lobe in ("specular", "coat"):
        anisotropy = values[f"{lobe}_anisotropy"] if inputs[f"{lobe}_weight"] else 0.0
        rotation = -2.0 * math.pi * values[f"{lobe}_rotation"] if anisotropy else 0.0
        turned = turn is not None or rotation
        stretched.append(((turn or 0.0) + rotation if turned else None, anisotropy))
    angle = _one_angle(*stretched) if any(anisotropy for _, anisotropy in stretched) else None
    called = {**_TO_OPEN_PBR, "geometry_opacity": "opacity"}
    opaque.notes.append("Translated from standard_surface to OpenPBR, as MaterialX does it.")
    if coat and (unused := values["coat_affect_color"]):
        opaque.notes.append(f"OpenPBR has no coat_affect_color; it is left out (it is {unused:g}).")
    return openpbr_inputs.read(inputs, angle, facts, opaque, called)


OPEN_PBR = Surface(
    {NODE_DEFINITION: {}},
    {**openpbr_inputs.DEFAULTS, **openpbr_inputs.OTHERS},
    frozenset(openpbr_inputs.WITHOUT_EFFECT),
    ("geometry_normal", "geometry_coat_normal"),
    TANGENTS,
    _open_pbr,
)

STANDARD_SURFACE = Surface(
    {
        "ND_standard_surface_surfaceshader": {},
        "ND_standard_surface_surfaceshader_100": {"base": 0.8, "base_color": WHITE},
    },
    _STANDARD,
    frozenset(
        (
            *("transmission_color", "transmission_depth", "transmission_scatter"),
            *("transmission_scatter_anisotropy", "transmission_dispersion"),
            *("transmission_extra_roughness", "subsurface_radius", "subsurface_scale"),
            "emission_color",
        )
    ),
    ("normal", "coat_normal"),
    ("tangent",),
    _standard_surface,
)
