"""The table of real files in `docs/results/field.md`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from tests.field.files import REAL, Real

BEGIN, END = "<!-- table -->\n", "<!-- end of table -->\n"


def origins(sources: Path) -> dict[str, str]:
    """The project that each file is from, by the list beside the files."""
    rows = re.findall(r"^\| (\S+) \| (\S+) `", sources.read_text(encoding="utf-8"), re.MULTILINE)
    return dict(rows)


def table(folder: Path) -> str:
    """Rows of Markdown, one a file."""
    return "".join(_rows(origins(folder / "SOURCES.md")))


def _rows(projects: dict[str, str]) -> Iterator[str]:
    yield "| file | from | nacre |\n|---|---|---|\n"
    for real in REAL:
        yield f"| `{real.file}` | {projects[real.file]} | {_outcome(real)} |\n"


def _outcome(real: Real) -> str:
    if real.refused:
        other = "; `--opaque-part` reads the rest" if real.opaque_part else ""
        return f"refused: {real.refused}{other}"
    return f"read; {real.checked} (`{Path(real.test).name}`)"
