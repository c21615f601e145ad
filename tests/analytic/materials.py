"""One material of every analytic model."""

from __future__ import annotations

from typing import Any

from nacre.analytic import MODELS, AnalyticBrdf

DIFFUSE = {"diffuse": (0.05, 0.1, 0.3)}
BLUE = {**DIFFUSE, "specular": (0.05, 0.04, 0.03)}
SHINY = {**DIFFUSE, "specular": (0.3, 0.25, 0.2)}
ABC = {**DIFFUSE, "specular": (5.0, 3.0, 2.0), "b": 500.0, "c": 1.3, "index": 1.6}


def grey(**values: float) -> dict[str, tuple[float, float, float]]:
    """The same number for every channel."""
    return {name: (value, value, value) for name, value in values.items()}


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
}

EXAMPLES: dict[str, AnalyticBrdf] = {
    name: MODELS[name](name=name, **values) for name, values in _VALUES.items()
}
