"""Fits in a page of the viewer, as people make them."""

from __future__ import annotations

import base64
from pathlib import Path

from tests.viewer.tab import Tab

BUTTON = ".fitting button:text-is('{}')"
DROP = """([name, text]) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([bytes], name));
  const facts = { dataTransfer, bubbles: true, cancelable: true };
  document.body.dispatchEvent(new DragEvent("drop", facts));
}"""
STATE = """() => {
  const { fitting } = window.page;
  return [!fitting.fit, document.getElementById("trouble").textContent];
}"""


def drop(tab: Tab, path: Path, size: int = 512) -> None:
    """Drop a file on the page, until it is shown in so many pixels along an edge."""
    count = "window.page.materials.list.length"
    before = tab.page.evaluate(count)
    tab.page.evaluate(DROP, [path.name, base64.b64encode(path.read_bytes()).decode()])
    tab.wait(f"{count} > {before} || document.getElementById('trouble').textContent")
    assert not tab.page.evaluate("document.getElementById('trouble').textContent")
    tab.page.evaluate(f"window.page.renderer.resize({size}, {size})")


def start(tab: Tab, preset: str) -> None:
    """Press the button."""
    tab.page.select_option(".fitting select", preset)
    tab.page.click(BUTTON.format("Make it neural"))


def fit(tab: Tab, preset: str) -> float:
    """Make a network of the material that is shown, and return the seconds that it took."""
    clock = "performance.now() / 1e3"
    began = tab.page.evaluate(clock)
    tab.page.evaluate("window.ended = 0")
    start(tab, preset)
    tab.page.evaluate(
        f"""new Promise((done) => {{
            const look = () => (window.page.fitting.fit ? setTimeout(look, 10) : done());
            look();
        }}).then(() => (window.ended = {clock}))"""
    )
    _, trouble = tab.page.evaluate(STATE)
    assert not trouble, trouble
    return float(tab.page.evaluate("window.ended") - began)


def saved(tab: Tab, path: Path) -> Path:
    """The file that the page hands over of the network that it shows."""
    with tab.page.expect_download() as download:
        tab.page.click(BUTTON.format("Save network"))
    download.value.save_as(path)
    return path
