"""The examples of `docs/examples/embed`, served with what they say they need."""

from __future__ import annotations

import io
import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import nacre
from nacre.neural.file import save
from nacre.neural.nbrdf import NeuralBrdf
from nacre.viewer.component import component
from tests.oracles.runners.three import INSTALLED
from tests.viewer.tab import patient, until
from tests.viewer.test_component import Quiet

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples" / "embed"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("embed")
    for example in EXAMPLES.iterdir():
        shutil.copy(example, folder)
    gold = nacre.load("merl:gold-metallic-paint")
    assert isinstance(gold, NeuralBrdf)
    save(gold, folder / "gold.safetensors")
    nacre.export(gold, "three", folder / "gold.js", name="gold")
    (folder / "nacre-view.js").write_bytes(component())
    if INSTALLED.is_dir():
        (folder / "node_modules").mkdir()
        (folder / "node_modules" / "three").symlink_to(INSTALLED)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


def opened(chromium: Any, address: str) -> tuple[Any, list[str]]:
    page = patient(chromium.new_context()).new_page()
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("requestfailed", lambda request: said.append(request.url))
    page.goto(address)
    return page, said


@pytest.mark.slow
def test_an_element_on_a_page(chromium: Any, address: str) -> None:
    page, said = opened(chromium, f"{address}plain.html")
    done = "document.querySelector('output').value === 'done'"
    until(page, page, done, said)
    page.get_by_label("Light").select_option("late sun")
    until(page, page, "document.querySelector('output').value === 'drawing'", said)
    until(page, page, done, said)
    assert said == []


@pytest.mark.slow
@pytest.mark.skipif(not INSTALLED.is_dir(), reason="three.js is not installed")
def test_a_material_of_three_js_beside_the_element(chromium: Any, address: str) -> None:
    page, said = opened(chromium, f"{address}three.html")
    until(page, page, "document.querySelector('nacre-view').view?.drawn > 0", said)
    found = np.asarray(Image.open(io.BytesIO(page.locator("#scene").screenshot())).convert("RGB"))
    red, _, blue = found[130:190, 130:190].reshape(-1, 3).mean(axis=0)
    assert red > 1.5 * blue > 0.0  # gold, not the gray around it
    assert said == []
