"""The site of `make site`: built strictly, whole, and without anything from a network."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
FETCHING = {"link", "script", "img", "iframe", "source", "video"}
"""Elements whose address a browser fetches unasked."""


class Addresses(HTMLParser):
    """The addresses in a page, by the element that names them."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.found: list[tuple[str, str]] = []
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [(tag, value or "") for name, value in attrs if name in ("src", "href")]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All pages; of the API reference one module, since all take a minute."""
    folder = tmp_path_factory.mktemp("site") / "docs"
    folder.mkdir()
    (folder.parent / "index.html").touch()  # the front
    status, output = build(ROOT, "--site-dir", str(folder))
    assert status == 0, output
    return folder


def build(folder: Path, *options: str) -> tuple[int, str]:
    """The exit status of MkDocs in a folder, as the Makefile runs it, and what it says."""
    for name in ("mkdocs", "material", "latex2mathml", "nbconvert"):
        pytest.importorskip(name, reason="needs the extra 'docs'")
    environment = os.environ | {"SITE_API": "nacre.errors", "NO_MKDOCS_2_WARNING": "1"}
    command = [sys.executable, "-m", "mkdocs", "build", *options]
    built = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    return built.returncode, built.stdout + built.stderr


def pages(site: Path) -> Iterator[tuple[Path, list[tuple[str, str]]]]:
    for page in sorted(site.rglob("*.html")):
        yield page, Addresses(page).found


def test_every_page_of_docs_is_there(site: Path) -> None:
    for source in [*(ROOT / "docs").rglob("*.md"), *NOTEBOOKS]:
        name = source.with_suffix(".html").relative_to(ROOT / "docs")
        assert (site / name.parent / name.name.replace("README", "index")).is_file()
    assert "FormatError" in (site / "api" / "nacre" / "errors.html").read_text("utf-8")


def test_links_that_lead_nowhere_end_the_build(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "README.md").write_text("# A\n\n[b](#nowhere), [c](nowhere.md)\n")
    settings = f"INHERIT: {ROOT / 'mkdocs.yml'}\nnav: [README.md]\nhooks: []\n"
    (tmp_path / "mkdocs.yml").write_text(settings)
    status, output = build(tmp_path)
    assert status == 1
    assert "'#nowhere', but there is no such anchor" in output
    assert "'nowhere.md', but the target is not found" in output


@pytest.mark.parametrize("source", NOTEBOOKS, ids=lambda source: source.stem)
def test_notebooks_show_what_their_cells_gave(site: Path, source: Path) -> None:
    page = site / "notebooks" / f"{source.stem}.html"
    shown = [address for tag, address in Addresses(page).found if tag == "img"]
    pictures = [page.parent / address for address in shown if address.startswith("pictures/")]
    text = page.read_text("utf-8")
    assert pictures or "<iframe" in text
    for picture in pictures:
        if picture.suffix == ".svg":
            assert "<path" in picture.read_text("utf-8"), f"{picture.name} shows nothing"
            continue
        values = np.asarray(Image.open(picture).convert("L"))
        assert values.std() > 5.0, f"{picture.name} shows nothing"
    assert not re.search(r"Warning|Traceback|\x1b", text)


def test_nothing_comes_from_a_network(site: Path) -> None:
    for page, addresses in pages(site):
        fetched = [address for tag, address in addresses if tag in FETCHING]
        assert [address for address in fetched if re.match(r"(\w+:)?//", address)] == [], page
    for style in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()[\s'\"]*(\w+:)?//", style.read_text("utf-8")), style


def test_links_between_files_lead_somewhere(site: Path) -> None:
    for page, addresses in pages(site):
        if page.name == "404.html":  # a server shows it anywhere: its links begin at the root
            continue
        for _, address in addresses:
            name = address.partition("#")[0]
            if name and not re.match(r"\w+:", name):
                assert (page.parent / name).exists(), f"{page}: {address}"


def test_equations_are_mathml(site: Path) -> None:
    for name in ("reflectance", "textures"):
        source = (ROOT / "docs" / "theory" / f"{name}.md").read_text("utf-8")
        text = (site / "theory" / f"{name}.html").read_text("utf-8")
        assert text.count('display="block"') == source.count("\n$$\n") // 2 > 0
        equations = re.findall(r"<math.*?</math>", text, re.DOTALL)
        assert [equation for equation in equations if "\\" in equation] == []  # unknown commands
    for page in site.rglob("*.html"):
        assert 'class="arithmatex"' not in page.read_text("utf-8"), page


def test_pages_open_from_disk_and_are_searched(site: Path, chromium: Any) -> None:
    page = chromium.new_page()
    asked: list[str] = []
    errors: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((site / "start.html").as_uri())
    # Key by key: the page reads its field when a key is released.
    page.locator("[data-md-component=search-query]").press_sequentially("rusinkiewicz")
    result = page.locator(".md-search-result__link[href*=reflectance]").first
    result.wait_for(state="attached", timeout=60_000)
    page.close()
    assert [url for url in asked if not url.startswith(("file:", "data:", "about:"))] == []
    assert errors == []
