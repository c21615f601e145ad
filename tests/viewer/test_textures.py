"""Encoded textures on the page: pictures against what nacre decodes, and the mode's controls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.errors import NacreError
from nacre.mitsuba.studio import studio
from nacre.targets.textures import TextureAtlas
from nacre.targets.textures.accuracy import mean_squared_error
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.latent_map import LatentMap, NeuralBtf
from nacre.textures.limit import Rate, limited
from nacre.textures.mipmap import filtered_reflectance, level_shapes
from nacre.viewer.content import Content, Entry
from nacre.viewer.cosines import Cosines, differences
from nacre.viewer.textures import LARGEST, RESOLUTION, PageTexture, Rounded
from tests.analytic.materials import EXAMPLES
from tests.oracles.runners import browser
from tests.specimens.tables import mbsdf_file
from tests.targets import made_texture
from tests.variants import require_mitsuba
from tests.viewer.tab import Tab
from tests.viewer.test_page import AXE

HOSTILE = "<b>cloth</b>"
SIZE = 96
SCALE, EDGE, RADIUS = 0.97, 1.36, 0.6  # of all shapes, of the plane, of the cylinder
ASPECT = made_texture.WIDTH / made_texture.HEIGHT

RENDER = """async ([chosen, view, scene, size]) => {
  const { renderer, modes } = window.page, mode = modes.find((each) => each.title === "Textures");
  window.page.loop = () => {};
  window.page.open(mode);
  mode.follow("still");
  await mode.choose(chosen);
  renderer.change({ still: true, irradiance: [Math.PI, Math.PI, Math.PI], ...scene });
  renderer.resize(size, size);
  mode.textured.change({ repeats: 1, zoom: 1, depth: 1, tilt: 0, ...view });
  mode.textured.frame();
  return window.encoded(renderer.read(mode.textured.latest));
}"""


@cache
def content() -> bytes:
    held = Content([studio()])
    held.add(Entry("Gray plastic", {"ggx": EXAMPLES["ggx"]}))
    texture = made_texture.texture()
    held.add_texture(texture)
    latent = texture.latent
    named = LatentMap(latent.codes, latent.codec, latent.wi, latent.wo, HOSTILE)
    held.add_texture(NeuralBtf(named), made_texture.heights(), {"Source": HOSTILE})
    return held.page("Textures")


def turned(azimuth: float, elevation: float) -> Floats:
    """A rotation about +y, then about +x, in radians, shape (3, 3)."""
    c, s, d, t = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([[c, 0, s], [s * t, d, -c * t], [-s * d, t, c * d]])


@pytest.fixture(scope="module")
def shown(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """The page, for pictures that tests ask for."""
    with Tab(chromium, tmp_path_factory.mktemp("textures")) as opened:
        opened.open(content())
        yield opened


def shot(
    tab: Tab, chosen: int, view: dict[str, Any], turn: Floats, light: Floats, w: float = 0.0
) -> Floats:
    """The page's picture, shape (SIZE, SIZE, 4), the lowest row first: radiance and coverage. The
    light has irradiance pi: from a direction, or at distance 1 of a place if `w` is 1.
    """
    scene = {"turn": turn.T.ravel().tolist(), "lamp": [*light.tolist(), w]}
    found = tab.page.evaluate(RENDER, [chosen, view, scene, SIZE])
    return browser.floats(found).reshape(SIZE, SIZE, 4)


def pixels() -> tuple[Floats, Floats]:
    """Places of the middles of pixels at zoom 1, in radii of shapes."""
    axis = ((np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0) / SCALE
    y, x = np.meshgrid(axis, axis, indexing="ij")
    return x, y


def on_plane(turn: Floats) -> tuple[Floats, Floats]:
    """Texture coordinates (SIZE, SIZE, 2) of a turned plane, and which pixels lie within it."""
    place = np.einsum("ij,jkl->ikl", np.linalg.inv(turn[:2, :2]), np.stack(pixels()))
    u, v = place[0] / EDGE + 0.5, 0.5 - place[1] / EDGE
    margin = 0.02
    inside = (np.minimum(u, v) > margin) & (np.maximum(u, v) < 1.0 - margin)
    # The texture keeps its proportion, so that it does not end where the square does.
    return np.stack([u, v * ASPECT], axis=-1), inside


def between(values: Floats, uv: Floats) -> Floats:
    """Values (height, width, k) of texels that repeat, between their middles, shape (..., k)."""
    height, width = values.shape[:2]
    x, y = uv[..., 0] * width - 0.5, uv[..., 1] * height - 0.5
    low = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((*uv.shape[:-1], values.shape[2]))
    for right in (0, 1):
        for down in (0, 1):
            part = np.abs(1 - right - (x - low[0])) * np.abs(1 - down - (y - low[1]))
            texel = values[(low[1] + down) % height, (low[0] + right) % width]
            total += part[..., None] * texel
    return total


def decoded(wi: Floats, wo: Floats) -> Floats:
    """The texture's reflectance factors at one pair of directions, shape (height, width, 3)."""
    texture = made_texture.texture()
    return texture.at_directions(wi[None], wo[None]).images(slice(None))[0]


def unit(*w: float) -> Floats:
    return np.asarray(np.array(w) / np.linalg.norm(w), np.float32)


def rmse(found: Floats, expected: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(found - expected))))


TURNS = {"upright": (0.0, 0.0), "turned": (0.7, 0.0), "tilted": (-0.3, 0.6)}


@pytest.mark.parametrize("name", TURNS)
def test_a_plane_shows_what_codes_decode_to(shown: Tab, name: str) -> None:
    turn, light = turned(*TURNS[name]), unit(-0.4, 0.5, 0.8)
    found = shot(shown, 0, {"shape": "plane"}, turn, light)
    uv, inside = on_plane(turn)
    assert (found[inside, 3] == 1.0).all()
    wi, wo = (np.asarray(turn.T @ w, np.float32) for w in (light, unit(0, 0, 1)))
    expected = between(decoded(wi, wo), uv)[inside] * wi[2]
    assert rmse(found[inside, :3], expected) < 0.006  # of a deviation of 0.03 to 0.07


def test_relief_is_met_where_a_render_meets_it(shown: Tab) -> None:
    mi = require_mitsuba()
    from nacre.mitsuba.textures.relief import Relief

    turn, light = turned(0.8, 0.3), unit(0.2, 0.5, 0.8)
    uv, inside = on_plane(turn)
    wi, wo = (np.asarray(turn.T @ w, np.float32) for w in (light, unit(0, 0, 1)))
    heights = made_texture.heights()
    field = Relief(mi, heights.heights, heights.depth, ASPECT)
    met = field.seen(mi.Point2f(*(mi.Float(uv[inside, k]) for k in (0, 1))), [*map(float, wo)])
    seen = np.stack([np.array(met.x), np.array(met.y)], axis=-1)
    found = shot(shown, 1, {"shape": "plane"}, turn, light)[inside, :3]
    expected = between(decoded(wi, wo), seen) * wi[2]
    flat = between(decoded(wi, wo), uv[inside]) * wi[2]
    assert rmse(found, expected) < 0.005 < rmse(found, flat)


def test_a_cylinder_shows_what_codes_decode_to_by_a_lamp(shown: Tab) -> None:
    lamp = np.array([-1.2, 0.7, 2.0])
    found = shot(shown, 0, {"shape": "cylinder"}, np.eye(3), lamp, 1.0)
    x, y = pixels()
    inside = (np.abs(x) < 0.9 * RADIUS) & (np.abs(y) < 0.7)
    chosen = np.random.default_rng(3).permutation(np.flatnonzero(inside))[:150]
    x, y = x.ravel()[chosen], y.ravel()[chosen]
    phi = np.arcsin(x / RADIUS)
    around, zero = 2.0 * math.pi * RADIUS, np.zeros_like(x)
    across = round(around / EDGE)
    down = across * 1.5 / around * ASPECT
    uv = np.stack([(phi / (2.0 * math.pi) + 0.5) * across, (0.5 - y / 1.5) * down], axis=-1)
    # Rows are the tangent, the vertical and the normal of each point.
    frames = np.array([[np.cos(phi), zero, -np.sin(phi)], [zero, zero + 1, zero],
                       [np.sin(phi), zero, np.cos(phi)]]).transpose(2, 0, 1)  # fmt: skip
    way = np.einsum("nij,nj->ni", frames, lamp - np.stack([x, y, RADIUS * np.cos(phi)], axis=-1))
    squared = np.square(way).sum(axis=1, keepdims=True)
    wi = np.asarray(way / np.sqrt(squared), np.float32)
    wo = np.asarray(frames @ unit(0, 0, 1), np.float32)
    latent = made_texture.texture().latent
    codes = latent.codes.reshape(-1, latent.codes.shape[2]).astype(np.float32)
    values = on_all_cores(latent.codec, latent.codec.decoder(wi, wo))(codes)
    each = values.reshape(made_texture.HEIGHT, made_texture.WIDTH, len(chosen), 3)
    factors = np.stack([between(each[:, :, k], uv[k]) for k in range(len(chosen))])
    expected = np.where(wi[:, 2:] > 0.0, factors * wi[:, 2:], 0.0) / squared
    assert rmse(found.reshape(-1, 4)[chosen, :3], expected) < 0.002 < 0.05 * expected.std()


def test_the_tilt_leans_a_surface_back(shown: Tab) -> None:
    """As if it had been turned about the horizontal axis, before it is turned by hand."""
    light = unit(-0.4, 0.5, 0.8)
    found = shot(shown, 0, {"tilt": 40}, turned(0.7, 0.0), light)
    expected = shot(shown, 0, {}, turned(0.7, 0.0) @ turned(0.0, -math.radians(40)), light)
    assert rmse(found, expected) < 1e-4 < rmse(found, shot(shown, 0, {}, turned(0.7, 0.0), light))


@pytest.mark.parametrize("level", [1, 2])
def test_far_textures_show_means(shown: Tab, level: int) -> None:
    """At distances where a pixel is as wide as two texels, and as a single texel of all."""
    wi, wo = unit(-0.4, 0.5, 0.8), unit(0, 0, 1)
    levels = filtered_reflectance(made_texture.texture().latent, wi[None], wo[None])
    repeats = 2.0**level * SIZE * SCALE * EDGE / 2.0 / made_texture.WIDTH
    found = shot(shown, 0, {"shape": "plane", "repeats": repeats}, np.eye(3), wi)
    uv, inside = on_plane(np.eye(3))
    expected = between(levels[level - 1][:, :, 0], repeats * uv)[inside] * wi[2]
    assert rmse(found[inside, :3], expected) < 0.006


def test_bytes_stand_for_numbers() -> None:
    values = np.random.default_rng(1).normal(0.0, [[0.01, 1.0, 100.0]], (500, 3))
    rounded = Rounded.of(np.asarray(values, np.float32), np.full(3, 0.05))
    assert (np.abs(rounded.numbers - values) <= 0.5 * rounded.step + 1e-4).all()
    assert rounded.step[0] == np.float32(0.05)
    assert rounded.step[2] == pytest.approx(np.ptp(values[:, 2]) / 255.0)


def test_cosines_stand_for_functions() -> None:
    size, steps = 5, np.array([1e-3, 0.1, 1e-9], np.float32)
    functions = np.random.default_rng(2).normal(0.0, 1.0, (size**4, 3)).astype(np.float32)
    cosines = Cosines.of(functions, steps)
    assert cosines.step[:2].tolist() == steps[:2].tolist()  # the last would not fit two bytes
    difference = cosines.numbers - functions
    # An orthonormal transform keeps the error, which is uniform within a step.
    assert np.sqrt(np.mean(difference**2, axis=0)) == pytest.approx(
        cosines.step / math.sqrt(12.0), rel=0.1, abs=1e-6
    )
    low, high = np.frombuffer(cosines.tobytes(), np.uint8).reshape(2, 3, -1).astype(int)
    folded = low + 256 * high
    values = np.where(folded & 1, -1 - (folded >> 1), folded >> 1)
    order = np.argsort(np.indices((size,) * 4).sum(axis=0).ravel(), kind="stable")
    assert (values == cosines.values.reshape(3, -1)[:, order]).all()


@pytest.mark.parametrize(("height", "width"), [(1, 1), (1, 7), (5, 7), (8, 4)])
def test_levels_are_found_again_from_differences(height: int, width: int) -> None:
    shapes = level_shapes(height, width)
    count = sum(math.prod(shape) for shape in shapes)
    levels = np.random.default_rng(3).integers(0, 256, (2, count)).astype(np.uint8)
    found, start, before = differences(levels, shapes), 0, None
    for rows, columns in shapes:
        for y in range(rows):
            for x in range(columns):
                at = start + y * columns + x
                mean = np.zeros(2, int)
                if before is not None:
                    last_rows, last_columns, first = before
                    for row in (2 * y, 2 * y + 1):
                        for column in (2 * x, 2 * x + 1):
                            row, column = min(row, last_rows - 1), min(column, last_columns - 1)
                            mean += levels[:, first + row * last_columns + column]
                    mean = (mean + 2) // 4
                assert ((found[:, at] + mean) % 256 == levels[:, at]).all()
        before, start = (rows, columns, start), start + rows * columns


@pytest.mark.slow
def test_bytes_and_fewer_functions_add_little_error() -> None:
    """To that of the grid of directions, which half floats of all functions have."""
    texture = made_texture.texture()
    latent = texture.latent
    exact = mean_squared_error(TextureAtlas.of(latent, RESOLUTION), latent)
    assert exact < PageTexture.of(texture).error < 3.0 * exact
    wi, wo = texture.wi[:5], texture.wo[:5]
    codes = latent.codec.encoder(wi, wo)(np.zeros((6, 5, 3), np.float32)).reshape(2, 3, -1)
    black = PageTexture.of(NeuralBtf(LatentMap(codes, latent.codec, wi, wo)))
    assert black.error < 1e-5


def test_what_no_page_holds_is_refused() -> None:
    wi = np.array([[0.0, 0.0, 1.0]], np.float32)
    with pytest.raises(NacreError, match="not encoded"):
        PageTexture.of(TableBtf(np.zeros((2, 2, 1, 3)), wi, wi))
    latent = made_texture.texture().latent
    wide = LatentMap(np.repeat(latent.codes[:1, :1], LARGEST + 1, 1), latent.codec, wi, wi, "wide")
    with pytest.raises(NacreError, match="wide: 2049 x 1 texels"):
        PageTexture.of(NeuralBtf(wide))


@pytest.mark.slow
@pytest.mark.parametrize("bytes_per_texel", [None, 8.0])
def test_a_page_of_three_textures_has_less_than_3_megabytes(bytes_per_texel: float | None) -> None:
    held = Content([studio()])
    for name in ("leather", "tweed", "wood"):
        texture = nacre.load(f"captured:{name}")
        assert (texture.width, texture.height) == (128, 128)
        if bytes_per_texel is not None:
            texture = NeuralBtf(limited(texture.latent, Rate(bytes_per_texel)))
        held.add_texture(texture)
    assert len(held.page("Textures")) < 3_000_000


@pytest.mark.slow
def test_the_mode_by_mouse_and_keys(tab: Tab) -> None:
    tab.open(content())
    tab.page.evaluate("window.page.renderer.resize(96, 96)")  # software draws it
    page, status = tab.page, "document.getElementById('status').textContent"
    page.get_by_role("tab", name="Textures").click()
    tab.wait(f"{status}.endsWith('a second')")
    page.get_by_role("button", name="Lamp").press("ArrowLeft")
    tab.wait(f"{status} === 'converged'")
    assert page.get_by_role("combobox", name="Lamp").input_value() == "still"
    assert not page.get_by_role("slider", name="Relief").is_visible()
    page.get_by_role("button", name=HOSTILE).press("Enter")
    assert page.get_by_role("slider", name="Relief").is_visible()
    assert page.get_by_role("heading", name=HOSTILE).is_visible()
    assert page.locator("#panels b").count() == 0
    for shape in ("cylinder", "cloth"):
        page.get_by_role("combobox", name="Surface").select_option(shape)
        tab.wait(f"{status} === 'converged'")
        tab.keep(f"textures-{shape}")
    page.get_by_role("tab", name="Look").click()
    assert page.get_by_role("heading", name="Gray plastic").is_visible()
    assert not page.get_by_role("button", name="Lamp").is_visible()
    tab.wait("window.page.renderer.frames > 0")


@pytest.mark.slow
def test_a_page_of_textures_alone(chromium: Any, tmp_path: Path) -> None:
    held = Content([studio()])
    held.add_texture(made_texture.texture())
    (tmp_path / "page.html").write_bytes(held.page("Alone"))
    size = 360, 740
    with Tab(chromium, tmp_path, size, reduced_motion="reduce", color_scheme="dark") as tab:
        tab.page.goto((tmp_path / "page.html").as_uri())
        tab.wait("window.page")
        tab.page.evaluate("window.page.renderer.resize(96, 96)")
        tab.wait("document.getElementById('status').textContent === 'converged'")
        assert tab.page.evaluate("document.documentElement.scrollWidth") <= size[0]
        tab.keep("textures-360-dark")
        if AXE.is_file():
            tab.page.evaluate(f"() => {{ {AXE.read_text('utf-8')} }}")
            found = tab.page.evaluate("() => axe.run()")
            assert [(each["id"], each["help"]) for each in found["violations"]] == []
        (tmp_path / "gray.mbsdf").write_bytes(mbsdf_file(4, 5))
        tab.page.locator("input[type=file]").set_input_files(tmp_path / "gray.mbsdf")
        tab.wait("window.page.renderer.frames > 0")
        assert tab.page.get_by_role("heading", name="gray").is_visible()
