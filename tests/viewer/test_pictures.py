"""The page's pictures against integration by NumPy, and against Mitsuba."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.studio import studio
from nacre.neural import Recipe
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.oracles.pictures import rendered as rendered_by_mitsuba
from tests.oracles.runners import browser
from tests.tiers import tiered
from tests.variants import require_mitsuba
from tests.viewer.tab import Tab, page

SIZE, FRAMES = 32, 128
MAP_SIZE = 192, 96
CHOSEN = "ggx", "openpbr", "gltf", "principled", "disney-anisotropic", "closures"
FITTED = {"network": "paper", "smooth network": "enhanced"}
MATERIALS = *CHOSEN, *FITTED
LIGHTS = "studio", "furnace"

RENDER = """([material, light, change, size, frames]) => {
  const { renderer, controls, materials } = window.page;
  window.page.loop = () => {};
  controls.light(light);
  const plain = { still: true, irradiance: [0, 0, 0], surroundings: 1 };
  renderer.change({ ...plain, shape: "sphere", stage: false, film: false, ...change });
  renderer.resize(size, size);
  renderer.show(materials.shown(materials.list[material].forms[0]));
  for (let k = 0; k < frames; k++) renderer.frame();
  const points = [0, 1, 2].map((k) => renderer.read(renderer.points, k));
  return [renderer.sums(), ...points].map(window.encoded);
}"""


@cache
def material(name: str) -> Brdf:
    if name in CHOSEN:
        return EXAMPLES[name]
    recipe = Recipe(inputs=FITTED[name], samples=20_000, epochs=3, starts=1)
    return nacre.fit(EXAMPLES["ggx"], recipe)


def rendered(
    tab: Tab, material: int, light: int, change: object = None, **more: int
) -> list[Floats]:
    """Sums, normals, tangents and points, shapes (size, size, 4), the top row first."""
    size, frames = more.get("size", SIZE), more.get("frames", FRAMES)
    texts = tab.page.evaluate(RENDER, [material, light, change or {}, size, frames])
    return [browser.floats(text).reshape(size, size, 4)[::-1] for text in texts]


@pytest.fixture(scope="module")
def tab(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """One page for all pictures."""
    furnace = Environment(np.ones((*MAP_SIZE[::-1], 3), np.float32), "Furnace")
    entries = [Entry(name, {"Only": material(name)}) for name in MATERIALS]
    with Tab(chromium, tmp_path_factory.mktemp("pictures")) as opened:
        opened.open(page("Pictures", entries, [studio(MAP_SIZE[1]), furnace]))
        yield opened


LIGHT = """() => {
  const { renderer } = window.page, { texels } = renderer.environment, { gl } = renderer;
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texels, 0);
  const [width, height] = MAP_SIZE, found = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, found);
  return [...found];
}""".replace("MAP_SIZE", str(list(MAP_SIZE)))


def environment(tab: Tab) -> Environment:
    """The map as the page decodes it."""
    values = np.float32(tab.page.evaluate(LIGHT))
    return Environment(values.reshape(*MAP_SIZE[::-1], 4)[..., :3])


def integrated(brdf: Brdf, lighting: Environment, frame: Floats) -> Floats:
    """Radiance toward +z of a point with axes in the columns of `frame`, by the midpoint rule."""
    width, height = (2 * n for n in MAP_SIZE)
    cosines = np.cos(np.pi * np.arange(height + 1) / height)
    theta = np.arccos(0.5 * (cosines[1:] + cosines[:-1]))[:, None]
    phi = 2.0 * np.pi * (np.arange(width) + 0.5)[None] / width
    toward = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)
        ),
        axis=-1,
    )
    angles = (cosines[:-1] - cosines[1:])[:, None] * 2.0 * np.pi / width
    solid = np.broadcast_to(angles, (height, width))
    wi = toward @ frame
    above = wi[..., 2] > 0.0
    wo = np.broadcast_to(frame[2], wi[above].shape)
    light = lighting.radiance(toward[above]) * (wi[above][:, 2] * solid[above])[:, None]
    return np.asarray((brdf.eval(wi[above], wo) * light).sum(axis=0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "name"),
    tiered(
        [*(("studio", name) for name in MATERIALS), *(("furnace", n) for n in ("ggx", "network"))],
        [("studio", "network"), ("furnace", "ggx")],
    ),
)
def test_patches_agree_with_integration(tab: Tab, name: str, light: str) -> None:
    sums, normals, tangents, _ = rendered(tab, MATERIALS.index(name), LIGHTS.index(light))
    lighting = environment(tab)
    rows, columns = np.nonzero(normals[..., 2] > 0.3)
    chosen = np.random.default_rng(0).choice(len(rows), 32, replace=False)
    found, wanted = [], []
    for at in zip(rows[chosen], columns[chosen], strict=True):
        n, t = (np.float64(axes[at][:3]) for axes in (normals, tangents))
        wanted.append(integrated(material(name), lighting, np.stack([t, np.cross(n, t), n], 1)))
        found.append(sums[at][:3] / sums[at][3])
    difference = np.array(found) - np.array(wanted)
    error = difference.std(axis=0, ddof=1) / math.sqrt(len(chosen))
    assert (error < 0.01 * np.mean(wanted, axis=0)).all()
    assert (np.abs(difference.mean(axis=0)) < 4.5 * error + 1e-4 * np.mean(wanted, axis=0)).all()


@pytest.mark.parametrize("name", tiered(MATERIALS, ["openpbr", "closures", "network"]))
def test_a_lamp_gives_what_the_formula_says(tab: Tab, name: str) -> None:
    lamp, irradiance = np.array([0.7, -0.4, 2.0]), [1.0, 2.0, 3.0]
    change = {"lamp": [*lamp, 1], "irradiance": irradiance, "surroundings": 0}
    views = rendered(tab, MATERIALS.index(name), 0, change, frames=3)
    sums, normals, tangents, points = (np.float64(each) for each in views)
    inside = normals[..., 2] > 0.05
    n, t, p = (each[inside][:, :3] for each in (normals, tangents, points))
    frames = np.stack([t, np.cross(n, t), n], axis=1)
    way = lamp - p
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    wi = np.einsum("nij,nj->ni", frames, way / distance)
    wo = frames[:, :, 2]
    lit = wi[:, 2] > 1e-3
    wanted = (
        material(name).eval(wi[lit], wo[lit]) * wi[lit][:, 2:] * irradiance / distance[lit] ** 2
    )
    found = sums[inside][lit]
    np.testing.assert_allclose(found[:, :3] / found[:, 3:], wanted, rtol=2e-3, atol=1e-5)


def test_the_sphere_is_round(tab: Tab) -> None:
    _, normals, _, points = rendered(tab, 0, 0, frames=1)
    inside = normals[..., 2] > 0.1
    middles = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    x, y = np.meshgrid(middles / 0.97, -middles / 0.97)
    exact = np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)[inside]
    assert np.abs(normals[inside][:, :3] - exact).max() < 1e-5
    assert np.abs(points[inside][:, :3] - exact).max() < 1e-5


@pytest.mark.parametrize("name", tiered(["openpbr", "smooth network"], ["smooth network"]))
def test_pixels_are_those_of_mitsuba(tab: Tab, name: str) -> None:
    mi = require_mitsuba()
    size = 64
    sums, *_ = rendered(tab, MATERIALS.index(name), 0, {"still": False}, size=size, frames=FRAMES)
    light = {"type": "envmap", "bitmap": mi.Bitmap(environment(tab).pixels)}
    truth = rendered_by_mitsuba(material(name), size, 1024, light)
    covered = sums[..., 3] >= sums[..., 3].max()
    found = sums[..., :3] / np.maximum(sums[..., 3:], 1.0)
    error = (tone_map(found) - tone_map(truth))[covered]
    assert -10.0 * math.log10(np.mean(error**2)) > 40.0
