"""The tracer against Mitsuba's path integrator on the same triangles, and against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.btf.capture.gonioreflectometer import DEPTH, capture
from nacre.btf.capture.mesostructure import Mesostructure
from nacre.geometry import from_spherical, join
from tests.variants import require_mitsuba

CELLS = 64
TEXELS = 8
PERIODS = 5
ANGLES_LIGHT = np.radians([(50.0, 200.0), (20.0, 70.0)])
ANGLES_VIEW = np.radians([(40.0, 20.0), (55.0, 110.0)])


def bumps(
    amplitude: float,
    albedo: Any = 0.5,
    specular: Any = 0.0,
    roughness: tuple[float, float] = (0.3, 0.3),
    size: int = CELLS,
) -> Mesostructure:
    """An egg carton, twice a period, of one colour or of one a cell."""
    y, x = np.mgrid[:size, :size] * (4.0 * np.pi / size)
    height = amplitude * (np.sin(x) * np.sin(y) + 0.4 * np.sin(2.0 * x + y))
    shape = (size, size)
    return Mesostructure(
        height,
        np.broadcast_to(albedo, (*shape, 3)).astype(float),
        np.broadcast_to(specular, (*shape, 3)).astype(float),
        np.broadcast_to(roughness, (*shape, 2)).astype(float),
        np.zeros(shape),
    )


def directions(angles: np.ndarray) -> np.ndarray:
    return join(from_spherical(angles[:, 0], angles[:, 1])).astype(np.float32)


def every_pair() -> tuple[np.ndarray, np.ndarray]:
    lights, views = directions(ANGLES_LIGHT), directions(ANGLES_VIEW)
    return np.tile(lights, (len(views), 1)), np.repeat(views, len(lights), 0)


def ours(surface: Mesostructure, repeats: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Mean of several runs and its variance, shape (height, width, pairs, 3)."""
    runs = [
        capture(surface, *every_pair(), TEXELS, samples=128, seed=seed).values.astype(float)
        for seed in range(repeats)
    ]
    return np.mean(runs, 0), np.var(runs, 0, ddof=1) / repeats


def mitsuba_mesh(mi: Any, surface: Mesostructure, bsdf: dict[str, Any]) -> Any:
    """The surface over several periods, the middle one of which covers the unit square."""
    size, count = surface.size, surface.size * PERIODS
    steps = np.arange(count + 1)
    y, x = np.meshgrid(steps, steps, indexing="ij")
    z = surface.height[y % size, x % size]
    vertices = np.stack([x / size - PERIODS // 2, y / size - PERIODS // 2, z], -1).reshape(-1, 3)
    corner = (y * (count + 1) + x)[:-1, :-1]
    east, north, far = corner + 1, corner + count + 1, corner + count + 2
    lower, upper = np.stack([corner, east, far], -1), np.stack([corner, far, north], -1)
    faces = np.stack([lower, upper], 2).reshape(-1, 3)
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(bsdf)
    properties["face_normals"] = True
    mesh = mi.Mesh(
        "surface", len(vertices), len(faces), properties, has_vertex_texcoords=True
    )
    cells_y, cells_x = y[:-1, :-1] % size, x[:-1, :-1] % size
    albedo = np.repeat(surface.albedo[cells_y, cells_x][:, :, None], 2, 2)
    mesh.add_attribute("face_albedo", 3, albedo.reshape(-1).astype(np.float32))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.reshape(-1).astype(np.float32)
    parameters["faces"] = faces.reshape(-1).astype(np.uint32)
    parameters["vertex_texcoords"] = vertices[:, :2].reshape(-1).astype(np.float32)
    parameters.update()
    return mesh


def mitsubas(
    surface: Mesostructure, bsdf: dict[str, Any], samples: int = 2048
) -> tuple[np.ndarray, np.ndarray]:
    """What Mitsuba makes of the same, with the variance of the means."""
    mi = require_mitsuba("llvm_ad_rgb")
    lights = directions(ANGLES_LIGHT)
    integrator = mi.load_dict({"type": "path", "max_depth": DEPTH + 1, "rr_depth": 100})
    random = np.random.default_rng(5)
    mesh = mitsuba_mesh(mi, surface, bsdf)
    means, variances = [], []
    for view in directions(ANGLES_VIEW):
        for light in lights:
            emitter = {"type": "directional", "direction": (-light).tolist(), "irradiance": 1.0}
            scene = mi.load_dict({"type": "scene", "mesh": mesh, "emitter": emitter})
            row, column, _ = np.indices((TEXELS, TEXELS, samples))
            at = np.stack([column, TEXELS - 1 - row]) + random.uniform(size=(2, *row.shape))
            start = np.stack([*at / TEXELS, np.zeros(row.shape)]) + 0.3 * view.reshape(3, 1, 1, 1)
            ray = mi.RayDifferential3f(
                mi.Point3f(start.reshape(3, -1).astype(np.float32)), mi.Vector3f(*(-view).tolist())
            )
            sampler = mi.load_dict({"type": "independent"})
            sampler.seed(len(means), row.size)
            radiance, _, _ = integrator.sample(scene, sampler, ray)
            values = np.array(radiance).T.reshape(TEXELS, TEXELS, samples, 3)
            values = np.pi * values / light[2]
            means.append(values.mean(2))
            variances.append(values.var(2, ddof=1) / samples)
    return np.stack(means, 2), np.stack(variances, 2)


def compare(a: tuple[np.ndarray, np.ndarray], b: tuple[np.ndarray, np.ndarray]) -> None:
    """Means within 1 %, and differences of texels no larger than their noise makes them."""
    (mean_a, variance_a), (mean_b, variance_b) = a, b
    assert mean_b.mean((0, 1)) == pytest.approx(mean_a.mean((0, 1)), rel=0.01)
    chi_square = (mean_a - mean_b) ** 2 / (variance_a + variance_b + 1e-9)
    print("ratio", mean_a.mean((0,1,3))/mean_b.mean((0,1,3)), "chi", chi_square.mean((0,1)).round(2).tolist())
    assert 0.7 < chi_square.mean() < 1.4
