"""Materials in files beside a page, loaded from disk when a reader asks for them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from nacre.mitsuba.studio import studio
from nacre.viewer.content import Content, Entry
from tests.analytic.materials import EXAMPLES
from tests.targets import made_texture
from tests.viewer.tab import Tab
from tests.viewer.test_programs import mixture, network

STATUS = "document.getElementById('status').textContent"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("kinds")
    page = Content([studio()], code=True)
    page.add(Entry("Plastic", {"ggx": EXAMPLES["ggx"]}))
    others, cloths = page.beside("others"), page.beside("cloths")
    others.add(Entry("Mixed", {"Network": network(3, mixture(0.3), 0.2)}, "Others"))
    cloths.add_texture(made_texture.texture(), made_texture.heights())
    more = []
    for name, content in (("others", others), ("cloths", cloths), ("gone", others)):
        src = f"{name}.js"
        if name != "gone":
            (path / src).write_bytes(content.script(name))
        more.append({"name": name, "title": name, "count": 1, "size": "1 kB", "src": src})
    page.facts["more"] = more
    (path / "index.html").write_bytes(page.page("Kinds"))
    return path


def opened(tab: Tab, folder: Path, hash_: str = "") -> Any:
    tab.page.goto((folder / "index.html").as_uri() + hash_)
    tab.wait("window.page?.renderer.frames > 0")
    tab.page.evaluate("window.page.renderer.resize(96, 96)")
    return tab.page


@pytest.mark.slow
def test_kinds_are_loaded_when_asked_for(tab: Tab, folder: Path) -> None:
    page = opened(tab, folder)
    assert page.locator("#count").inner_text() == "1"
    page.get_by_role("button", name="others: 1 more, 1 kB").click()
    tab.wait("document.getElementById('name').textContent === 'Mixed'")
    assert page.locator("#count").inner_text() == "2"
    assert page.get_by_role("button", name="others").count() == 0
    name, text = page.evaluate("Object.values(window.page.code.written())")
    assert name == "mixed.glsl"
    assert "vec3 mixed_eval(vec3 wi, vec3 wo)" in text
    tab.wait("location.hash === '#material=Mixed&kind=others'")
    page.get_by_role("button", name="cloths").click()
    tab.wait(f"{STATUS}.endsWith('a second')")
    assert page.get_by_role("tab", name="Textures").get_attribute("aria-selected") == "true"
    assert page.get_by_role("slider", name="Relief").is_visible()


@pytest.mark.slow
def test_an_address_names_a_material_of_a_file_beside(tab: Tab, folder: Path) -> None:
    opened(tab, folder, "#material=Mixed&kind=others")
    tab.wait("document.getElementById('name').textContent === 'Mixed'")
    shown = "#mode=textures&kind=cloths&texture-tilt=60&texture-shape=cloth&lamp-path=still"
    tab.page.evaluate(f"location.hash = '{shown}'")
    tab.wait("window.page.mode.title === 'Textures' && !window.page.mode.waits")
    view = tab.page.evaluate("window.page.mode.textured.view")
    assert (view["tilt"], view["shape"]) == (60, "cloth")
    assert tab.page.evaluate("window.page.mode.path") == "still"


def test_a_missing_file_is_named(chromium: Any, folder: Path, tmp_path: Path) -> None:
    page = chromium.new_page()
    page.goto((folder / "index.html").as_uri())
    page.get_by_role("button", name="gone").click()
    page.get_by_text("gone.js could not be loaded; it belongs beside this page.").wait_for()
    assert page.get_by_role("button", name="gone: 1 more, 1 kB").is_enabled()
    page.close()
