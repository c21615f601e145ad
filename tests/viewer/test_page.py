"""The page in a browser: materials, shapes, light, keys, narrow windows, and what it refuses."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from nacre.mitsuba.studio import studio
from nacre.viewer.content import Entry
from tests.analytic.materials import EXAMPLES
from tests.targets.support import needs
from tests.tiers import tiered
from tests.viewer.tab import Tab, page

HOSTILE = "<img src=x onerror=alert(1)>&amp;</script><script>alert(2)</script>"
AXE = Path(sys.prefix) / "three/node_modules/axe-core/axe.min.js"  # by scripts/setup.py


@cache
def content() -> bytes:
    entries = [
        Entry("Gray plastic", {"ggx": EXAMPLES["ggx"]}),
        Entry(
            HOSTILE,
            {"ggx": EXAMPLES["ggx"], HOSTILE: EXAMPLES["gltf"]},
            HOSTILE,
            {HOSTILE: HOSTILE},
        ),
        Entry("Painted metal", {"openpbr": EXAMPLES["openpbr"]}, "Standard"),
    ]
    return page(HOSTILE, entries, [studio()])


def opened(tab: Tab) -> Tab:
    """The page in a small picture, as software draws it."""
    tab.open(content())
    tab.page.evaluate("window.page.renderer.resize(128, 128)")
    return tab


def pixels(tab: Tab) -> list[float]:
    """The picture as it is shown, coarsely."""
    found: list[float] = tab.page.evaluate(
        """() => {
          const copy = document.createElement("canvas"), size = 16;
          copy.width = copy.height = size;
          const context = copy.getContext("2d");
          context.drawImage(document.getElementById("picture"), 0, 0, size, size);
          return [...context.getImageData(0, 0, size, size).data].map((x) => x / 255);
        }"""
    )
    return found


def changes(tab: Tab, act: Any) -> bool:
    """Whether a picture of a few frames differs from the last by more than noise does."""

    def settled() -> list[float]:
        tab.wait("window.page.renderer.frames >= 3 && !window.page.renderer.stale")
        return pixels(tab)

    before = settled()
    act()
    after = settled()
    return sum(abs(a - b) for a, b in zip(before, after, strict=True)) / len(before) > 0.01


def test_materials_are_shown_and_switched(tab: Tab) -> None:
    opened(tab)
    tab.keep("look")
    options = tab.page.locator(".material")
    assert options.count() == 3
    assert changes(tab, options.nth(2).click)
    assert tab.page.locator("#name").inner_text() == "Painted metal"
    assert options.nth(2).get_attribute("aria-selected") == "true"


@pytest.mark.slow
def test_texts_of_files_stay_texts(tab: Tab) -> None:
    opened(tab)
    assert tab.page.title() == HOSTILE
    assert tab.page.locator("h1").inner_text() == HOSTILE
    tab.page.locator(".material").nth(1).click()
    assert tab.page.locator("#name").inner_text() == HOSTILE
    assert tab.page.locator("#forms button").nth(1).inner_text() == HOSTILE
    assert HOSTILE in tab.page.locator("#known").inner_text()
    assert tab.page.locator("img[onerror]").count() == 0


@pytest.mark.slow
def test_forms_of_a_material_are_chosen_by_buttons(tab: Tab) -> None:
    opened(tab)
    tab.page.locator(".material").nth(1).click()
    assert changes(tab, tab.page.locator("#forms button").nth(1).click)
    pressed = tab.page.locator("#forms button[aria-pressed=true]")
    assert pressed.count() == 1


@pytest.mark.parametrize("shape", tiered(["ball", "cloth", "knot"], ["cloth"]))
def test_shapes_and_turning(tab: Tab, shape: str) -> None:
    opened(tab)
    if shape != "ball":  # with which the page opens
        assert changes(tab, lambda: tab.page.get_by_label("Shape").select_option(shape))
    box = tab.page.locator("#picture").bounding_box()

    def orbit() -> None:
        mouse, x, y = tab.page.mouse, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        mouse.move(x, y)
        mouse.down()
        mouse.move(x + 90, y + 60, steps=3)
        mouse.up()

    assert changes(tab, orbit)
    tab.page.locator("#picture").focus()
    assert changes(tab, lambda: [tab.page.keyboard.press("ArrowUp") for _ in range(6)])
    tab.keep(f"look-{shape}")


@pytest.mark.slow
def test_light_turns_brightens_and_has_a_lamp(tab: Tab) -> None:
    opened(tab)
    assert changes(tab, lambda: tab.page.get_by_label("Rotation").fill("120"))
    assert changes(tab, lambda: tab.page.get_by_label("Exposure").fill("-2"))
    assert not tab.page.locator("#lamp").is_visible()
    assert changes(
        tab, lambda: tab.page.locator("#controls").get_by_label("Light").select_option("lamp")
    )
    lamp = tab.page.locator("#lamp")
    assert lamp.is_visible()
    lamp.focus()
    assert changes(tab, lambda: [tab.page.keyboard.press("ArrowRight") for _ in range(20)])


@pytest.mark.slow
def test_keys_alone_reach_everything(tab: Tab) -> None:
    opened(tab)
    reached = set()
    for _ in range(30):
        tab.page.keyboard.press("Tab")
        reached.add(
            tab.page.evaluate(
                "document.activeElement.id || document.activeElement.parentElement.textContent"
            )
        )
    assert {"search", "materials", "picture"} <= reached
    assert any(name.startswith("Exposure") for name in reached)
    tab.page.locator("#materials").focus()
    assert changes(tab, lambda: tab.page.keyboard.press("End"))
    assert tab.page.locator("#name").inner_text() == "Painted metal"


def test_search_leaves_what_matches(tab: Tab) -> None:
    opened(tab)
    tab.page.get_by_label("Search").fill("standard")
    assert tab.page.locator(".material:visible").count() == 1
    assert tab.page.locator("#count").inner_text() == "1 of 3"
    tab.page.get_by_label("Search").fill("")
    assert tab.page.locator(".material:visible").count() == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "scheme"),
    tiered([((1280, 860), "light"), ((360, 740), "dark")], lambda case: case[1] == "dark"),
    ids=["wide", "narrow"],
)
def test_axe_finds_nothing(
    chromium: Any, tmp_path: Path, size: tuple[int, int], scheme: str
) -> None:
    needs(None if AXE.is_file() else "axe-core (make tools, with npm)")
    with Tab(chromium, tmp_path, size, color_scheme=scheme) as tab:
        tab.open(content())
        tab.page.evaluate(f"() => {{ {AXE.read_text('utf-8')} }}")
        for mode in tab.page.get_by_role("tab").all() or [None]:
            if mode is not None:
                mode.click()
            found = tab.page.evaluate("() => axe.run()")
            assert [(each["id"], each["help"]) for each in found["violations"]] == []
            width = tab.page.evaluate("document.documentElement.scrollWidth")
            assert width <= size[0]
            name = mode.inner_text().lower() if mode is not None else "look"
            tab.keep(f"{name}-{size[0]}-{scheme}")
        tab.page.get_by_role("button", name="Keys").click()
        for _ in range(2):
            found = tab.page.evaluate("() => axe.run()")
            assert [(each["id"], each["help"]) for each in found["violations"]] == []
            tab.page.keyboard.press("Escape")
            tab.page.locator("#picture").focus()
            tab.page.keyboard.press("t")  # the other colors than the system's


def test_a_browser_without_webgl_says_so(chromium: Any, tmp_path: Path) -> None:
    with Tab(chromium, tmp_path) as tab:
        tab.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
        path = tmp_path / "page.html"
        path.write_bytes(content())
        tab.page.goto(path.as_uri())
        tab.page.get_by_text("needs WebGL2").wait_for()


def test_print_has_no_controls(tab: Tab) -> None:
    tab.open(content())
    tab.page.emulate_media(media="print")
    assert not tab.page.locator("#controls").is_visible()
    assert tab.page.locator("#picture").is_visible()


def test_the_policy_stops_other_scripts_and_requests(chromium: Any, tmp_path: Path) -> None:
    with Tab(chromium, tmp_path) as tab:
        tab.open(content())
        done = tab.page.evaluate(
            """async () => {
              const script = document.createElement("script");
              script.textContent = "window.broken = true";
              document.body.append(script);
              const asked = await fetch("https://example.org/").then(() => "sent", () => "refused");
              return [Boolean(window.broken), asked];
            }"""
        )
        assert done == [False, "refused"]
        assert all("Content Security Policy" in error for error in tab.errors)
        tab.errors.clear()
