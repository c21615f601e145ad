"""What notebooks show: the HTML of a reflectance, and the widget, in pages like theirs."""

from __future__ import annotations

import base64
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre.objects.described import Described
from nacre.viewer.notebook import live
from nacre.viewer.widget import content_of, module
from tests.viewer.tab import Tab, until
from tests.viewer.test_component import decoded, usual

GLOSSY = Ggx(
    roughness=0.3,
    specular=(0.9, 0.6, 0.2),
    diffuse=(0.1, 0.05, 0.02),
    name='Gold "><script>bad()</script>',
)


class Measured(Brdf):
    """A reflectance that is no formula."""

    name = "Measured"
    traceable = False

    def eval_components(self, wi: Any, wo: Any) -> Any:
        return (np.linspace(0.1, 0.2, 11)[np.rint(10.0 * wi[2]).astype(int)],) * 3


class Large(Measured):
    """So many numbers that no notebook should keep them."""

    nbytes = 10_000_000


def tags(markup: str) -> list[str]:
    found: list[str] = []
    parser = HTMLParser()
    parser.handle_starttag = lambda tag, attributes: found.append(tag)  # type: ignore[method-assign]
    parser.feed(markup)
    return found


@pytest.mark.parametrize("material", [usual(1), GLOSSY], ids=["network", "formula"])
def test_a_cell_shows_a_live_sphere_over_a_still_one(tab: Tab, tmp_path: Path, material: Brdf):
    cell = material._repr_html_()
    assert tags(cell)[:4] == ["div", "img", "iframe", "table"]
    assert len(cell) < 150_000
    (tmp_path / "cell.html").write_text(f"<!doctype html><meta charset=utf-8>{cell}", "utf-8")
    tab.page.goto((tmp_path / "cell.html").as_uri())
    still = decoded(tab.page.evaluate("document.querySelector('img').src"))[..., :3]
    image, mask = render_sphere(material, DirectionalLight(), len(still))
    assert np.abs(still - tone_map(image))[mask].mean() < 0.02
    tab.page.locator("iframe").scroll_into_view_if_needed()
    tab.page.frame_locator("iframe").locator("#view").wait_for(state="attached")
    frame = tab.page.frames[1]
    view = "document.getElementById('view')?.view"
    until(tab.page, frame, f"{view}?.drawn > 6", tab.errors)
    assert frame.evaluate(f"{view}.trouble.hidden")
    found = decoded(frame.evaluate(f"{view}.canvas.toDataURL()"))
    assert found[120, 120, 3] == 1.0
    assert found[120, 120, :3].max() > 0.02
    label = frame.evaluate(f"{view}.canvas.getAttribute('aria-label')")
    assert label == f"{material.name}, sphere, light studio"


@pytest.mark.parametrize("material", [Measured(), Large()], ids=["no formula", "large"])
def test_what_no_page_can_hold_is_a_still_picture(material: Brdf):
    assert tags(live(material)) == ["div", "img"]


def test_other_materials_show_their_facts():
    class Other(Described):
        def describe(self) -> dict[str, Any]:
            return {"name": "other"}

    assert Other()._repr_html_() == "<table><tr><th>name</th><td>other</td></tr></table>"


@pytest.mark.slow
def test_the_widget_follows_its_model(tab: Tab, tmp_path: Path):
    contents = [base64.b64encode(content_of(each)).decode() for each in (usual(1), GLOSSY)]
    source = base64.b64encode(module().encode()).decode()
    page = f"""<!doctype html><meta charset=utf-8><div id=cell></div><script type=module>
import widget from "data:text/javascript;base64,{source}";
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const contents = {json.dumps(contents)}.map(bytes), heard = {{}};
const held = {{ content: contents[0], shape: "ball", light: "lamp", exposure: 0, size: 80 }};
const model = {{ get: (name) => held[name], on: (name, f) => (heard[name] = f) }};
const end = await widget.render({{ model, el: document.getElementById("cell") }});
window.put = async (name, value) => {{
  held[name] = name === "content" ? contents[value] : value;
  await heard[`change:${{name}}`]();
}};
window.end = end;
</script>"""
    (tmp_path / "widget.html").write_text(page, "utf-8")
    tab.page.goto((tmp_path / "widget.html").as_uri())
    tab.wait("window.end")
    view = "document.querySelector('#cell > div').view"

    def shown() -> np.ndarray:
        tab.wait(f"{view}.drawn >= 15 && !{view}.stale")
        return decoded(tab.page.evaluate(f"{view}.canvas.toDataURL()"))

    def label() -> str:
        return tab.page.evaluate(f"{view}.canvas.getAttribute('aria-label')")

    first = shown()
    assert first.shape == (80, 80, 4)
    assert label() == "Usual <b>1, ball, light lamp"
    for name, value in {"exposure": 1.0, "shape": "sphere", "light": "room", "content": 1}.items():
        tab.page.evaluate("([name, value]) => window.put(name, value)", [name, value])
        then = shown()
        assert np.abs(then - first).mean() > 0.005, name
        first = then
    assert label() == f"{GLOSSY.name}, sphere, light room"
    tab.page.evaluate("window.put('size', 48)")
    tab.wait(f"{view}.canvas.width === 48")
    tab.page.evaluate("window.put('light', 'moon')")
    assert 'light "moon" is none of' in tab.page.evaluate(f"{view}.trouble.textContent")
    tab.page.evaluate("window.end()")


def test_the_widget_of_anywidget_sends_what_changes():
    pytest.importorskip("anywidget")
    from nacre.viewer.widget import view

    picture = view(usual(1), shape="knot", size=100)
    assert (picture.shape, picture.light, picture.size) == ("knot", "studio", 100)
    sent = picture.content
    assert sent == content_of(usual(1))
    picture.brdf = GLOSSY
    assert picture.content == content_of(GLOSSY) != sent
    assert {"content", "shape", "light", "exposure", "size"} <= set(picture.keys)
    assert "brdf" not in picture.keys
