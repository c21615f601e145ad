"""What people type first, right and wrong: a transcript says what each line should print."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from nacre.included import resolve
from tests.habits.transcript import Terminal, blocks, matches
from tests.specimens import SPECIMENS

TRANSCRIPTS = sorted(Path(__file__).parent.glob("*.txt"))

SPECIMEN_OF = {
    "paint.bsdf": "RGL",
    "weave.npz": "NumPy archive of a BTF",
    "weave.safetensors": "nacre encoded texture",
}
"""What lies in the folder where a transcript begins, beside the network `paint.safetensors`: a
measured reflectance, a measured and an encoded texture."""


@pytest.mark.parametrize("path", TRANSCRIPTS, ids=lambda path: path.stem)
def test_what_people_type(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    shutil.copy(resolve("rgl:paper_white"), "paint.safetensors")
    for name, kind in SPECIMEN_OF.items():
        Path(name).write_bytes(SPECIMENS[kind].files()[0])
    terminal = Terminal()
    wrong = []
    for block in blocks(path):
        printed = terminal.printed(block)
        if not matches(block.expected, printed):
            place = f"{path.name}:{block.line}: {block.typed}"
            wrong.append(f"{place}\n{printed}\n-- expected:\n{block.expected}")
    assert not wrong, "\n\n".join(["", *wrong])


@pytest.mark.parametrize(
    ("expected", "printed", "same"),
    [
        ("", "", True),
        ("", "a", False),
        ("a", "a\nb", False),
        ("a ... c", "a b c", True),
        ("a\n...\nd", "a\nb\nc\nd", True),
        ("a\n...\nd", "a\nd", True),
        ("a\n...\nd", "a\nb\nc", False),
    ],
)
def test_matching(expected: str, printed: str, same: bool) -> None:
    assert matches(expected, printed) is same
