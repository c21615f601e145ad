"""Comparisons on the page against nacre's own metrics."""

from __future__ import annotations

from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.figures.page import magma
from nacre.formats import load_brdf
from nacre.metrics import angular_errors, image_errors
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre.mitsuba.studio import studio
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.measured.support import material, tensor_bytes
from tests.specimens.tables import mbsdf_file
from tests.targets.test_kinds import network
from tests.tiers import tiered
from tests.viewer.tab import Tab, page
from tests.viewer.test_tables import merl_file

SIZE = 64
NETWORK, STANDARD = network(6, 21, 21, 3), EXAMPLES["openpbr"]
SMOOTH = network(6, 21, 21, 3, inputs="enhanced", activation="squared relu", scale=0.5)
MEASURED = "window.page.mode.measured.protocol"

FRAMES = """(change) => {
  const { renderer, mode } = window.page, { canvas, gl } = renderer;
  window.page.loop = () => {};
  window.page.scene(change);
  const bytes = {}, pixels = () => {
    const { width, height } = canvas, found = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, found);
    return [[height, width], [...found]];
  };
  while (renderer.frames < 4) mode.draw();
  renderer.frame = () => {};
  mode.measured.since = -Infinity;
  for (const button of mode.buttons) {
    button.click();
    mode.draw();
    bytes[button.textContent] = pixels();
  }
  return { bytes, here: mode.measured.here, map: [...mode.flip.read().map],
    sums: renderer.pictures.map((picture) => [...renderer.sums(picture)]) };
}"""


@cache
def content() -> bytes:
    entries = [
        Entry("Paint", {"Network": NETWORK, "OpenPBR": STANDARD}),
        Entry("Cloth", {"Network": SMOOTH, "OpenPBR": EXAMPLES["ggx"]}),
        Entry("Alone", {"Only": EXAMPLES["closures"]}),
    ]
    return page("Compare", entries, [studio()])


def opened(tab: Tab, whole: bytes) -> Tab:
    tab.open(whole)
    tab.page.evaluate(f"window.page.renderer.resize({SIZE}, {SIZE})")
    tab.page.get_by_role("tab", name="Compare").click()
    return tab


@pytest.fixture
def compare(tab: Tab) -> Tab:
    return opened(tab, content())


def select(tab: Tab, name: str) -> Any:
    return tab.page.get_by_role("combobox", name=name)


def chosen(tab: Tab) -> list[str]:
    """The reference and the other, in words."""
    return [
        select(tab, label).locator("option:checked").text_content()
        for label in ("Reference", "Other")
    ]


def check_numbers(tab: Tab, truth: Brdf, other: Brdf, rel: float) -> None:
    """The page's numbers are those of `nacre compare`."""
    tab.wait(MEASURED)
    found: dict[str, Any] = tab.page.evaluate(MEASURED)
    (a, mask), (b, _) = (render_sphere(each, DirectionalLight()) for each in (truth, other))
    wanted, _ = image_errors(a, b, mask)
    assert found["sphere"] == pytest.approx(asdict(wanted), rel=rel)
    assert found["angles"] == pytest.approx(asdict(angular_errors(truth, other)), rel=rel)


@pytest.mark.slow
def test_numbers_of_networks_and_formulas(compare: Tab) -> None:
    check_numbers(compare, NETWORK, STANDARD, 5e-5)
    select(compare, "Reference").select_option("Cloth, Network")
    select(compare, "Other").select_option("Paint, OpenPBR")
    check_numbers(compare, SMOOTH, STANDARD, 5e-5)


@pytest.mark.slow
def test_numbers_of_tables(tab: Tab, tmp_path: Path) -> None:
    files = {
        "gaps.binary": merl_file("<f4"),
        "warped.bsdf": tensor_bytes(material((0.0,))),
        "cells.mbsdf": mbsdf_file(5, 6),
    }
    tables = {}
    for name, whole in files.items():
        (tmp_path / name).write_bytes(whole)
        tables[name] = load_brdf(tmp_path / name)
    entries = [Entry(name, {"Table": brdf}) for name, brdf in tables.items()]
    opened(tab, page("Tables", [*entries, Entry("Network", {"Network": SMOOTH})], [studio()]))
    for name, brdf in tables.items():
        select(tab, "Reference").select_option(name)
        select(tab, "Other").select_option("Network")
        check_numbers(tab, brdf, SMOOTH, 2e-3)


@pytest.mark.slow
def test_pictures_and_their_numbers(compare: Tab) -> None:
    change = {"exposure": 1.5, "irradiance": [9, 8, 7], "shape": "cloth"}
    found = compare.page.evaluate(FRAMES, change)
    sums = [np.reshape(values, (SIZE, SIZE, 4)) for values in found["sums"]]
    count = sums[0][..., 3].max()
    truth, other = ((each[..., :3] / count * 1.5).astype(np.float32) for each in sums)
    errors, flip_map = image_errors(truth, other, sums[0][..., 3] > 0.0)
    assert found["here"] == pytest.approx(asdict(errors), rel=5e-5)
    shown_map = np.reshape(found["map"], (SIZE, SIZE, 4))[..., 0]
    np.testing.assert_allclose(shown_map, flip_map, atol=1e-3)

    views = {
        name: np.reshape(bytes_, (*size, 4)) for name, (size, bytes_) in found["bytes"].items()
    }
    pictures = [displayed(each, count) for each in sums]
    wipe = np.where(np.arange(SIZE)[:, None] < SIZE // 2, *pictures)
    difference = np.clip(4.0 * np.abs(tone_map(truth) - tone_map(other)), 0.0, 1.0)
    wanted = {"Wipe": (wipe, 1), "Difference": (difference, 1), "FLIP": (magma(flip_map), 4)}
    for name, (picture, off) in wanted.items():
        assert np.abs(views[name][..., :3] - 255.0 * picture).max() <= off, name
    lower, upper = np.split(views["Side by side"], 2)
    for quarter, picture in zip(np.split(upper, 2, axis=1), pictures, strict=True):
        assert np.abs(quarter[..., :3] - 255.0 * picture).max() <= 1.0
    assert (lower == np.hstack([views["Difference"], views["FLIP"]])).all()


def displayed(sums: Floats, count: float) -> Floats:
    """What screens show of sums: exposed, clipped, as sRGB, on the ground at the edge."""
    covered = sums[..., 3:] / count
    linear = np.clip(1.5 * sums[..., :3] / np.maximum(sums[..., 3:], 1.0), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return 0.1 + covered * (encoded - 0.1)


@pytest.mark.slow
def test_what_is_compared_follows_the_shelf(compare: Tab) -> None:
    assert chosen(compare) == ["Paint, Network", "Paint, OpenPBR"]
    shelf = compare.page.get_by_role("listbox", name="Materials")
    shelf.press("ArrowRight")
    assert chosen(compare) == ["Cloth, Network", "Cloth, OpenPBR"]
    compare.page.get_by_role("button", name="Swap").click()
    assert chosen(compare) == ["Cloth, OpenPBR", "Cloth, Network"]
    shelf.press("End")
    assert chosen(compare) == ["Alone", "Cloth, OpenPBR"]
    select(compare, "Other").select_option("Cloth, Network")
    shelf.press("Home")
    assert chosen(compare) == ["Paint, Network", "Cloth, Network"]
    compare.page.get_by_role("button", name="OpenPBR").click()
    assert chosen(compare) == ["Paint, OpenPBR", "Cloth, Network"]


CELLS = """[...document.querySelectorAll(".numbers tr")].map((row) =>
  [...row.cells].map((cell) => cell.textContent.trim()))"""
"""Texts of the table, read at once: the page makes its rows anew with every measurement."""


def test_a_material_equals_itself(compare: Tab) -> None:
    select(compare, "Other").select_option("Paint, Network")
    compare.wait(MEASURED)
    cells = compare.page.evaluate(CELLS)
    assert [row[-2:] for row in cells[1:6]] == [["1.000"] * 2, ["∞"] * 2, *[["0.000"] * 2] * 3]
    assert all(row[-1] == "0.000" for row in cells[6:])


@pytest.mark.slow
@pytest.mark.parametrize("scheme", tiered(["light", "dark"], ["light"]))
def test_narrow_windows(chromium: Any, tmp_path: Path, scheme: str) -> None:
    with Tab(chromium, tmp_path, (360, 740), color_scheme=scheme) as tab:
        opened(tab, content())
        for view in ("Wipe", "Side by side", "Difference", "FLIP"):
            tab.page.get_by_role("button", name=view).click()
            assert tab.page.evaluate("document.documentElement.scrollWidth") <= 360
            tab.page.evaluate("window.scrollTo(0, 0)")
            tab.keep(f"compare {view.lower()} {scheme}")


@pytest.mark.slow
def test_the_lamp_is_where_it_shines_in_every_view(compare: Tab) -> None:
    compare.page.locator("[data-control=lamp] input").fill("1")
    lamp, frame = compare.page.locator("#lamp"), compare.page.locator("#frame").bounding_box()
    for view, part in (("Wipe", 1.0), ("Side by side", 0.5), ("FLIP", 1.0)):
        compare.page.get_by_role("button", name=view, exact=True).click()
        compare.wait("!window.page.mode.stale")
        before, box = where(compare), lamp.bounding_box()
        assert np.allclose(before, place(box, frame, part), atol=0.01)
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        compare.page.mouse.move(x, y)
        compare.page.mouse.down()
        compare.page.mouse.move(x + 40, y + 20)
        compare.page.mouse.up()
        assert np.allclose(where(compare), place(lamp.bounding_box(), frame, part), atol=0.01)
        assert np.allclose(
            place(lamp.bounding_box(), frame, part)[0] - before[0],
            80 / (frame["width"] * part),
            atol=0.01,
        )


def where(tab: Tab) -> Floats:
    """The lamp's direction, right and up."""
    return np.array(tab.page.evaluate("window.page.renderer.scene.lamp.slice(0, 2)")) / 2.5


def place(box: dict[str, float], frame: dict[str, float], part: float) -> Floats:
    """Where a handle is on a picture at the upper left of a frame, from its middle in radii."""
    x, y = (box[a] + box[b] / 2 - frame[a] for a, b in (("x", "width"), ("y", "height")))
    half = part * frame["width"] / 2
    return np.array([x / half - 1.0, 1.0 - y / half]) / 0.97


@pytest.mark.slow
def test_keys_and_pointer_move_the_wipe(compare: Tab) -> None:
    handle = compare.page.get_by_role("slider", name="Wipe between")
    for key, wanted in (("ArrowRight", 52), ("PageDown", 42), ("End", 100), ("Home", 0)):
        handle.press(key)
        assert handle.get_attribute("aria-valuenow") == f"{wanted}"
    box, at = compare.page.locator("#frame").bounding_box(), handle.bounding_box()
    compare.page.mouse.move(at["x"] + at["width"] / 2, at["y"] + 50)
    compare.page.mouse.down()
    compare.page.mouse.move(box["x"] + 0.75 * box["width"], at["y"] + 80)
    compare.page.mouse.up()
    assert handle.get_attribute("aria-valuenow") == "75"
    compare.page.get_by_role("button", name="FLIP").press("Enter")
    assert handle.is_hidden()
    compare.page.get_by_role("tab", name="Look").click()
    assert compare.page.locator("#captions").is_hidden()
    assert compare.page.evaluate("page.renderer.canvas.width === page.renderer.size[0]")
