"""glTF's model against viewers that draw it: the Khronos sample viewer and three.js.

Random materials with few layers and with all, each on a plane that a camera sees from angles of up
to 76 degrees, under directional lights; relative errors of f_r cos where it is above 0.001.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.standard.gltf import AnisotropicGltf, Gltf
from nacre.standard.sheen import charlie
from tests.oracles.gltf_scenes import plane_scene, plane_views
from tests.oracles.runners import gltf

OFF: Mapping[str, Any] = {
    "ior": 1.5,
    "specularFactor": 1.0,
    "specularColorFactor": (1.0, 1.0, 1.0),
    "iridescenceFactor": 0.0,
    "sheenColorFactor": (0.0, 0.0, 0.0),
    "clearcoatFactor": 0.0,
    "anisotropyStrength": 0.0,
}
"""What leaves metallic-roughness alone."""

LAYERS: Mapping[str, tuple[str, ...]] = {
    "metallic-roughness": (),
    "ior, specular": ("ior", "specularFactor"),
    "specular color": ("specularColorFactor",),
    "anisotropy": ("anisotropyStrength",),
    "clearcoat": ("clearcoatFactor",),
    "sheen": ("sheenColorFactor",),
    "iridescence": ("iridescenceFactor",),
    "all": tuple(OFF),
}
"""What else a material has."""

SIZE = 48
_TABLE, _POINTS = 64, 128


def made(seed: int, layers: tuple[str, ...]) -> Gltf:
    """A material at random with some layers; others are off."""
    random = np.random.default_rng(seed)
    values: dict[str, Any] = {}
    for parameter in AnisotropicGltf.parameters:
        low, high = parameter.start
        drawn = low + (high - low) * random.random(parameter.shape)
        values[parameter.name] = tuple(drawn.tolist()) if parameter.color else float(drawn)
    return AnisotropicGltf(**values | {k: v for k, v in OFF.items() if k not in layers})


def lights(count: int, seed: int = 0) -> Floats:
    """Directions at random, up to 75 degrees from the normal, shape (count, 3)."""
    random = np.random.default_rng(seed)
    z = random.uniform(math.cos(math.radians(75.0)), 1.0, count)
    phi = random.uniform(0.0, 2.0 * math.pi, count)
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1)


def sheen_albedo() -> Floats:
    """What the sample viewer's page has as a picture: the sheen's albedo, shape (n, n)."""
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    mu, phi = 0.5 + 0.5 * points[:, None], (np.arange(_POINTS) + 0.5) * (math.pi / _POINTS)
    radius = np.sqrt(1.0 - mu * mu)
    wi = radius * np.cos(phi), radius * np.sin(phi), mu + 0.0 * phi
    centers = (np.arange(_TABLE) + 0.5) / _TABLE
    table = np.zeros((_TABLE, _TABLE))
    for row, roughness in enumerate(centers):
        for column, cosine in enumerate(centers):
            wo = (math.sqrt(1.0 - cosine**2), 0.0, float(cosine))
            h = np.stack([a + b for a, b in zip(wi, wo, strict=True)])
            h /= np.linalg.norm(h, axis=0)
            lobe = charlie(tuple(h), wi, wo, float(roughness**2))
            table[row, column] = math.pi / _POINTS * (weights @ (lobe * mu)).sum()
    return np.minimum(table, 1.0)


def errors(
    viewer: gltf.Viewer, materials: list[Gltf], directions: Floats, **options: Any
) -> Floats:
    """Relative errors of a viewer's planes against the model, shape (n,)."""
    scenes = [plane_scene(brdf, wi) for brdf in materials for wi in directions]
    found = gltf.drawn(viewer, scenes, (SIZE, SIZE), **options)
    wo = plane_views(SIZE)
    expected = [brdf.eval(wi, wo) * wi[2] for brdf in materials for wi in directions]
    truth = np.stack(expected).astype(np.float64)
    return (np.abs(found - truth) / np.maximum(truth, 1e-3)).reshape(-1)
