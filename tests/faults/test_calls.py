"""Calls to the system that fail, one after another."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from tests.faults.calls import KINDS, compiler, library
from tests.faults.commands import NACRE, ROOT
from tests.faults.forks import Forks
from tests.faults.points import Points, chosen, fail_calls
from tests.faults.writers import WRITERS

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="calls are those of Linux"),
    pytest.mark.skipif(compiler() is None, reason="gcc is absent"),
]


def test_files_are_whole_or_absent_whatever_call_fails(tmp_path: Path) -> None:
    (tmp_path / "work").mkdir()
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-m", "tests.faults.steps", str(tmp_path / "work")],
        env={**os.environ, "PYTHONPATH": path, "LD_PRELOAD": str(library())},
        capture_output=True,
        text=True,
    )
    assert done.stderr == ""
    points, *problems = done.stdout.split("\n")
    assert problems == [""]
    assert int(points) > 50


def test_points_are_spread() -> None:
    assert chosen(200) == list(range(1, 201))
    few = chosen(1000, 40)
    assert len(few) == 40
    assert few[:10] == list(range(1, 11))
    assert few[-10:] == list(range(991, 1001))
    assert max(b - a for a, b in itertools.pairwise(few)) < 60


@pytest.mark.slow
def test_every_command_that_writes_is_tried() -> None:
    from nacre.cli import root
    from nacre.targets.target import TARGETS

    written = {" ".join(long.arguments[len(NACRE) :]) for long in WRITERS.values()}
    for name in _writing(root):
        assert any(f"{line} ".startswith(f"{name} ") for line in written), name
    assert [name for name in TARGETS if f"export-{name}" not in WRITERS] == []


def _writing(group: click.Group, before: str = "") -> Iterator[str]:
    """Names of the commands that take --force."""
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        if isinstance(command, click.Group):
            yield from _writing(command, f"{before}{name} ")
        elif command is not None and any("--force" in each.opts for each in command.params):
            yield before + name


@pytest.fixture(scope="module")
def forks() -> Iterator[Forks]:
    made = Forks()
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["export-npy", "export-glsl", "capture-codes", "plot-pdf"])
def test_nothing_is_lost_whatever_call_fails(name: str, tmp_path: Path, forks: Forks) -> None:
    with WRITERS[name].command() as command:
        trial = Points(WRITERS[name], command, tmp_path / "work", forks)
        trial.measure()
        for kind in KINDS:
            tally = fail_calls(trial, kind, 12)
            assert tally.problems == []
            assert sum(tally.counts.values())
