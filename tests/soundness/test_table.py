"""The page of results is about the materials that are checked."""

from __future__ import annotations

import re

import pytest

from nacre.soundness import Plan, check, subject
from tests.analytic.materials import EXAMPLES
from tests.soundness.__main__ import PAGE, table
from tests.soundness.subjects import DESIGN, mitsubas, ours
from tests.variants import require_mitsuba


def rows(name: str) -> dict[str, str]:
    """Notes of a table of the page, by material."""
    text = PAGE.read_text("utf-8")
    part = text.partition(f"<!-- {name} -->\n")[2].partition(f"<!-- end of {name} -->")[0]
    return dict(re.findall(r"^\| (.+?) \| ?\d* \| (.*) \|$", part, re.MULTILINE))


def test_the_page_has_every_material() -> None:
    require_mitsuba()
    assert list(rows("mitsuba")) == [name for name, _ in mitsubas()]
    assert list(rows("nacre")) == [name for name, _ in ours()]
    assert set(DESIGN) <= set(rows("mitsuba"))


def test_nothing_of_nacre_fails() -> None:
    assert [name for name, notes in rows("nacre").items() if "fails" in notes] == []


@pytest.mark.parametrize("name", ["gltf", "openpbr", "principled", "closures"])
def test_layers_are_not_reciprocal_by_design(name: str) -> None:
    found = check(subject(EXAMPLES[name]), Plan(), ["reciprocity"])["reciprocity"]
    assert found.state == "by design"
    assert found.where is not None


def test_a_row_has_what_does_not_pass() -> None:
    lines = list(table([("closures", lambda: subject(EXAMPLES["closures"], "closures"))]))
    assert len(lines) == 3
    assert "by design, its closures change with the view alone" in lines[2]


def test_what_cannot_be_checked_has_its_reason() -> None:
    require_mitsuba()
    conductor = [entry for entry in mitsubas() if entry[0] == "conductor"]
    (*_, row) = table(conductor)
    assert row == "| conductor | | reflects only in single directions, or not at all |\n"
