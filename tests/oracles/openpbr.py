"""How close OpenPBR's formula comes to the GLSL that MaterialX generates of a written file.

Random parameters, one light, random normals and tangents: radiance of the shader against f_r times
the cosine. Bounds of the parameters leave out where the two differ on purpose: roughnesses below
what float32 directions resolve, and metals whose reflectance MaterialX lets go below 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

import numpy as np

from nacre.analytic.model import AnalyticBrdf
from nacre.array import Floats
from nacre.standard.files import materialx
from nacre.standard.openpbr import OpenPbr
from tests.oracles.surface_shader import SurfaceShader

_LEAST = 1e-3  # radiance below which errors are relative to this
_LOW = 0.02  # cosine of directions that are left out
_BOUNDS: Mapping[str, tuple[float, float]] = {
    "specular_color": (0.7, 1.0),
    "specular_roughness": (0.1, 1.0),
    "coat_roughness": (0.1, 1.0),
    "specular_roughness_anisotropy": (0.0, 0.8),
    "coat_roughness_anisotropy": (0.0, 0.8),
}

PARTS: Mapping[str, Mapping[str, float]] = {
    "diffuse and glossy": {"base_metalness": 0.0},
    "metal": {"base_metalness": 1.0},
    "coat": {"coat_weight": 0.6},
    "fuzz": {"fuzz_weight": 1.0},
    "film on a dielectric": {"base_metalness": 0.0, "thin_film_weight": 1.0},
    "film on a metal": {"base_metalness": 1.0, "thin_film_weight": 1.0},
}
"""Parameters of materials that lack the other layers."""

BARE = {"coat_weight": 0.0, "fuzz_weight": 0.0, "thin_film_weight": 0.0}


def _shader(brdf: OpenPbr) -> SurfaceShader:
    return SurfaceShader(materialx.encode(brdf).decode())


Model = TypeVar("Model", bound=OpenPbr)


class Comparison(Generic[Model]):
    """Errors of a model's formula, in random pictures.

    Parameters
    ----------
    model
        Class of the model.
    seed
        Of all that is random.
    shader
        From a material to MaterialX's shader of a document with it.
    """

    def __init__(
        self, model: type[Model], seed: int, shader: Callable[[Model], SurfaceShader] = _shader
    ) -> None:
        self._model, self._random = model, np.random.default_rng(seed)
        self._shader = shader(self._drawn({}))

    def _drawn(self, given: Mapping[str, Any]) -> Model:
        values = {}
        for parameter in self._model.parameters:
            low, high = _BOUNDS.get(parameter.name, (parameter.low, parameter.high))
            drawn = self._random.uniform(low, high, parameter.size).tolist()
            values[parameter.name] = tuple(drawn) if parameter.color else drawn[0]
        return self._model(name="m", **values | dict(given))

    def errors(
        self, given: Mapping[str, Any], materials: int, lights: int = 5, points: int = 200
    ) -> Floats:
        """Relative errors of radiance, shape (n,).

        Parameters
        ----------
        given
            Parameters that are not drawn.
        materials, lights, points
            How many sets of parameters, lights of each, and normals about under each light.
        """
        found = [
            self._errors(brdf, points)
            for brdf in (self._drawn(given) for _ in range(materials))
            for _ in range(lights)
        ]
        return np.concatenate(found)

    def _errors(self, brdf: AnalyticBrdf, points: int) -> Floats:
        light = _unit(self._random.normal(size=3))
        if light[2] < -0.8:  # from behind, hardly anything that is seen is lit
            light = -light
        normals = _unit(self._random.normal(size=(8 * points, 3)))
        lit = (normals[:, 2] > _LOW) & (normals @ light > _LOW)
        normals = normals[lit][:points]
        tangents = _unit(np.cross(normals, self._random.normal(size=normals.shape)))
        frame = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
        wi, wo = ((frame @ w).astype(np.float32) for w in (light, np.array([0.0, 0.0, 1.0])))
        values = {f"m_surface_{k}": v for k, v in brdf.values.items() if k != "angle"}
        if "angle" in brdf.values:
            values["m_turned_amount"] = -np.degrees(brdf.values["angle"])
        expected = self._shader.radiance(values, light, normals, tangents)
        found = brdf.eval(wi, wo) * wi[:, 2:]
        errors: Floats = np.abs(found - expected) / np.maximum(np.abs(expected), _LEAST)
        return errors.reshape(-1)


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
