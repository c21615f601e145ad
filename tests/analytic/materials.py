"""One material of every analytic model."""

from __future__ import annotations

from nacre.analytic import MODELS, AnalyticBrdf

BLUE = {"diffuse": (0.05, 0.1, 0.3), "specular": (0.05, 0.04, 0.03)}

EXAMPLES: dict[str, AnalyticBrdf] = {
    name: MODELS[name](name=name, **values)
    for name, values in {
        "ggx": {**BLUE, "roughness": 0.15},
        "ggx-anisotropic": {**BLUE, "roughness_x": 0.1, "roughness_y": 0.3, "angle": 0.4},
    }.items()
}
