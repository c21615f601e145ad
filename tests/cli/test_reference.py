"""The reference of the command line is made of its help texts."""

from __future__ import annotations

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_page_is_what_the_generator_prints() -> None:
    page = runpy.run_path(str(ROOT / "scripts" / "command_line.py"))["page"]
    committed = (ROOT / "docs" / "reference" / "command-line.md").read_text("utf-8")
    again = "python scripts/command_line.py > docs/reference/command-line.md"
    assert committed == page(), f"out of date: {again}"
