"""A run of tests that keeps a clock: its order, what it leaves, and that failures count."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.layers import reached

ROOT = Path(__file__).parents[1]
BEFORE = {
    "src/made/inner.py": "VALUE = 1",
    "src/made/outer.py": "from made.inner import VALUE",
    "src/made/viewer/page/look.js": "",
    "src/made/viewer/shown.py": "VALUE = 1",
    "docs/guide/first.md": "",
    "lab/__init__.py": "",
    "lab/support.py": "from made.outer import VALUE",
    "lab/pages.py": "FOLDER = 'docs/guide'",
    "lab/test_far.py": "from lab.support import VALUE",
    "lab/test_near.py": "import made.inner as inner\nVALUE = inner.VALUE",
    "lab/test_pages.py": "from lab.pages import FOLDER",
    "lab/test_script.py": "from made.viewer.shown import VALUE",
    "lab/test_beyond.py": "",
    "lab/test_other.py": "",
}


DYING = re.findall(r"--max-worker-restart \d+", (ROOT / "Makefile").read_text("utf-8"))[0].split()
"""How `make` has a run of many processes end where one of them dies."""


def git(folder: Path, *words: str) -> None:
    names = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    subprocess.run(["git", *names, *words], cwd=folder, check=True, capture_output=True)


def put(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        tests = "\n\ndef test_one(): pass\n\ndef test_two(): pass\n" * name.startswith("lab/test_")
        path.write_text(f"{text}\n{tests}")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "a")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A repository of one commit."""
    if not shutil.which("git"):
        pytest.skip("git is not installed")
    git(tmp_path, "init", "-q")
    put(tmp_path, BEFORE)
    return tmp_path


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    places = os.pathsep.join(map(str, (ROOT, folder / "src")))
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "tests.clock", "-p", "no:cacheprovider", *options],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": places, "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
    )


def order(folder: Path, *options: str) -> list[str]:
    """Files of tests in the order in which they ran."""
    done = run(folder, "-v", *options)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.partition("::")[0] for line in done.stdout.splitlines() if "PASSED" in line]
    assert len(lines) == 12, done.stdout
    return list(dict.fromkeys(lines))


@pytest.mark.parametrize(
    ("changed", "nearest"),
    [
        ("src/made/inner.py", {"lab/test_near.py": 1, "lab/test_far.py": 3}),
        ("src/made/viewer/page/look.js", {"lab/test_script.py": 1}),
        ("docs/guide/first.md", {"lab/test_pages.py": 1}),
        ("lab/test_other.py", {"lab/test_other.py": 0}),
        ("docs/unknown.md", {}),
    ],
)
def test_what_a_change_reaches(project: Path, changed: str, nearest: dict[str, int]) -> None:
    found = reached(project, [changed])
    assert {file: count for file, count in found.items() if "test_" in file} == nearest


def test_what_a_change_reaches_comes_first_and_the_rest_turns_with_the_commit(
    project: Path,
) -> None:
    orders = []
    for value in range(4):
        put(project, {"src/made/inner.py": f"VALUE = 1{value}", "lab/test_other.py": f"#{value}"})
        orders.append(order(project, "--since", "HEAD~1"))
    first = ["lab/test_other.py", "lab/test_near.py", "lab/test_far.py"]
    assert [each[:3] for each in orders] == [first] * 4
    assert len({tuple(each[3:]) for each in orders}) > 1
    assert order(project, "--since", "HEAD~1", "-n", "2", "--dist", "loadfile")
    assert order(project, "--since", "no-such-revision")


@pytest.mark.parametrize("processes", [[], ["-n", "2", "--dist", "loadfile"]], ids=["one", "two"])
def test_what_is_late_is_listed_and_no_failure(project: Path, processes: list[str]) -> None:
    late = run(project, "--until", "1", *processes)
    assert late.returncode == 0, late.stdout
    assert "12 tests in 6 files were not reached in time" in late.stdout
    assert "\n     2 lab/test_near.py\n" in late.stdout
    assert "= 12 not reached in" in late.stdout.splitlines()[-1]


def test_a_failure_before_the_end_counts(project: Path) -> None:
    """The time is over while the first test, which fails, is running."""
    wrong = "def test_wrong(pytestconfig):\n    pytestconfig.option.until = 1.0\n    assert False\n"
    put(project, {"lab/test_other.py": wrong})
    done = run(project, "--since", "HEAD~1", "--until", "4e9")
    assert done.returncode == 1
    assert "= 1 failed, 12 not reached in" in done.stdout.splitlines()[-1]
    assert "12 tests in 6 files were not reached in time" in done.stdout


def test_a_process_that_dies_ends_the_run_with_the_name_of_its_test(project: Path) -> None:
    fatal = "import os\n\ndef test_fatal(): os._exit(9)\n"
    put(project, {"lab/test_far.py": fatal})
    done = run(project, "-n", "2", "--dist", "loadfile", "--no-loadscope-reorder", *DYING)
    assert done.returncode == 1, done.stdout
    assert "crashed while running 'lab/test_far.py::test_fatal'" in done.stdout
