"""Views that are shared, kept and taken back: addresses, saved pictures, keys, undo."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from nacre.mitsuba.environment import Environment
from nacre.mitsuba.studio import studio
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.oracles.runners import browser
from tests.variants import require_mitsuba
from tests.viewer.tab import Tab, page

FRAMES = 3
SIZE = 96, 72
DRAWN = """async ([frames, size]) => {
  const { renderer, mode } = window.page;
  window.page.loop = () => {};
  await new Promise((done) => setTimeout(done, 50));
  renderer.resize(...size);
  while (renderer.frames < frames) mode.draw();
  const { gl, canvas: { width, height } } = renderer, found = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, found);
  return [...found];
}"""
ADDRESS = "window.page.address.href"
HOSTILE = (
    "#shape=__proto__&light=constructor&exposure=1e999&turn=NaN,1&lamp=-7&at=9,-9,9&rotation=7e5"
    "&mode=toString&material=%00%ff&curve=<img src=x onerror=alert(1)>&constructor=1&split=x&%=%"
    + "x"
    * 9000
)


@cache
def content() -> bytes:
    entries = [
        Entry("Gray plastic", {"ggx": EXAMPLES["ggx"], "OpenPBR": EXAMPLES["openpbr"]}),
        Entry("Gray plastic", {"gltf": EXAMPLES["gltf"]}),
        Entry("Painted metal", {"openpbr": EXAMPLES["openpbr"]}, "Standard"),
    ]
    room = Environment(np.ones((8, 16, 3), np.float32), "white room")
    return page("Shared", entries, [studio(64), room])


@pytest.fixture
def shown(tab: Tab) -> Tab:
    tab.open(content())
    return tab


def drawn(tab: Tab) -> Any:
    return np.array(tab.page.evaluate(DRAWN, [FRAMES, SIZE]))


def reopened(tab: Tab, address: str) -> None:
    tab.page.goto("about:blank")
    tab.page.goto(address)
    tab.wait("window.page && window.page.renderer.frames > 0")


def change_much(tab: Tab) -> None:
    tab.page.evaluate(
        """() => {
          const { controls } = window.page;
          window.page.choose(1);
          controls.set("shape", "knot");
          controls.set("light", "white room");
          controls.set("rotation", 40);
          controls.set("exposure", -0.7);
          controls.set("lamp", 1.5);
          controls.set("at", [0.30000001, 0.654321]);
          controls.set("turn", [33.3333333, -12.3456789]);
        }"""
    )


def test_an_address_reopens_the_view_to_the_pixel(shown: Tab) -> None:
    plain = drawn(shown)
    change_much(shown)
    before = drawn(shown)
    address = shown.page.evaluate(ADDRESS)
    assert "shape=knot" in address
    assert "material=Gray+plastic~2" in address
    assert shown.page.url == address
    reopened(shown, address)
    assert shown.page.evaluate(ADDRESS) == address
    assert (drawn(shown) == before).all()
    assert (before != plain).mean() > 0.2


@pytest.mark.slow
def test_a_comparison_is_in_the_address(shown: Tab) -> None:
    shown.page.get_by_role("tab", name="Compare").click()
    shown.page.get_by_role("combobox", name="Other").select_option("Painted metal")
    shown.page.evaluate("window.page.mode.slide(0.25); window.page.mode.turnTo('Difference')")
    before = drawn(shown)
    address = shown.page.evaluate(ADDRESS)
    assert "mode=compare" in address
    reopened(shown, address)
    assert (drawn(shown) == before).all()
    assert shown.page.evaluate("[page.mode.view, page.mode.wipe]") == ["Difference", 0.25]
    assert shown.page.evaluate(ADDRESS) == address


@pytest.mark.slow
def test_hostile_addresses_do_nothing_bad(shown: Tab) -> None:
    reopened(shown, shown.page.url + HOSTILE)
    values = shown.page.evaluate("window.page.controls.values")
    assert values["shape"] == "ball"
    assert values["light"] == "studio"
    assert values["rotation"] == 180
    assert values["lamp"] == 0
    assert values["turn"] == [0, 0]
    assert shown.page.evaluate("document.getElementById('trouble').textContent") == ""
    assert shown.page.locator("img[onerror]").count() == 0


def test_the_address_follows_once_nothing_changes(shown: Tab) -> None:
    shown.page.evaluate(
        """() => {
          window.replaced = 0;
          const replace = history.replaceState.bind(history);
          history.replaceState = (...more) => { window.replaced += 1; replace(...more); };
          for (let k = 0; k < 50; k++) window.page.controls.set("turn", [k, 0]);
        }"""
    )
    shown.wait("location.hash === '#turn=49,0'")
    assert shown.page.evaluate("window.replaced") == 1
    shown.page.evaluate("location.hash = '#exposure=1'")
    shown.wait("window.page.renderer.scene.exposure === 2")
    assert shown.page.evaluate("window.page.controls.values.turn") == [0, 0]


@pytest.mark.slow
def test_keys_change_what_is_shown_and_undo_takes_it_back(shown: Tab) -> None:
    page = shown.page
    keys = page.keyboard
    for key in ("3", "s", "l", "e", "E", "E"):
        keys.press(key)
        page.wait_for_timeout(20)
    state = page.evaluate("window.page.state()")
    assert state == {
        "material": "Painted metal",
        "shape": "cloth",
        "light": "white room",
        "exposure": "-0.333",
    }
    keys.press("ArrowLeft")
    assert page.evaluate("window.page.chosen === window.page.materials.list[1]")
    page.evaluate("window.page.address.settle()")
    keys.press("m")
    assert page.evaluate("window.page.mode.title") == "Compare"
    keys.press("z")
    assert page.evaluate("window.page.mode.title") == "Look"
    keys.press("z")
    assert page.evaluate("window.page.state()") != {}
    for _ in range(9):
        keys.press("z")
    assert page.evaluate("window.page.state()") == {}
    assert page.locator("#said").inner_text() == "Nothing to undo"
    # Nothing happens while something is typed, or with the browser's own shortcuts.
    page.get_by_label("Search").fill("")
    keys.press("3")
    page.get_by_label("Search").fill("")
    page.locator("#picture").focus()
    keys.press("Control+s")
    assert page.evaluate("window.page.state()") == {}
    keys.press("?")
    assert page.get_by_role("dialog").is_visible()
    assert "Copy a link" in page.get_by_role("dialog").inner_text()
    keys.press("Escape")
    assert not page.get_by_role("dialog").is_visible()


def test_a_link_is_copied_or_shown(shown: Tab) -> None:
    shown.page.evaluate(
        """() => Object.defineProperty(navigator, "clipboard", { configurable: true,
          value: { writeText: async (text) => void (window.copied = text) } })"""
    )
    shown.page.get_by_role("button", name="Copy link").click()
    shown.wait("document.getElementById('said').textContent === 'Link copied'")
    assert shown.page.evaluate("window.copied === location.href")
    shown.page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined })")
    shown.page.keyboard.press("c")
    field = shown.page.get_by_label("Link to this view")
    field.wait_for()
    assert field.input_value() == shown.page.url


def saved(tab: Tab, name: str, path: Path) -> Path:
    with tab.page.expect_download() as waiting:
        tab.page.get_by_role("button", name=name).click()
    assert waiting.value.suggested_filename.startswith("Gray plastic.")
    waiting.value.save_as(path)
    return path


def test_a_saved_picture_is_the_one_shown_above_its_caption(shown: Tab, tmp_path: Path) -> None:
    pixels = drawn(shown).reshape(SIZE[1], SIZE[0], 4)[::-1]
    with Image.open(saved(shown, "Save picture", tmp_path / "x.png")) as image:
        found = np.asarray(image.convert("RGB"))
    assert (found[: SIZE[1]] == pixels[..., :3]).all()
    below = found[SIZE[1] :]
    assert (below == 255).mean() > 0.5
    assert below.min() < 100


def test_a_saved_exr_holds_the_light(shown: Tab, tmp_path: Path) -> None:
    mi = require_mitsuba()
    drawn(shown)
    sums = shown.page.evaluate("window.encoded(window.page.renderer.sums())")
    wanted = browser.floats(sums).reshape(SIZE[1], SIZE[0], 4)[::-1]
    path = saved(shown, "Save EXR", tmp_path / "x.exr")
    bitmap = mi.Bitmap(str(path))
    assert bitmap.pixel_format() == mi.Bitmap.PixelFormat.RGBA
    found = np.array(bitmap)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, wanted / wanted.max(axis=(0, 1))[3])
