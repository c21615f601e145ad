"""Materials in three.js: what its lights and environments make of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.targets import TARGETS, identifier
from tests.oracles.runners import browser, three
from tests.tiers import tiered

SIZE = 96
CAMERA = {"position": [0, 0, 4], "target": [0, 0, 0], "angle": 35}
BRUSHED = AnisotropicGgx(
    diffuse=(0.2, 0.1, 0.05),
    specular=(0.9, 0.7, 0.4),
    roughness_x=0.5,
    roughness_y=0.2,
    angle=0.5,
)
LIGHTS: list[dict[str, Any]] = [
    {"type": "DirectionalLight", "position": [1, 2, 2], "color": [1.0, 0.5, 0.2], "intensity": 2},
    {"type": "PointLight", "position": [-2, 1, 1.5], "intensity": 9},
    {"type": "SpotLight", "position": [0.5, -2, 2], "intensity": 20, "angle": 0.3, "penumbra": 0.5},
]

missing = three.missing()
pytestmark = pytest.mark.skipif(missing is not None, reason=f"{missing} is not installed")
renderers = pytest.mark.parametrize("renderer", tiered(["webgl", "webgpu"], ["webgpu"]))


def module(brdf: Brdf) -> bytes:
    (text,) = TARGETS["three"]().files(brdf, identifier(brdf.name)).values()
    return text


def picture(
    renderer: str, brdf: Brdf, sphere: Mapping[str, Any] | None = None, **scene: Any
) -> Floats:
    """Linear values of a sphere, shape (SIZE, SIZE, 3)."""
    spheres = [{"module": "/material.js", **(sphere or {})}]
    description = {"renderer": renderer, "size": [SIZE, SIZE], "camera": CAMERA, "spheres": spheres}
    files = {**three.page(), "material.js": module(brdf)}
    data = {}
    if "environment" in scene:
        data["environment"] = scene["environment"]
        height, width, _ = scene["environment"].shape
        scene["environment"] = {"width": width, "height": height}
    found = browser.compute(files, "scene.js", "values", description | scene, data)
    return browser.floats(found).reshape(SIZE, SIZE, 4)[..., :3].astype(np.float64)


def seen() -> tuple[Floats, Floats, Floats]:
    """Where pixels see the sphere well: which, the points there, and directions to the camera."""
    line = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    scale = math.tan(math.radians(CAMERA["angle"]) / 2.0)
    x, y = np.meshgrid(line * scale, -line * scale)
    ray = np.stack([x, y, -np.ones_like(x)], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    eye = np.array(CAMERA["position"], np.float64)
    along = -ray @ eye
    inside = along**2 - (eye @ eye - 1.0)
    points = eye + (along - np.sqrt(np.maximum(inside, 0.0)))[..., None] * ray
    mask = (inside > 0.0) & ((-ray * points).sum(-1) > 0.2)
    return mask, points[mask], -ray[mask]


def frames(points: Floats) -> Floats:
    """Axes of the sphere: the tangent goes with u, the bitangent with v; shape (n, 3, 3)."""
    x, y, z = points.T
    tangent = np.stack([z, 0.0 * y, -x], axis=-1) / np.hypot(x, z)[:, None]
    return np.stack([tangent, np.cross(points, tangent), points], axis=1)


def reflected(brdf: Brdf, points: Floats, view: Floats, light: Floats) -> Floats:
    """f_r cos of directions, shape (n, 3); all arguments of this shape."""
    axes = frames(points)
    wi, wo = (np.einsum("nij,nj->ni", axes, w) for w in (light, view))
    return brdf.eval(wi, wo) * np.maximum(wi[:, 2:], 0.0)


def arriving(light: Mapping[str, Any], points: Floats) -> tuple[Floats, Floats]:
    """Directions to a light, and what arrives from it across them, as three.js documents it."""
    place = np.array(light["position"], np.float64)
    color = light["intensity"] * np.array(light.get("color", (1.0, 1.0, 1.0)))
    if light["type"] == "DirectionalLight":
        return np.broadcast_to(place / np.linalg.norm(place), points.shape), color
    way = place - points
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    way = way / distance
    strength = 1.0 / distance**2
    if light["type"] == "SpotLight":
        edges = np.cos([light["angle"], light["angle"] * (1.0 - light["penumbra"])])
        t = (way @ (place / np.linalg.norm(place)) - edges[0]) / (edges[1] - edges[0])
        t = np.clip(t, 0.0, 1.0)[:, None]
        strength = strength * t * t * (3.0 - 2.0 * t)
    return way, strength * color


@pytest.mark.parametrize("renderer", tiered(["webgl", "webgpu", "fallback"], ["webgl", "fallback"]))
def test_lights_of_the_scene_are_reflected(renderer: str) -> None:
    mask, points, view = seen()
    expected = np.zeros_like(points)
    for light in LIGHTS:
        way, strength = arriving(light, points)
        expected += reflected(BRUSHED, points, view, way) * strength
    found = picture(renderer, BRUSHED, lights=LIGHTS)[mask]
    assert np.sqrt(((found - expected) ** 2).mean()) <= 0.01 * expected.mean()
    np.testing.assert_allclose(found, expected, rtol=0.05, atol=0.02)


def sky(width: int = 64) -> Floats:
    """An environment, smooth but for a window: RGBA, rows from the top."""
    height = width // 2
    v, u = np.meshgrid(
        (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij"
    )
    values = np.stack(
        [1.0 + np.cos(2 * np.pi * u), 1.0 - v, 0.5 + 0.5 * v, np.ones_like(u)], axis=-1
    )
    values[height // 5 : height // 3, width // 2 : width * 3 // 5, :3] += 8.0
    return values


def integrated(brdf: Brdf, environment: Floats, points: Floats, view: Floats) -> Floats:
    """What an environment of constant texels makes of the sphere, shape (n, 3)."""
    height, width, _ = environment.shape
    fine = 4
    rows = (np.arange(height * fine) + 0.5) / (height * fine)
    columns = (np.arange(width * fine) + 0.5) / (width * fine)
    theta, u = np.meshgrid(np.pi * rows, columns, indexing="ij")
    phi = 2.0 * np.pi * (u - 0.5)
    way = np.stack(
        [np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1
    )
    solid = (np.sin(theta) * np.pi / (height * fine) * 2.0 * np.pi / (width * fine))[..., None]
    light = np.kron(environment[..., :3], np.ones((fine, fine, 1))) * solid
    way, light = way.reshape(-1, 3), light.reshape(-1, 3)
    found = []
    for point, to in zip(points, view, strict=True):
        up = way @ point > 0.0
        one = np.broadcast_to(point, way[up].shape)
        f = reflected(brdf, one, np.broadcast_to(to, one.shape), way[up])
        found.append((f * light[up]).sum(0))
    return np.array(found)


@pytest.mark.slow
@renderers
def test_environments_are_reflected(renderer: str) -> None:
    mask, points, view = seen()
    some = slice(None, None, 97)
    expected = integrated(BRUSHED, sky(), points[some], view[some])
    for samples, allowed in ((32, 0.1), (512, 0.02)):
        found = picture(renderer, BRUSHED, {"samples": samples}, environment=sky())[mask][some]
        assert np.sqrt(np.square(found / expected - 1.0).mean()) <= allowed


@pytest.mark.slow
@renderers
def test_ambient_light_is_an_environment_of_one_color(renderer: str) -> None:
    mask, points, view = seen()
    some = slice(None, None, 97)
    color = np.array([1.0, 0.5, 0.25])
    lights = [{"type": "AmbientLight", "color": list(color), "intensity": 2.0}]
    expected = integrated(BRUSHED, np.ones((16, 32, 3)), points[some], view[some])
    found = picture(renderer, BRUSHED, {"samples": 512}, lights=lights)[mask][some]
    np.testing.assert_allclose(found, expected * color * 2.0 / math.pi, rtol=0.02)


@renderers
def test_materials_of_a_scene_stay_apart(renderer: str) -> None:
    matte = Ggx(diffuse=(0.8, 0.4, 0.2), specular=(0.0, 0.0, 0.0), roughness=0.5)
    spheres = [
        {"module": "/brushed.js", "position": [-2, 0, 0], "environmentIntensity": 0},
        {"module": "/matte.js", "position": [0, 0, 0]},
        {"module": "/matte.js", "position": [2, 0, 0], "environmentIntensity": 0.5},
    ]
    description = {
        "renderer": renderer,
        "size": [SIZE, SIZE],
        "camera": CAMERA | {"position": [0, 0, 12]},
        "spheres": spheres,
        "environment": {"width": 16, "height": 8},
    }
    files = {**three.page(), "brushed.js": module(BRUSHED), "matte.js": module(matte)}
    data = {"environment": np.ones((8, 16, 4))}
    found = browser.floats(browser.compute(files, "scene.js", "values", description, data))
    row = found.reshape(SIZE, SIZE, 4)[SIZE // 2, :, :3]
    # The spheres' middles are 2 / (12 tan 17.5 degrees) of half the picture apart.
    left, middle, right = (row[int(SIZE / 2 * (1.0 + k * 0.5286))] for k in (-1, 0, 1))
    assert left.max() == 0.0
    np.testing.assert_allclose(middle, (0.8, 0.4, 0.2), rtol=0.05)  # a white furnace
    np.testing.assert_allclose(right, (0.4, 0.2, 0.1), rtol=0.05)


@pytest.mark.slow
@renderers
def test_meshes_without_tangents_follow_their_coordinates(renderer: str) -> None:
    mask, points, view = seen()
    way, strength = arriving(LIGHTS[0], points)
    expected = reflected(BRUSHED, points, view, way) * strength
    found = picture(renderer, BRUSHED, lights=LIGHTS[:1], tangents=False)[mask]
    assert np.abs(found - expected).mean() <= 0.01 * expected.mean()


EVERYTHING = b"""
import { createMaterial } from "/material.js";
import { pixelsOf, prepared } from "/scene.js";
import { encoded } from "/shared.js";

export async function held(description) {
  const { THREE, renderer, scene, draw } = await prepared(description);
  const count = () => [renderer.info.memory.textures, renderer.info.programs?.length ?? 0];
  draw();
  draw();
  const shown = count();
  scene.traverse((each) => each.material?.dispose());
  scene.clear();
  draw();
  return [shown, count()];
}

export async function shadows(description) {
  const { THREE, renderer, scene, target, draw } = await prepared(description);
  scene.fog = new THREE.Fog(0x808080, 50, 100);
  const material = createMaterial(THREE, { side: THREE.DoubleSide });
  const wall = new THREE.InstancedMesh(new THREE.PlaneGeometry(9, 9), material, 1);
  wall.setMatrixAt(0, new THREE.Matrix4().setPosition(0, 0, -1));
  scene.add(wall);
  scene.traverse((each) => (each.castShadow = each.receiveShadow = true));
  scene.traverse(({ shadow }) => {
    if (shadow) [shadow.bias, shadow.camera.far] = [-0.01, 10];
  });
  const pictures = [];
  for (const enabled of [false, true]) {
    renderer.shadowMap.enabled = enabled;
    scene.traverse((each) => each.material && (each.material.needsUpdate = true));
    draw();
    pictures.push(await pixelsOf(renderer, target));
  }
  return Promise.all(pictures.map(encoded));
}
"""


def script(renderer: str, function: str, **scene: Any) -> Any:
    """What a function of the script above returns."""
    description = {
        "renderer": renderer,
        "size": [SIZE, SIZE],
        "camera": CAMERA,
        "spheres": [{"module": "/material.js"}],
        "lights": LIGHTS,
    }
    files = {**three.page(), "material.js": module(BRUSHED), "everything.js": EVERYTHING}
    return browser.compute(files, "everything.js", function, description | scene)


@renderers
def test_disposed_materials_leave_nothing(renderer: str) -> None:
    (textures, programs), (textures_left, programs_left) = script(renderer, "held")
    assert textures_left < textures
    assert programs_left == 0
    assert programs == (1 if renderer == "webgl" else 0)  # WebGPU counts none


@pytest.mark.slow
@renderers
def test_what_stands_in_the_way_casts_a_shadow(renderer: str) -> None:
    lit, shaded = (
        browser.floats(text).reshape(SIZE, SIZE, 4)[..., :3]
        for text in script(renderer, "shadows", lights=LIGHTS[:1])
    )
    # The sphere is between the light and (-0.7, -1.4, -1) of the wall, which is seen beside it.
    place = 90, 26
    assert lit[place].min() > 0.01
    assert shaded[place].max() == 0.0
    np.testing.assert_allclose(shaded[2, 90], lit[2, 90], rtol=1e-6)


@pytest.mark.parametrize(
    "name", ['*/ system("ls") // `${alert(1)}`</script>', "NACRE_GLSL \\u2028"]
)
def test_names_stay_names(name: str) -> None:
    text = module(BRUSHED.replaced(name=name, source={"terms": name}))
    head, _, rest = text.partition(b"export const")
    assert all(line.startswith(b"//") for line in head.splitlines() if line)
    plain = module(BRUSHED.replaced(name="m")).partition(b"export const")[2]
    assert rest.replace(identifier(name).encode(), b"m") == plain
    main = b"import { name } from '/material.js'; export const run = () => name;"
    files = {"material.js": text, "main.js": main}
    assert browser.compute(files, "main.js", "run") == identifier(name)
