"""The README and the pages of docs: links, length, and the way numbers are written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS.rglob("*.md")])
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]

GUIDE_WORDS = 900
README_WORDS = 600


def outside_code(page: Path) -> Iterator[tuple[int, str]]:
    """Numbered lines of a page that are not in code blocks."""
    code = False
    for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
        if line.lstrip().startswith("```"):
            code = not code
        elif not code:
            yield number, line


def words(page: Path) -> int:
    """How many words a page has, code among them; marks and rules of tables are none."""
    return sum(1 for word in page.read_text("utf-8").split() if re.search(r"\w", word))


def anchors(page: Path) -> set[str]:
    """What the headings of a page are linked to by."""
    headings = [line.lstrip("#") for _, line in outside_code(page) if re.match(r"#+ ", line)]
    plain = [re.sub(r"[^\w\- ]", "", heading.strip().lower()) for heading in headings]
    return {heading.replace(" ", "-") for heading in plain}


@cache
def modules() -> list[str]:
    """Every Python file of the project."""
    folders = "src", "tests", "lab", "scripts", "docs"
    paths = (path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return [f"/{path.relative_to(ROOT)}" for path in paths]


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"\s+", " ", "\n".join(line for _, line in outside_code(page)))
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target.is_file(), f"{link} leads nowhere"
        if anchor:
            assert anchor in anchors(target), f"{link}: no such heading"


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_modules_that_are_named_exist(page: Path) -> None:
    named = set(re.findall(r"`([\w/]+\.py)`", page.read_text("utf-8")))
    known = modules()
    assert [name for name in named if not any(f.endswith(f"/{name}") for f in known)] == []


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_numbers_have_a_digit_before_the_point(page: Path) -> None:
    lines = enumerate(page.read_text("utf-8").splitlines(), 1)
    assert [number for number, line in lines if re.search(r"(^|[ (|])\.[0-9]", line)] == []


def test_readme_is_read_in_a_minute() -> None:
    assert words(ROOT / "README.md") <= README_WORDS


@pytest.mark.parametrize("page", sorted((DOCS / "guide").glob("*.md")), ids=lambda page: page.stem)
def test_guide_pages_are_read_in_five_minutes(page: Path) -> None:
    assert words(page) <= GUIDE_WORDS


def test_index_has_every_page() -> None:
    index = (DOCS / "README.md").read_text("utf-8")
    results = (DOCS / "results" / "README.md").read_text("utf-8")
    for page in DOCS.rglob("*.md"):
        if page.name == "README.md":
            continue
        inner = page.parent.name == "results"
        link = page.name if inner else page.relative_to(DOCS).as_posix()
        assert f"]({link})" in (results if inner else index), f"no index has {link}"


def test_extending_shows_what_is_in_the_example_package() -> None:
    files = DOCS.glob("examples/**/*.*")
    shown = {line.strip() for file in files for line in file.read_text("utf-8").splitlines()}
    blocks = re.findall(r"```(?:python|toml)\n(.*?)```", (DOCS / "extending.md").read_text(), re.S)
    assert blocks
    lines = [line for block in blocks for line in block.splitlines() if line.strip()]
    assert [line for line in lines if line.strip() not in shown] == []
