"""The notebooks of docs: short, with the outputs of all cells, and these are what cells give."""

from __future__ import annotations

import base64
import io
import json
import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
WORDS = 500
BYTES = 1_000_000

each = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path: Path) -> list[dict[str, Any]]:
    return list(json.loads(path.read_text("utf-8"))["cells"])


def outputs(path: Path) -> list[list[set[str]]]:
    """The kinds of content that each cell of a notebook shows."""
    return [
        [set(output.get("data", {"": ""})) for output in cell.get("outputs", [])]
        for cell in cells(path)
    ]


@each
def test_notebooks_are_read_in_three_minutes(path: Path) -> None:
    text = "\n".join("".join(cell["source"]) for cell in cells(path))
    assert sum(1 for word in text.split() if re.search(r"\w", word)) <= WORDS
    assert f"]({path.name})" in (path.parent / "README.md").read_text("utf-8")


@each
def test_the_first_cell_installs_nacre_where_it_is_missing(path: Path) -> None:
    first = next(cell for cell in cells(path) if cell["cell_type"] == "code")
    assert re.search(
        r'if .*find_spec\("nacre"\) is None:.*\n    %pip install -q "nacre-materials\[render',
        "".join(first["source"]),
    )
    assert first["outputs"] == []


@each
def test_notebooks_are_kept_with_what_cells_gave_and_nothing_about_the_machine(path: Path) -> None:
    text = path.read_text("utf-8")
    assert path.stat().st_size < BYTES
    code = [cell for cell in cells(path) if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    assert not re.search(r"/tmp/|/home/|/work/|/root/| at 0x|, [\d.]+ s\\n|20\d\d-\d\d-\d\dT", text)
    assert not re.search(r"Warning|Traceback", text)
    assert [cell["metadata"] for cell in code if cell["metadata"]] == []
    pictures = 0
    for output in (output for cell in code for output in cell["outputs"]):
        data = output.get("data", {})
        assert not {"image/png", "image/jpeg"} <= {*data}, "one picture, in two formats"
        for kind in {"image/png", "image/jpeg"} & {*data}:
            pixels = Image.open(io.BytesIO(base64.b64decode(data[kind]))).convert("L")
            assert np.asarray(pixels).std() > 5.0, "a picture shows nothing"
            pictures += 1
        pictures += "<path" in "".join(data.get("image/svg+xml", ""))
    assert pictures or "<iframe" in text


@pytest.mark.slow
@each
def test_cells_give_what_is_kept(path: Path, tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs the group 'docs'")
    pytest.importorskip("nbclient", reason="needs the group 'docs'")
    again = tmp_path / path.name
    nbformat.write(script()["executed"](path), again)
    assert outputs(again) == outputs(path), f"out of date: make notebooks changes {path.name}"


def test_a_cell_that_fails_is_shown(tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs the group 'docs'")
    errors = pytest.importorskip("nbclient.exceptions", reason="needs the group 'docs'")
    notebook = nbformat.v4.new_notebook()
    notebook.cells.append(nbformat.v4.new_code_cell("raise ValueError('no such light')"))
    nbformat.write(notebook, tmp_path / "a.ipynb")
    with pytest.raises(errors.CellExecutionError, match="no such light"):
        script()["executed"](tmp_path / "a.ipynb")


def script() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "scripts" / "notebooks.py"))
