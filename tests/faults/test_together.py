"""Several processes that write into one folder at the same time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.faults.commands import NACRE, ROOT
from tests.faults.trial import TEMPORARY
from tests.faults.writers import WRITERS

ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]),
    "OMP_NUM_THREADS": "1",
}
WRITE = """
import sys
from nacre.io.files import write_encoded
from nacre.io.outputs import written_by
for number in range(40):
    with written_by("nacre fit"):
        write_encoded("a.txt", str.encode, sys.argv[1] * 50_000 + "\\n")
"""


def test_one_file_is_that_of_one_of_several_writers(tmp_path: Path) -> None:
    processes = [
        subprocess.Popen([sys.executable, "-c", WRITE, mark], cwd=tmp_path, env=ENVIRONMENT)
        for mark in "abc"
    ]
    found = set()
    while any(process.poll() is None for process in processes):
        if (tmp_path / "a.txt").exists():
            text, mark, _ = (tmp_path / "a.txt").read_text().split("\n")
            assert mark.startswith("nacre fit ")
            assert text == text[0] * 50_000
            found.add(text[0])
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert found <= set("abc")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.slow
def test_fits_into_one_folder_at_the_same_time(tmp_path: Path) -> None:
    WRITERS["fit-several"].prepare(tmp_path)
    (tmp_path / "inputs/other.json").write_bytes((tmp_path / "inputs/a.json").read_bytes())
    quick = ["--samples", "1000", "--epochs", "1"]

    def start(names: str, output: str) -> subprocess.Popen[bytes]:
        inputs = [f"inputs/{name}.json" for name in names.split()]
        line = [*NACRE, "fit", *inputs, "-o", f"{output}/", *quick]
        return subprocess.Popen(line, cwd=tmp_path, env=ENVIRONMENT, stderr=subprocess.PIPE)

    alone = start("a model other", "alone")
    assert (alone.communicate()[1], alone.returncode) == (b"", 0)
    processes = [start(names, "out") for names in ("a model", "model other", "a", "other a model")]
    for process in processes:
        _, text = process.communicate()
        assert (process.returncode, text) == (0, b"")
    names = {"a.safetensors", "model.safetensors", "other.safetensors"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    for name in names:
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
    assert not [path for path in tmp_path.rglob("*") if TEMPORARY.fullmatch(path.name)]
