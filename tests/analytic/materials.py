"""One material of every analytic model."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.analytic import MODELS, AnalyticBrdf
from nacre.analytic.factor import even_angles, half_angles

DIFFUSE = {"diffuse": (0.05, 0.1, 0.3)}
BLUE = {**DIFFUSE, "specular": (0.05, 0.04, 0.03)}
SHINY = {**DIFFUSE, "specular": (0.3, 0.25, 0.2)}
ABC = {**DIFFUSE, "specular": (5.0, 3.0, 2.0), "b": 500.0, "c": 1.3, "index": 1.6}


def grey(**values: float) -> dict[str, tuple[float, float, float]]:
    """The same number for every channel."""
    return {name: (value, value, value) for name, value in values.items()}


def factors(roughness: float) -> dict[str, np.ndarray]:
    """Tables of GGX facets of a conductor, and masking without correlation."""
    h, d = half_angles(), even_angles()
    slopes = (np.sin(h) / roughness) ** 2 + np.cos(h) ** 2
    distribution = 1.0 / (np.pi * roughness**2 * slopes**2)
    fresnel = [0.5 + 0.5 * (1.0 - np.cos(d)) ** 5] * 3
    area = 0.5 * (np.cos(d) + np.hypot(np.cos(d), roughness * np.sin(d)))
    return {"distribution": distribution, "fresnel": fresnel, "area": area}


TABLES = factors(0.3)
GLTF = {
    "baseColorFactor": (0.3, 0.15, 0.05),
    "metallicFactor": 0.3,
    "roughnessFactor": 0.45,
    "ior": 1.6,
    "specularFactor": 0.8,
    "specularColorFactor": (1.0, 0.9, 0.7),
    "iridescenceFactor": 0.4,
    "iridescenceIor": 1.3,
    "iridescenceThicknessMaximum": 350.0,
    "sheenColorFactor": (0.1, 0.2, 0.3),
    "sheenRoughnessFactor": 0.6,
    "clearcoatFactor": 0.5,
    "clearcoatRoughnessFactor": 0.3,
}
OPENPBR = {
    "base_weight": 0.9,
    "base_color": (0.6, 0.3, 0.1),
    "base_diffuse_roughness": 0.4,
    "base_metalness": 0.4,
    "specular_weight": 0.8,
    "specular_color": (0.9, 0.8, 0.7),
    "specular_roughness": 0.5,
    "specular_ior": 1.7,
    "coat_weight": 0.6,
    "coat_color": (0.9, 0.7, 0.6),
    "coat_roughness": 0.4,
    "coat_ior": 1.5,
    "coat_darkening": 0.8,
    "fuzz_weight": 0.3,
    "fuzz_color": (0.7, 0.8, 0.9),
    "fuzz_roughness": 0.6,
    "thin_film_weight": 0.4,
    "thin_film_thickness": 0.35,
    "thin_film_ior": 1.35,
}
PRINCIPLED = {
    "base_color": (0.3, 0.15, 0.05),
    "metallic": 0.3,
    "roughness": 0.45,
    "ior": 1.6,
    "specular_ior_level": 0.45,
    "specular_tint": (0.9, 0.8, 0.6),
    "diffuse_roughness": 0.3,
    "coat_weight": 0.6,
    "coat_roughness": 0.25,
    "coat_ior": 1.4,
    "coat_tint": (0.9, 0.8, 0.95),
    "sheen_weight": 0.35,
    "sheen_roughness": 0.55,
    "sheen_tint": (0.5, 0.6, 0.9),
}
DISNEY = {
    "base_color": (0.3, 0.15, 0.05),
    "metallic": 0.3,
    "roughness": 0.45,
    "eta": 1.6,
    "spec_tint": 0.4,
    "flatness": 0.3,
    "sheen": 0.5,
    "sheen_tint": 0.6,
    "clearcoat": 0.7,
    "clearcoat_gloss": 0.2,
}
FILM = {"thin_film_thickness": 420.0, "thin_film_ior": 1.45}
TURNED = {"anisotropic": 0.7, "anisotropic_rotation": 0.2}

FACING = np.array([0, 1, 2, 3, 5, 7, 9, 12, 15]) / 15.0
"""Where the tables of `closures` have their nodes."""


def closures() -> dict[str, Any]:
    """Three lobes that narrow and redden toward grazing views, bent this way and that."""
    grazing = (1.0 - FACING) ** 2
    values: dict[str, Any] = {
        "diffuse": np.outer((0.05, 0.1, 0.3), 0.5 + 0.5 * FACING),
        "bend0": [0.3 * FACING],
    }
    for k, (roughness, bend) in enumerate(((0.3, -0.2), (0.5, 0.1), (0.8, 0.4)), 1):
        rows = (roughness, 0.8 * roughness)
        values[f"color{k}"] = np.outer((0.3, 0.2, 0.1), 0.2 + grazing)
        values[f"roughness{k}"] = np.outer(rows, 1.0 - 0.3 * grazing)
        values[f"bend{k}"] = [bend * FACING]
    return values


_VALUES: dict[str, dict[str, Any]] = {
    "lambert": DIFFUSE,
    "blinn-phong": {**BLUE, "exponent": 60.0},
    "lafortune": {**BLUE, "c_xy": -0.6, "c_z": 0.55, "exponent": 20.0},
    "ward": {**SHINY, "roughness": 0.2},
    "ward-duer": {**BLUE, "roughness": 0.2},
    "ashikhmin-shirley": {**SHINY, "exponent": 60.0, "normal_reflectance": 0.5},
    "ashikhmin-shirley-dielectric": {**SHINY, "exponent": 60.0, "index": 1.8},
    "cook-torrance": {**SHINY, "roughness": 0.2, "index": 1.8},
    "cook-torrance-schlick": {**SHINY, "roughness": 0.2, "normal_reflectance": 0.4},
    "ggx": {**BLUE, "roughness": 0.15},
    "ggx-anisotropic": {**BLUE, "roughness_x": 0.1, "roughness_y": 0.3, "angle": 0.4},
    "abc-microfacet": ABC,
    "abc-smooth": ABC,
    "sgd": {
        **SHINY,
        **grey(alpha=0.05, p=0.7, normal_reflectance=0.2, slope=0.05, normalisation=8.0),
        "lambda": (2.0, 2.0, 2.0),
        **grey(log_c=-4.0, k=6.0, theta_0=0.1),
    },
    "tabulated-microfacets": {
        "distribution": [TABLES["distribution"]],
        "area": [TABLES["area"]],
        "fresnel": TABLES["fresnel"],
    },
    "npf": {
        **SHINY,
        "distribution": [TABLES["distribution"]] * 3,
        "fresnel": TABLES["fresnel"],
        "masking": [np.cos(even_angles()) / TABLES["area"]] * 3,
    },
    "gltf": GLTF,
    "gltf-anisotropic": {**GLTF, "anisotropyStrength": 0.5, "anisotropyRotation": 0.4},
    "openpbr": OPENPBR,
    "openpbr-anisotropic": {
        **OPENPBR,
        "specular_roughness_anisotropy": 0.5,
        "coat_roughness_anisotropy": 0.3,
        "angle": 0.4,
    },
    "disney": DISNEY,
    "disney-anisotropic": {**DISNEY, "anisotropic": 0.7},
    "principled": PRINCIPLED,
    "principled-film": {**PRINCIPLED, **FILM},
    "principled-film-anisotropic": {**PRINCIPLED, **FILM, **TURNED},
    "principled-anisotropic": {**PRINCIPLED, **TURNED},
    "closures": closures(),
}

EXAMPLES: dict[str, AnalyticBrdf] = {
    name: MODELS[name](name=name, **values) for name, values in _VALUES.items()
}
