"""Surfaces of MaterialX that become glTF's material: its own, and UsdPreviewSurface.

MaterialX 1.39.5, libraries/bxdf/gltf_pbr.mtlx and usd_preview_surface.mtlx; "UsdPreviewSurface
Specification" 2.6. For the latter MaterialX has no translation. It has the workflows of glTF,
metallic and specular, and differs in how layers add up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from nacre.analytic.model import AnalyticBrdf
from nacre.standard.files.materialx.surface import (
    BLACK,
    WHITE,
    Surface,
    Turns,
    Values,
    as_color,
    no_light,
    opaque_color,
)
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import Input
from nacre.standard.gltf import AnisotropicGltf, Gltf

_GLTF: Mapping[str, Input] = {
    "base_color": WHITE,
    "metallic": 1.0,
    "roughness": 1.0,
    "transmission": 0.0,
    "specular": 1.0,
    "specular_color": WHITE,
    "ior": 1.5,
    "alpha": 1.0,
    "alpha_mode": 0.0,
    "alpha_cutoff": 0.5,
    "iridescence": 0.0,
    "iridescence_ior": 1.3,
    "iridescence_thickness": 100.0,
    "sheen_color": BLACK,
    "sheen_roughness": 0.0,
    "clearcoat": 0.0,
    "clearcoat_roughness": 0.0,
    "emissive": BLACK,
    "emissive_strength": 1.0,
    "anisotropy_strength": 0.0,
    "anisotropy_rotation": 0.0,
}


def _gltf(values: Values, turns: Turns, _: str | None, opaque: OpaquePart) -> AnalyticBrdf:
    if values["emissive_strength"]:
        no_light("emissive", values["emissive"], opaque)
    mode, alpha = values["alpha_mode"], values["alpha"]
    if (mode == 1.0 and alpha < values["alpha_cutoff"]) or (mode == 2.0 and alpha != 1.0):
        problem = f"alpha is {alpha:g}: transparency is not read"
        opaque.without(problem, "set alpha_mode to 0", f"Alpha is taken as 1 (it is {alpha:g}).")
    found = {
        "baseColorFactor": opaque_color("base_color", "metallic", "transmission", values, opaque),
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
    "emissiveColor": BLACK,
    "useSpecularWorkflow": 0.0,
    "specularColor": BLACK,
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
    no_light("emissiveColor", values["emissiveColor"], opaque)
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
            color = opaque_color("diffuseColor", "metallic", "transmission", given, opaque, called)
    index = values["ior"]
    normal = ((index - 1.0) / (index + 1.0)) ** 2 if index > 0.0 else 1.0
    if values["clearcoat"] and abs(normal - 0.04) > 1e-3:
        opaque.notes.append(f"Its coat has the index {_NORMAL_INDEX:g}, not {index:g}.")
    opaque.notes.append("UsdPreviewSurface, read as glTF's material of the same values.")
    tint = as_color([c / 0.04 for c in values["specularColor"]])
    return Gltf(
        baseColorFactor=color,
        metallicFactor=given["metallic"],
        roughnessFactor=values["roughness"],
        ior=_NORMAL_INDEX if by_color else index,
        specularFactor=1.0,
        specularColorFactor=tint if by_color else WHITE,
        iridescenceFactor=0.0,
        iridescenceIor=1.3,
        iridescenceThicknessMaximum=100.0,
        sheenColorFactor=BLACK,
        sheenRoughnessFactor=0.0,
        clearcoatFactor=values["clearcoat"],
        clearcoatRoughnessFactor=values["clearcoatRoughness"],
    )


GLTF = Surface(
    {"ND_gltf_pbr_surfaceshader": {}},
    _GLTF,
    frozenset(
        ("occlusion", "thickness", "attenuation_distance", "attenuation_color", "dispersion")
    ),
    ("normal", "clearcoat_normal"),
    ("tangent",),
    _gltf,
)
USD = Surface(
    {"ND_UsdPreviewSurface_surfaceshader": {}},
    _USD,
    frozenset(("occlusion",)),
    ("normal",),
    (),
    _usd,
)
