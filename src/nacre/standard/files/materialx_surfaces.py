"""Surfaces of MaterialX as the models that nacre has.

MaterialX 1.39.5, libraries/bxdf: `open_pbr_surface` is :mod:`nacre.standard.openpbr`, `gltf_pbr` is
:mod:`nacre.standard.gltf`, and `disney_principled` is :mod:`nacre.standard.disney`, which differs
from MaterialX's graph where that departs from Disney. `standard_surface` becomes OpenPBR by the
rules of translation/standard_surface_to_open_pbr.mtlx, and UsdPreviewSurface, for which there are
none, becomes glTF's material, which has the same workflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError
from nacre.standard.disney import AnisotropicDisney, Disney
from nacre.standard.files import openpbr_inputs
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import NODE, NODE_DEFINITION, TANGENTS, Color, Input
from nacre.standard.gltf import AnisotropicGltf, Gltf

_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)

Values: TypeAlias = Mapping[str, Any]
"""Inputs by name, those that a file does not give with their defaults."""

Turns: TypeAlias = Mapping[str, float]
"""Angles in radians that a file turns tangents by, from +x toward +y."""


@dataclass(frozen=True)
class Surface:
    """A kind of surface, and how it is read."""

    definitions: Mapping[str, Mapping[str, Input]]
    """Defaults that differ from :attr:`defaults`, by the names of the `nodedef`."""
    defaults: Mapping[str, Input]
    ignored: frozenset[str]
    """Inputs that change nothing about an opaque surface in light without shadows."""
    normals: tuple[str, ...]
    tangents: tuple[str, ...]
    read: Callable[[Values, Turns, str | None, OpaquePart], AnalyticBrdf]
    """The material of inputs, tangents and :func:`nacre.standard.files.facts.facts_of`.

    Raises FormatError if a value is out of bounds.
    """


def _open_pbr(
    values: Values, turns: Turns, facts: str | None, opaque: OpaquePart
) -> AnalyticBrdf:
    names = ("specular_roughness_anisotropy", "coat_roughness_anisotropy")
    stretched = [(turns.get(t), values[a]) for t, a in zip(TANGENTS, names, strict=True)]
    return openpbr_inputs.read(values, _one_angle(*stretched), facts, opaque)


def _one_angle(
    base: tuple[float | None, float], coat: tuple[float | None, float]
) -> float | None:
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
    "specular_color": _WHITE,
    "specular_roughness": 0.2,
    "specular_IOR": 1.5,
    "specular_anisotropy": 0.0,
    "specular_rotation": 0.0,
    "transmission": 0.0,
    "subsurface": 0.0,
    "subsurface_color": _WHITE,
    "subsurface_anisotropy": 0.0,
    "sheen": 0.0,
    "sheen_color": _WHITE,
    "sheen_roughness": 0.3,
    "coat": 0.0,
    "coat_color": _WHITE,
    "coat_roughness": 0.1,
    "coat_anisotropy": 0.0,
    "coat_rotation": 0.0,
    "coat_IOR": 1.5,
    "coat_affect_color": 0.0,
    "coat_affect_roughness": 0.0,
    "thin_film_thickness": 0.0,
    "thin_film_IOR": 1.5,
    "emission": 0.0,
    "opacity": _WHITE,
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
    inputs["base_color"] = _color([c * (1.0 + coat * (through - 1.0)) for c, through in color])
    inputs["coat_weight"] = 0.0 if coat * metal > 0.0 else coat
    inputs["specular_weight"] = 1.0 if metal > 0.0 else values["specular"]
    inputs["specular_color"] = _WHITE if sum(tint) == 0.0 else tint
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


_GLTF: Mapping[str, Input] = {
    "base_color": _WHITE,
    "metallic": 1.0,
    "roughness": 1.0,
    "transmission": 0.0,
    "specular": 1.0,
    "specular_color": _WHITE,
    "ior": 1.5,
    "alpha": 1.0,
    "alpha_mode": 0.0,
    "alpha_cutoff": 0.5,
    "iridescence": 0.0,
    "iridescence_ior": 1.3,
    "iridescence_thickness": 100.0,
    "sheen_color": _BLACK,
    "sheen_roughness": 0.0,
    "clearcoat": 0.0,
    "clearcoat_roughness": 0.0,
    "emissive": _BLACK,
    "emissive_strength": 1.0,
    "anisotropy_strength": 0.0,
    "anisotropy_rotation": 0.0,
}


def _gltf(values: Values, turns: Turns, _: str | None, opaque: OpaquePart) -> AnalyticBrdf:
    if values["emissive_strength"]:
        _no_light("emissive", values["emissive"], opaque)
    mode, alpha = values["alpha_mode"], values["alpha"]
    if (mode == 1.0 and alpha < values["alpha_cutoff"]) or (mode == 2.0 and alpha != 1.0):
        problem = f"alpha is {alpha:g}: transparency is not read"
        opaque.without(problem, "set alpha_mode to 0", f"Alpha is taken as 1 (it is {alpha:g}).")
    found = {
        "baseColorFactor": _opaque_color("base_color", "metallic", "transmission", values, opaque),
        "metallicFactor": values["metallic"],
        "roughnessFactor": values["roughness"],
        "ior": values["ior"],
        "specularFactor": values["specular"],
        "specularColorFactor": values["specular_color"],
        "iridescenceFactor": values["iridescence"],
        "iridescenceIor": values["iridescence_ior"],
        "iridescenceThicknessMaximum": values["iridescence_thickness"],
        "sheenColorFactor": values["sheen_color"],
        "sheenRoughnessFactor": values["sheen_roughness"],
        "clearcoatFactor": values["clearcoat"],
        "clearcoatRoughnessFactor": values["clearcoat_roughness"],
    }
    strength = values["anisotropy_strength"]
    if not strength:
        return Gltf(**found)
    angle = values["anisotropy_rotation"] + turns.get("tangent", 0.0)
    rotation = math.remainder(angle, math.pi)
    return AnisotropicGltf(**found, anisotropyStrength=strength, anisotropyRotation=rotation)


_USD: Mapping[str, Input] = {
    "diffuseColor": (0.18, 0.18, 0.18),
    "emissiveColor": _BLACK,
    "useSpecularWorkflow": 0.0,
    "specularColor": _BLACK,
    "metallic": 0.0,
    "roughness": 0.5,
    "clearcoat": 0.0,
    "clearcoatRoughness": 0.01,
    "opacity": 1.0,
    "opacityMode": 0.0,
    "opacityThreshold": 0.0,
    "ior": 1.5,
    "displacement": 0.0,
}
_NORMAL_INDEX = 1.5  # whose reflectance is 0.04


def _usd(values: Values, turns: Turns, _: str | None, opaque: OpaquePart) -> AnalyticBrdf:
    _no_light("emissiveColor", values["emissiveColor"], opaque)
    if values["displacement"]:
        problem = "displacement is not 0: only a flat surface is read"
        opaque.without(problem, "set it to 0", "Displacement is left out.")
    by_color = values["useSpecularWorkflow"] != 0.0
    given = dict(values) | ({"metallic": 0.0} if by_color else {})
    color = values["diffuseColor"]
    threshold, opacity = values["opacityThreshold"], values["opacity"]
    if opacity < threshold or (threshold <= 0.0 and opacity != 1.0):
        if threshold > 0.0 or values["opacityMode"] == 1.0:
            problem = f"opacity is {opacity:g}: a surface that is cut out is not read"
            taken = f"Opacity is taken as 1 (it is {opacity:g})."
            opaque.without(problem, "set it to 1", taken)
        else:
            given["transmission"] = 1.0 - opacity
            called = "1 - opacity"
            color = _opaque_color("diffuseColor", "metallic", "transmission", given, opaque, called)
    index = values["ior"]
    normal = ((index - 1.0) / (index + 1.0)) ** 2 if index > 0.0 else 1.0
    if values["clearcoat"] and abs(normal - 0.04) > 1e-3:
        opaque.notes.append(f"Its coat has the index {_NORMAL_INDEX:g}, not {index:g}.")
    opaque.notes.append("UsdPreviewSurface, read as glTF's material of the same values.")
    tint = _color([c / 0.04 for c in values["specularColor"]])
    return Gltf(
        baseColorFactor=color,
        metallicFactor=given["metallic"],
        roughnessFactor=values["roughness"],
        ior=_NORMAL_INDEX if by_color else index,
        specularFactor=1.0,
        specularColorFactor=tint if by_color else _WHITE,
        iridescenceFactor=0.0,
        iridescenceIor=1.3,
        iridescenceThicknessMaximum=100.0,
        sheenColorFactor=_BLACK,
        sheenRoughnessFactor=0.0,
        clearcoatFactor=values["clearcoat"],
        clearcoatRoughnessFactor=values["clearcoatRoughness"],
    )


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
    color = _opaque_color("baseColor", "metallic", "specTrans", values, opaque)
    sheen = values["sheen"] * (1.0 - values["specTrans"])
    root = math.sqrt(0.08 * min(max(values["specular"], 0.0), 1.0))
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


def _opaque_color(
    color: str,
    metallic: str,
    through: str,
    values: Values,
    opaque: OpaquePart,
    called: str | None = None,
) -> Color:
    """The color of a base whose diffuse part is as much smaller as it transmits light."""
    found, metal = _color(values[color]), values[metallic]
    if metal == 1.0:
        return found
    kept = opaque.share(called or through, values[through], "transmission", "left out")
    if kept == 1.0:
        return found
    if metal:
        raise FormatError(f"{metallic} is {metal:g}: no part of a metal transmits; set it to 0 or 1")
    return _color([kept * c for c in found])


def _no_light(name: str, color: Color, opaque: OpaquePart) -> None:
    if any(color):
        opaque.without(f"{name}: emission is not read", "set it to 0", "Emission is left out.")


def _color(values: Any) -> Color:
    red, green, blue = values
    return red, green, blue


SURFACES: Mapping[str, Surface] = {
    NODE: Surface(
        {NODE_DEFINITION: {}},
        {**openpbr_inputs.DEFAULTS, **openpbr_inputs.OTHERS},
        frozenset(openpbr_inputs.WITHOUT_EFFECT),
        ("geometry_normal", "geometry_coat_normal"),
        TANGENTS,
        _open_pbr,
    ),
    "standard_surface": Surface(
        {
            "ND_standard_surface_surfaceshader": {},
            "ND_standard_surface_surfaceshader_100": {"base": 0.8, "base_color": _WHITE},
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
    ),
    "gltf_pbr": Surface(
        {"ND_gltf_pbr_surfaceshader": {}},
        _GLTF,
        frozenset(
            ("occlusion", "thickness", "attenuation_distance", "attenuation_color", "dispersion")
        ),
        ("normal", "clearcoat_normal"),
        ("tangent",),
        _gltf,
    ),
    "UsdPreviewSurface": Surface(
        {"ND_UsdPreviewSurface_surfaceshader": {}},
        _USD,
        frozenset(("occlusion",)),
        ("normal",),
        (),
        _usd,
    ),
    "disney_principled": Surface(
        {"ND_disney_principled": {}},
        _DISNEY,
        frozenset(("ior", "subsurfaceDistance")),
        (),
        (),
        _disney,
    ),
}
"""Surfaces that are read, by the categories of their nodes."""
