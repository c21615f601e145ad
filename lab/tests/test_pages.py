"""The lab's pages: their links, the modules that they name, and the way numbers are written."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import test_docs
from tests.cli import test_reference

LAB = Path(__file__).parents[1]
PAGES = sorted(LAB.rglob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(LAB)))
@pytest.mark.parametrize(
    "check",
    [
        test_docs.test_links_lead_somewhere,
        test_docs.test_modules_that_are_named_exist,
        test_docs.test_numbers_have_a_digit_before_the_point,
    ],
    ids=["links", "modules", "numbers"],
)
def test_pages_are_whole(page: Path, check) -> None:
    check(page)


@pytest.mark.parametrize(
    "page",
    [*test_reference.PAGES, *sorted((LAB / "docs").glob("*.md"))],
    ids=lambda page: str(page.relative_to(LAB.parent)),
)
def test_examples_name_commands_and_options_that_exist(page: Path) -> None:
    test_reference.test_examples_name_commands_and_options_that_exist(page)
