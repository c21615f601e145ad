"""glTF's material: against viewers that draw it, and its fibers against energy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.geometry import from_spherical, half_vector
from nacre.standard.gltf import Gltf
from nacre.standard.sheen import charlie, charlie_albedo
from tests.analytic.materials import EXAMPLES
from tests.oracles.gltf_scenes import frames, scene, sphere_views
from tests.oracles.gltf_viewers import OFF, errors, lights, made, sheen_albedo
from tests.oracles.runners import gltf

missing = gltf.missing()
viewers = pytest.mark.skipif(missing is not None, reason=f"{missing} is not installed")


@pytest.mark.slow
@viewers
def test_the_sample_viewer_shows_the_same() -> None:
    """As it is for some layers; for all of them, with its shaders as the texts say. The sheen's
    albedo is a fit, which takes up to 2 % of the sheen from what is below or gives it.
    """
    directions = lights(2)
    layers = "specularColorFactor", "clearcoatFactor", "iridescenceFactor"
    found = errors("khronos", [made(seed, layers) for seed in range(3)], directions)
    assert found.max() < 5e-4
    materials = [made(seed, tuple(OFF)) for seed in range(2)]
    options = {"sheen_albedo": sheen_albedo(), "edits": gltf.AS_WRITTEN}
    found = errors("khronos", materials, directions, **options)
    assert np.median(found) < 3e-3
    assert found.max() < 0.02


@viewers
def test_three_js_shows_nearly_the_same() -> None:
    """Its Fresnel term is another approximation, and it makes up for facets that light meets twice:
    without that, metallic-roughness is the same but for the first.
    """
    plain = [made(seed, ()) for seed in range(2)]
    found = errors("three", plain, lights(2), edits=[gltf.NO_COMPENSATION])
    assert np.median(found) < 2e-3
    assert found.max() < 0.06


@viewers
@pytest.mark.parametrize(("viewer", "decibels"), [("khronos", 45.0), ("three", 31.0)])
def test_the_written_sphere_looks_as_the_model_does(viewer: gltf.Viewer, decibels: float) -> None:
    """Light on a brushed metal shows which way the tangents of the sphere go."""
    brdf = made(0, ("anisotropyStrength",))
    metal = {"anisotropyStrength": 0.7, "metallicFactor": 1.0, "roughnessFactor": 0.4}
    brdf = brdf.replaced(values={**brdf.values, **metal})
    edits = gltf.AS_WRITTEN if viewer == "khronos" else ()
    size, distance, angle = 128, 4.0, math.radians(32.0)
    light = np.array([0.4, 0.5, 0.8]) / np.linalg.norm([0.4, 0.5, 0.8])
    shown_scene = scene(brdf, light.tolist(), distance, angle)
    (found,) = gltf.drawn(viewer, [shown_scene], (size, size), edits=edits)
    seen, normals, views = sphere_views(size, distance, angle)
    axes = frames(normals)
    wi, wo = axes @ light, np.einsum("nij,nj->ni", axes, views)
    expected = brdf.eval(wi, wo) * np.maximum(wi[:, 2:], 0.0)
    well = wo[:, 2] > 0.2  # where the edges of triangles are no outline
    shown = [np.clip(math.pi * x[well], 0.0, 1.0) ** (1 / 2.2) for x in (found[seen], expected)]
    error = np.mean((shown[0] - shown[1]) ** 2)
    assert -10.0 * math.log10(error) > decibels
    assert shown[1].std() > 0.1


def test_layers_that_are_off_do_nothing() -> None:
    """Whatever their other numbers are."""
    base = Gltf(**{**EXAMPLES["gltf"].values, **{k: v for k, v in OFF.items() if "aniso" not in k}})
    other = {"clearcoatRoughnessFactor": 0.9, "sheenRoughnessFactor": 0.1, "iridescenceIor": 2.0}
    wi = np.array(from_spherical(np.linspace(0.0, 1.4, 20), np.linspace(0.0, 6.0, 20))).T
    for changes in (other, {"iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 0.0}):
        changed = Gltf(**{**base.values, **changes})
        np.testing.assert_allclose(base.eval(wi, wi[::-1]), changed.eval(wi, wi[::-1]), rtol=1e-6)


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_the_fibers_albedo_is_what_they_reflect(roughness: float) -> None:
    u, v = np.random.default_rng(0).random((2, 200_000))
    wi = from_spherical(np.arccos(1.0 - u), 2.0 * math.pi * v)
    for cosine in (0.1, 0.5, 0.9):
        wo = (math.sqrt(1.0 - cosine * cosine), 0.0, cosine)
        lobe = charlie(half_vector(wi, wo), wi, wo, roughness * roughness)
        mean = 2.0 * math.pi * np.mean(lobe * wi[2])
        assert charlie_albedo(np.array(cosine), roughness) == pytest.approx(mean, abs=0.02)
