"""The stage: shadows against rays by NumPy, first pictures, tones, and what suits a material."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from nacre.analytic.lambert import Lambert
from nacre.array import Floats
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.studio import studio
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.oracles.runners import browser
from tests.viewer.tab import Tab, page
from tests.viewer.test_pictures import LIGHT, MAP_SIZE

FLOOR, PAPER = -1.12, 0.42
SIZE = 120, 96

PICTURE = """async ([material, change, size, frames]) => {
  const { renderer, materials } = window.page;
  window.page.loop = () => {};
  await new Promise((done) => setTimeout(done, 50));
  renderer.resize(...size);
  const still = { stage: true, film: false, still: true, irradiance: [0, 0, 0], surroundings: 1 };
  renderer.change({ ...still, ...change });
  renderer.show(materials.shown(materials.list[material].forms[0]));
  for (let k = 0; k < frames; k++) renderer.frame();
  const points = [0, 2].map((k) => renderer.read(renderer.points, k));
  return [renderer.sums(), ...points].map(window.encoded);
}"""
SHOWN = """() => {
  const { renderer } = window.page, { gl, canvas: { width, height } } = renderer;
  renderer.present();
  const found = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, found);
  return [...found];
}"""
GAIN = """() => {
  const { renderer } = window.page, { gl, meter } = renderer, found = new Float32Array(4);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const gains = meter.of(renderer.pictures[0], renderer.environment, renderer.paper);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gains, 0);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, found);
  return found[0];
}"""


@cache
def content() -> bytes:
    entries = [
        Entry("Gray", {"Lambert": Lambert(diffuse=(0.5, 0.5, 0.5))}),
        Entry("Black", {"Lambert": Lambert(diffuse=(0.02, 0.02, 0.02))}),
        Entry("Metal", {"openpbr": EXAMPLES["openpbr"]}),
    ]
    return page("Stage", entries, [studio(MAP_SIZE[1])])


def drawn(tab: Tab, material: int, frames: int, change: Any, size: Any = SIZE) -> list[Floats]:
    """Sums, normals and points, the lowest row first."""
    texts = tab.page.evaluate(PICTURE, [material, change, size, frames])
    return [np.float64(browser.floats(text).reshape(size[1], size[0], 4)) for text in texts]


def shown(tab: Tab, size: Any = SIZE) -> Floats:
    values = np.array(tab.page.evaluate(SHOWN), float)
    return np.asarray(values.reshape(size[1], size[0], 4)[..., :3] / 255.0)


def sights(size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Where the camera stands, and unit vectors through the middles of pixels."""
    pitch, field = 0.2, math.tan(0.19)
    c, s = math.cos(pitch), math.sin(pitch)
    eye = np.array([0.0, -0.1 + 7.6 * s, 7.6 * c])
    x, y = np.meshgrid(*((np.arange(n) + 0.5) / n * 2.0 - 1.0 for n in size))
    smaller = min(size)
    x, y = x * field * size[0] / smaller, y * field * size[1] / smaller
    up, back = np.array([0.0, c, -s]), np.array([0.0, s, c])
    way = x[..., None] * np.array([1.0, 0.0, 0.0]) + y[..., None] * up - back
    return eye, way / np.linalg.norm(way, axis=-1, keepdims=True)


def hidden(p: Floats, w: Floats) -> Floats:
    """Whether light from directions w (k, 3) toward the ground at p meets the ball or its base."""
    b = w @ p
    ball = (b < 0.0) & (b * b > p @ p - 1.0)
    radius, top = 0.6, -0.88
    flat, at = w[:, [0, 2]], p[[0, 2]]
    a, b, q = (flat * flat).sum(1), flat @ at, at @ at - radius**2
    root = np.sqrt(np.maximum(b * b - a * q, 0.0))
    y = p[1] + w[:, 1] * (-b - root) / np.maximum(a, 1e-12)
    side = (q > 0.0) & (b < 0.0) & (b * b > a * q) & (y > FLOOR) & (y < top)
    return np.asarray(ball | side)


@pytest.mark.slow
def test_shadows_on_the_ground_are_those_of_rays(tab: Tab) -> None:
    tab.open(content())
    sums, normals, _ = drawn(tab, 0, 96, {"shape": "sphere"})
    found = sums[..., :3] / sums[..., 3:]
    values = np.float32(tab.page.evaluate(LIGHT))
    light = Environment(values.reshape(*MAP_SIZE[::-1], 4)[..., :3])
    height, width = 192, 384
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2.0 * np.pi * (np.arange(width) + 0.5) / width
    sine, (phi, cosine) = np.sin(theta)[:, None], np.meshgrid(phi, np.cos(theta))
    w = np.stack([sine * np.sin(phi), cosine, -sine * np.cos(phi)], -1).reshape(-1, 3)
    solid = np.broadcast_to(sine * np.pi / height * 2.0 * np.pi / width, phi.shape).ravel()
    above = w[:, 1] > 0.0
    w, weights = w[above], (solid * w[:, 1])[above]
    arriving = light.radiance(w) * weights[:, None]
    eye, ways = sights(SIZE)
    rows, columns = np.nonzero((normals[..., 3] == 0.0) & (ways[..., 1] < -0.15))
    errors, shades = [], []
    for k in np.random.default_rng(0).choice(len(rows), 40, replace=False):
        way = ways[rows[k], columns[k]]
        p = eye + way * (FLOOR - eye[1]) / way[1]
        away = np.clip((math.hypot(p[0], p[2]) - 1.0) / 13.0, 0.0, 1.0)
        distant = 1.0 - 0.5 * away * away * (3.0 - 2.0 * away)
        open_ = PAPER / math.pi * (arriving[~hidden(p, w)]).sum(0) * distant
        errors.append((found[rows[k], columns[k]] - open_) / open_)
        shades.append(open_[1] / distant)
    assert np.ptp(shades) > 0.1  # some of these places are in the shade
    assert np.abs(np.mean(errors)) < 0.01
    assert np.sqrt(np.mean(np.square(errors))) < 0.05


def test_the_ball_stands_on_its_base_before_the_ground(tab: Tab) -> None:
    tab.open(content())
    _, normals, points = drawn(tab, 0, 1, {"shape": "ball"})
    kinds = normals[..., 3]
    assert set(np.unique(kinds)) == {0.0, 1.0, 2.0}
    rows = [np.nonzero(kinds == kind)[0].mean() for kind in (2.0, 1.0)]
    assert rows[0] < rows[1]
    radii = np.linalg.norm(points[kinds == 1.0][:, :3], axis=1)
    assert 0.85 < radii.min() < 0.88
    assert radii.max() < 1.001


def test_a_sketch_comes_first_and_nothing_is_ever_blank(tab: Tab) -> None:
    tab.open(content())
    steps = tab.page.evaluate(
        """async () => {
          const { renderer, mode } = window.page, { gl, canvas } = renderer, found = [];
          window.page.loop = () => {};
          await new Promise((done) => setTimeout(done, 50));
          renderer.resize(64, 48);
          for (let k = 0; k < 5; k++) {
            if (k === 3) window.page.controls.set("shape", "knot");
            mode.draw();
            const pixel = new Uint8Array(4);
            gl.bindFramebuffer(gl.FRAMEBUFFER, null);
            gl.readPixels(1, 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
            found.push([canvas.width, renderer.frames, pixel[1] > 20 && pixel[3] === 255]);
          }
          return found;
        }"""
    )
    widths_and_frames = [(32, 1), (64, 1), (64, 2), (32, 1), (64, 1)]
    assert steps == [[width, frames, True] for width, frames in widths_and_frames]


@pytest.mark.slow
def test_a_first_picture_is_close_to_the_converged_one(tab: Tab) -> None:
    tab.open(content())
    pictures = []
    for frames, size in ((4, SIZE), (255, SIZE)):
        drawn(tab, 2, frames, {"shape": "ball", "film": True})
        pictures.append(shown(tab, size))
    error = np.mean((pictures[0] - pictures[1]) ** 2)
    assert -10.0 * math.log10(error) > 32.0


@pytest.mark.slow
def test_what_is_converged_is_shown_as_it_is(tab: Tab) -> None:
    """The filter has faded, and the film curve leaves middle tones where they are."""
    tab.open(content())
    small = 24, 20
    sums, _, _ = drawn(tab, 0, 120, {"shape": "ball", "film": True}, small)
    exposed = sums[..., :3] / sums[..., 3:] * tab.page.evaluate(GAIN)
    offset = np.minimum(exposed.min(-1), 0.08)
    toned = exposed - (offset - 6.25 * offset**2)[..., None]
    middle = toned.max(-1) < 0.75
    assert middle.mean() > 0.5
    encoded = np.where(toned < 0.0031308, 12.92 * toned, 1.055 * toned ** (1 / 2.4) - 0.055)
    assert np.abs(shown(tab, small) - encoded)[middle].max() < 1.5 / 255.0


@pytest.mark.slow
def test_exposure_suits_the_material_but_leaves_it_its_kind(tab: Tab) -> None:
    tab.open(content())
    gains = []
    for material in (0, 1):
        drawn(tab, material, 1, {"shape": "sphere"}, (16, 16))
        gains.append(tab.page.evaluate(GAIN))
    assert 0.6 <= gains[0] < 1.2
    assert 1.3 * gains[0] < gains[1] <= 1.7001
    # A turned or brighter light, or another shape, does not change it.
    drawn(tab, 0, 1, {"shape": "knot", "rotation": 2.0, "exposure": 4.0}, (16, 16))
    assert tab.page.evaluate(GAIN) == gains[0]


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["cloth", "knot"])
def test_other_shapes_stand_there_too(tab: Tab, shape: str) -> None:
    tab.open(content())
    sums, normals, points = drawn(tab, 0, 2, {"shape": shape})
    assert np.isfinite(sums).all()
    assert (sums[..., 3] == sums[0, 0, 3]).all()
    low = points[normals[..., 3] == 1.0][:, 1].min()
    assert low > FLOOR - 0.01
