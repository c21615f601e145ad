"""The plot and the surface of a lobe show what nacre says of the material."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.analytic.lambert import Lambert
from nacre.brdf import Brdf
from nacre.figures.lobes import lobe
from nacre.geometry import from_spherical, join
from nacre.metrics.physics import albedo
from nacre.mitsuba.environment import Environment
from nacre.viewer.content import Entry
from tests.mitsuba.reflectances import network
from tests.viewer.tab import Tab, page

MATERIALS: dict[str, Brdf] = {
    "network": network(3, isotropic=False),
    "glossy": Ggx(diffuse=(0.2, 0.1, 0.05), specular=(0.3, 0.5, 0.7), roughness=0.12),
    "diffuse": Lambert(diffuse=(0.5, 0.5, 0.5)),
}
NAMES = list(MATERIALS)
EDGE = 160  # pixels of the picture: software draws it
SCALE = 0.9  # of the unit sphere in half of it


@pytest.fixture(scope="module")
def lobes(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    """One page for all of these tests: each chooses what it needs."""
    sky = Environment(np.ones((16, 32, 3), np.float32))
    entries = [Entry(name, {"As it is": brdf}) for name, brdf in MATERIALS.items()]
    with Tab(chromium, tmp_path_factory.mktemp("lobes")) as tab:
        tab.open(page("Lobes", entries, [replace(sky, name="sky")]))
        tab.page.evaluate(f"window.page.renderer.resize({EDGE}, {EDGE})")
        tab.page.click("#tab-lobes")
        yield tab


def choose(tab: Tab, name: str, theta: float, phi: float, **settings: Any) -> dict[str, Any]:
    """Show a material with the light somewhere; what is plotted then."""
    found: dict[str, Any] = tab.page.evaluate(
        """([material, theta, phi, settings]) => {
            const { page } = window, { mode } = page;
            page.choose(material);
            mode.move({ theta, phi });
            mode.set(settings);
            mode.draw();
            const { plane, around, polar } = mode;
            const some = (values) => [...values.filter((_, k) => Math.floor(k / 3) % 17 === 0)];
            return {
                angles: [...plane.angles], rgb: [...plane.rgb],
                directions: some(around.directions), values: some(around.rgb),
                albedo: around.albedo(around.rgb), peak: mode.peak,
                paths: polar.curves.map((curve) => curve.getAttribute("d")),
            };
        }""",
        [NAMES.index(name), theta, phi, settings],
    )
    return {
        key: value if key == "paths" else np.array(value, np.float64)
        for key, value in found.items()
    }


def same(found: np.ndarray, brdf: Brdf, wi: np.ndarray, wo: np.ndarray) -> None:
    """Values are those of a material, but where the half vector is the normal.

    There an anisotropic network is many-valued, and rounding decides.
    """
    known = np.hypot(*(wi + wo).T[:2]) > 1e-3
    assert known.mean() > 0.8
    expected = brdf.eval(wi, wo)
    np.testing.assert_allclose(found.reshape(-1, 3)[known], expected[known], rtol=5e-4, atol=1e-3)


@pytest.mark.parametrize("name", ["network", "glossy"])
@pytest.mark.parametrize("degrees", [(0.0, 0.0), (50.0, -70.0), (85.0, 160.0)])
def test_values_are_those_of_the_material(lobes, name, degrees):
    brdf, (theta, phi) = MATERIALS[name], np.radians(degrees)
    found = choose(lobes, name, theta, phi)
    wi = join(from_spherical(theta, phi))
    in_plane = join(from_spherical(found["angles"], phi + math.pi))
    same(found["rgb"], brdf, wi, in_plane)
    around = found["directions"].reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(around, axis=1), 1.0, atol=1e-6)
    same(found["values"], brdf, wi, around)


def test_the_plot_is_as_high_as_the_figure(lobes):
    drawn = lobe(MATERIALS["glossy"], math.radians(50.0), math.radians(40.0))
    found = choose(lobes, "glossy", math.radians(50.0), math.radians(-140.0), cosine=False)
    assert found["peak"] == pytest.approx(drawn.rgb.max(), rel=2e-3)
    found = choose(lobes, "glossy", math.radians(50.0), math.radians(-140.0), cosine=True)
    assert found["peak"] == pytest.approx(drawn.intensity().max(), rel=2e-3)
    for channel in range(3):
        line = np.interp(drawn.theta, found["angles"], found["rgb"][channel::3])
        np.testing.assert_allclose(line, drawn.rgb[:, channel], rtol=0.02)


@pytest.mark.parametrize("scale", ["linear", "root", "log"])
def test_curves_are_where_the_scale_puts_their_values(lobes, scale):
    theta = math.radians(30.0)
    found = choose(lobes, "glossy", theta, 0.0, cosine=False, scale=scale)
    part = found["rgb"].reshape(-1, 3) / found["rgb"].max()
    radius = {"linear": part, "root": part**0.5, "log": np.log(1 + 999 * part) / np.log(1000)}
    for channel, path in enumerate(found["paths"]):
        x, y = np.array([p.split(",") for p in re.split("[ML]", path)[1:]], np.float64).T
        x, y = (x - 160.0) / 122.0, (142.0 - y) / 122.0
        np.testing.assert_allclose(np.hypot(x, y), radius[scale][:, channel], atol=2e-4)
        np.testing.assert_allclose(
            x, radius[scale][:, channel] * np.sin(found["angles"]), atol=2e-4
        )


@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_all_reflected_light_is_the_albedo(lobes, degrees):
    expected = albedo(MATERIALS["glossy"], math.radians(degrees))
    found = choose(lobes, "glossy", math.radians(degrees), 0.7)
    bound = 4.0 * expected.error + 2e-3
    assert (np.abs(found["albedo"] - expected.value) < bound).all()


def silhouette(tab: Tab, elevation: float) -> np.ndarray:
    """Where the gray surface is seen from an elevation above its plane, bool (EDGE, EDGE)."""
    from PIL import Image

    png = tab.page.evaluate(
        """(elevation) => {
            const { page } = window;
            const [c, s] = [Math.cos(elevation - 0.5), Math.sin(elevation - 0.5)];
            page.scene({ turn: [1, 0, 0, 0, c, s, 0, -s, c] });
            page.mode.draw();
            return document.getElementById("picture").toDataURL();
        }""",
        elevation,
    )
    picture = Image.open(io.BytesIO(base64.b64decode(png.split(",")[1]))).convert("RGB")
    pixels = np.asarray(picture, np.int32)
    return (np.ptp(pixels, axis=2) < 24) & (pixels.min(axis=2) > 60)


@pytest.mark.parametrize("channels", [False, True])
def test_a_constant_is_a_hemisphere_and_lambert_s_law_a_sphere(lobes, channels):
    settings = {"scale": "linear", "channels": channels}
    choose(lobes, "diffuse", math.radians(80.0), 0.0, cosine=False, **settings)
    reach = SCALE * EDGE / 2
    assert silhouette(lobes, math.pi / 2).sum() == pytest.approx(math.pi * reach**2, rel=0.02)
    choose(lobes, "diffuse", math.radians(80.0), 0.0, cosine=True, **settings)
    seen = silhouette(lobes, 0.0).sum()
    assert seen == pytest.approx(math.pi * (0.5 * reach) ** 2, rel=0.03)


@pytest.mark.slow
def test_the_light_follows_the_lamp_and_the_keys(lobes):
    page = lobes.page
    page.click("#tab-look")
    page.evaluate("window.page.controls.move(0.5, 0)")
    page.click("#tab-lobes")
    light = page.evaluate("window.page.mode.light")
    assert math.degrees(light["theta"]) == pytest.approx(30.0, abs=0.01)
    assert light["phi"] == pytest.approx(0.0, abs=1e-6)
    page.focus(".ray.light")
    page.keyboard.press("ArrowLeft")
    page.focus("label:has-text('φᵢ') input")
    page.keyboard.press("ArrowRight")
    page.focus(".ray.view")
    before = page.get_attribute(".ray.view", "aria-valuenow")
    page.keyboard.press("ArrowRight")
    lobes.wait("!window.page.mode.old")
    light = page.evaluate("window.page.mode.light")
    assert math.degrees(light["theta"]) == pytest.approx(31.0, abs=0.01)
    assert math.degrees(light["phi"]) == pytest.approx(1.0, abs=0.01)
    assert page.get_attribute(".ray.light", "aria-valuenow") == "31"
    assert int(page.get_attribute(".ray.view", "aria-valuenow")) == int(before) + 1
    page.focus(".handle")
    page.keyboard.press("ArrowDown")
    lower = page.evaluate("window.page.mode.light")
    assert lower["theta"] > light["theta"]
    page.click("#tab-look")
    toward = join(from_spherical(lower["theta"], lower["phi"]))
    lamp = np.array(page.evaluate("window.page.renderer.scene.lamp"))[:3]
    np.testing.assert_allclose(lamp / np.linalg.norm(lamp), toward, atol=1e-6)
    assert page.locator(".handle").is_hidden()


@pytest.mark.slow
def test_the_light_is_dragged_in_the_plot_and_on_the_picture(lobes):
    page = lobes.page
    page.click("#tab-lobes")
    choose(lobes, "glossy", 0.3, -0.5 * math.pi)
    box = page.locator(".polar").bounding_box()
    unit = box["width"] / 320
    middle = box["x"] + 160 * unit, box["y"] + 142 * unit
    knob = page.locator(".ray.light circle").bounding_box()
    page.mouse.move(knob["x"] + knob["width"] / 2, knob["y"] + knob["height"] / 2)
    page.mouse.down()
    page.mouse.move(middle[0] - 80 * unit * math.sin(1.0), middle[1] - 80 * unit * math.cos(1.0))
    page.mouse.up()
    assert page.evaluate("window.page.mode.light.theta") == pytest.approx(1.0, abs=0.02)
    lobes.wait("!window.page.mode.old && !window.page.mode.turned")
    page.locator(".handle").hover()
    page.mouse.down()
    knob = page.locator(".handle").bounding_box()
    page.mouse.move(knob["x"] + knob["width"] / 2 + 30, knob["y"] + knob["height"] / 2)
    page.mouse.up()
    lobes.wait("!window.page.mode.old && !window.page.mode.turned")
    moved = page.locator(".handle").bounding_box()
    assert moved["x"] > knob["x"] + 10
    lobes.keep("lobes")
