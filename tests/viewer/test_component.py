"""The web component on a host page from a server, as other people would use it."""

from __future__ import annotations

import base64
import io
import itertools
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.color import srgb_to_linear
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre.neural.file import save
from nacre.neural.nbrdf import HIDDEN, NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import GgxLobe, GgxMixture
from nacre.viewer.component import component
from tests.targets.support import needs
from tests.viewer.tab import patient, until
from tests.viewer.test_page import AXE
from tests.viewer.test_programs import mixture, network

PAGE = """<!doctype html><meta charset="utf-8"><title>Host</title>
<meta http-equiv="Content-Security-Policy" content="default-src 'self'">
<script src="nacre-view.js" defer></script><script src="nacre-view.js" defer></script>"""
FIRST = "document.querySelector('nacre-view')"


class Host:
    """A page of elements, in a browser, and what went wrong in it."""

    def __init__(self, page: Any, address: str, folder: Path) -> None:
        self.page, self._address, self._folder = page, address, folder
        self.errors: list[str] = []
        self._thrown: list[str] = []
        page.on("pageerror", lambda error: self._thrown.append(str(error)))
        page.on("console", lambda said: self.errors.append(said.text))

    def open(self, markup: str) -> None:
        (self._folder / "index.html").write_text(PAGE + markup)
        self.page.goto(self._address)

    def wait(self, condition: str) -> None:
        until(self.page, self.page, condition, self._thrown)
        assert self._thrown == []

    def picture(self, element: str = FIRST) -> np.ndarray:
        """Pixels of an element once it has converged, RGBA in [0, 1]."""
        self.wait(f"{element}?.view?.drawn >= 127 && !{element}.view.stale")
        url = self.page.evaluate(f"{element}.view.canvas.toDataURL()")
        return decoded(url)

    def words(self, element: str = FIRST) -> str:
        self.wait(f"{element}?.view && !{element}.view.trouble.hidden")
        return self.page.evaluate(f"{element}.view.trouble.textContent")


def decoded(url: str) -> np.ndarray:
    from PIL import Image

    with Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))) as image:
        return np.asarray(image.convert("RGBA"), float) / 255.0


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Nothing: the test's own output is enough."""


def usual(seed: int) -> NeuralBrdf:
    """A network of the shape that fits have, with some weights."""
    generator = np.random.default_rng(seed)
    layers = [
        Layer(*(generator.normal(0.0, 0.25, shape).astype(np.float32) for shape in ((a, b), b)))
        for a, b in itertools.pairwise((6, *HIDDEN, 3))
    ]
    some = (0.1,) * 3
    sampler = GgxMixture((GgxLobe(some, some, some, some),), some, some, (0.1, 0.45, 1.0))
    name = f"Usual <b>{seed}"
    settings = {"inputs": "enhanced", "activation": "squared relu", "sampler": sampler}
    return NeuralBrdf(layers, name=name, **settings)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("host")
    (path / "nacre-view.js").write_bytes(component())
    (path / "favicon.ico").touch()
    for seed in (1, 2):
        save(usual(seed), path / f"usual {seed}.safetensors")
    save(network(3, mixture(0.3), 0.2), path / "narrow.safetensors")
    whole = (path / "usual 1.safetensors").read_bytes()
    (path / "cut.safetensors").write_bytes(whole[: len(whole) // 2])
    (path / "other.safetensors").write_bytes(whole.replace(b"nbrdf", b"other"))
    return path


@pytest.fixture
def host(chromium: Any, folder: Path) -> Iterator[Host]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    context = patient(chromium.new_context(viewport={"width": 640, "height": 480}))
    yield Host(context.new_page(), f"http://127.0.0.1:{server.server_port}/", folder)
    context.close()
    server.shutdown()
    server.server_close()


def test_a_network_of_a_file_looks_as_nacre_renders_it(host: Host):
    host.open('<nacre-view src="usual%201.safetensors" light="lamp" id="one"></nacre-view>')
    host.page.evaluate(f"{FIRST}.style.width = '97px'")
    host.wait(f"{FIRST}.view?.size === 97")
    found = host.picture()
    expected, mask = render_sphere(usual(1), DirectionalLight(), 97)
    shown = srgb_to_linear(found[..., :3])
    inside = found[..., 3] == 1.0
    assert inside.sum() == pytest.approx(mask.sum(), rel=0.06)
    lit = inside & mask & (expected.max(axis=2) > 0.05)
    assert lit.sum() > 3000
    assert np.sqrt(np.mean((shown - np.clip(expected, 0.0, 1.0))[lit] ** 2)) < 0.01
    assert found[0, 0, 3] == 0.0
    label = host.page.evaluate(f"{FIRST}.view.canvas.getAttribute('aria-label')")
    assert label == "Usual <b>1, sphere, light lamp"
    assert host.errors == []


@pytest.mark.slow
def test_attributes_keys_and_another_place_change_the_picture(host: Host):
    host.open('<nacre-view src="usual%202.safetensors" exposure="-1"></nacre-view>')
    host.page.evaluate(f"{FIRST}.style.width = '64px'")
    first = host.picture()
    host.page.evaluate(f"{FIRST}.exposure = '0'")
    brighter = host.picture()
    some = (first[..., :3].max(axis=2) > 0.1) & (brighter[..., :3].max(axis=2) < 1.0)
    assert some.sum() > 500
    assert (brighter - first)[some].max(axis=1).min() > 0.02
    host.page.evaluate(
        f"Object.assign({FIRST}, {{ shape: 'knot', light: 'overcast', alt: 'Ours' }})"
    )
    knot = host.picture()
    assert knot[..., 3].sum() < 0.8 * brighter[..., 3].sum()
    host.page.keyboard.press("Tab")
    for _ in range(4):
        host.page.keyboard.press("ArrowRight")
    turned = host.picture()
    assert np.abs(turned - knot).mean() > 0.02
    assert host.page.evaluate(f"{FIRST}.view.canvas.getAttribute('aria-label')") == "Ours"
    host.page.evaluate(
        f"const moved = {FIRST}; moved.remove(); document.body.append(moved);"
        "moved.src = 'usual%201.safetensors'"
    )
    host.wait(f"{FIRST}.view.words[0].endsWith('1')")
    assert np.abs(host.picture() - turned)[..., :3].mean() > 0.01
    assert host.errors == []


@pytest.mark.slow
def test_a_network_of_no_usual_shape_is_shown_too(host: Host):
    host.open('<nacre-view src="narrow.safetensors" light="lamp"></nacre-view>')
    host.page.evaluate(f"{FIRST}.style.width = '64px'")
    found = host.picture()
    assert found[32, 32, 3] == 1.0
    expected, _ = render_sphere(network(3, mixture(0.3), 0.2), DirectionalLight(), 64)
    shown = srgb_to_linear(found[28:36, 28:36, :3]).mean(axis=(0, 1))
    np.testing.assert_allclose(shown, np.clip(expected, 0, 1)[28:36, 28:36].mean((0, 1)), atol=0.01)
    assert host.errors == []


@pytest.mark.slow
def test_twenty_elements_share_a_browser_that_keeps_few_contexts(host: Host):
    host.open('<nacre-view src="usual%201.safetensors" light="lamp"></nacre-view>' * 20)
    host.page.evaluate(
        "document.querySelectorAll('nacre-view').forEach((each) => (each.style.width = '24px'))"
    )
    host.wait("[...document.querySelectorAll('nacre-view')].every((e) => e.view?.drawn > 0)")
    assert host.errors == []


def test_what_fails_is_said_in_words(host: Host):
    elements = {
        'src="cut.safetensors"': "weights_2 reaches past the end",
        'src="gone.safetensors"': "gone.safetensors: cannot be fetched: 404",
        'src="other.safetensors"': "other.safetensors: is of a kind that",
        'src="index.html"': "ends within the header",
        'src="http://127.0.0.1:1/x.safetensors"': "x.safetensors: cannot be fetched",
        'shape="cube"': 'shape "cube" is none of sphere',
        'light="moon"': 'light "moon" is none of studio, overcast, late sun, room, lamp',
        'exposure="much"': 'exposure "much" is not a number of stops',
    }
    host.open("".join(f"<nacre-view {each}></nacre-view>" for each in elements))
    for k, words in enumerate(elements.values()):
        assert words in host.words(f"document.querySelectorAll('nacre-view')[{k}]")
    assert host.page.get_by_role("alert").count() == len(elements)


@pytest.mark.slow
def test_axe_finds_nothing(host: Host):
    needs(None if AXE.is_file() else "axe-core (make tools, with npm)")
    host.open(
        '<html lang="en"><main><h1>Ours</h1>'
        '<nacre-view src="usual%201.safetensors"></nacre-view>'
        '<nacre-view shape="cube"></nacre-view>'
    )
    host.page.evaluate(f"{FIRST}.style.width = '96px'")
    host.picture()
    host.page.evaluate(f"() => {{ {AXE.read_text('utf-8')} }}")
    found = host.page.evaluate("() => axe.run()")
    assert [(each["id"], each["help"]) for each in found["violations"]] == []


def test_a_browser_without_webgl2_is_told(host: Host):
    host.page.add_init_script(
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
        "  return kind === 'webgl2' ? null : get.call(this, kind, ...more); }"
    )
    host.open('<nacre-view src="usual%201.safetensors"></nacre-view>')
    assert "needs WebGL2" in host.words()
