"""Faults of two commands, one that keeps a state and one that fetches."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator

import pytest

from tests.faults.commands import LONG
from tests.faults.faults import FAULTS, MOUNTED, can_mount
from tests.faults.trial import Outcome, Trial
from tests.tiers import tiered

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are watched in /proc")

TRIED = {"kill": 5, "stop": 1, "full": 1, "source": 1}
"""Faults, and how often."""


@pytest.fixture(scope="module", params=tiered(["encode", "download"], ["download"]))
def trial(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Trial]:
    long = LONG[request.param]
    with long.command() as command:
        made = Trial(long, command, tmp_path_factory.mktemp("faults") / "work")
        made.measure()
        yield made


@pytest.mark.parametrize("fault", tiered(TRIED, ["full"]))
def test_outputs_are_whole_and_nothing_is_lost(trial: Trial, fault: str) -> None:
    if fault in MOUNTED and not can_mount():
        pytest.skip("this user may not mount a disk")
    tally = FAULTS[fault](trial, TRIED[fault], random.Random(fault))
    assert tally.problems == []


def test_what_is_wrong_is_seen(trial: Trial) -> None:
    trial.begin()
    name, content = next(iter(trial.reference.items()))
    good, killed = Outcome(0, "", True), Outcome(-9, "", True)
    for wrong in (content[:-1], b"old"):
        (trial.out / name).write_bytes(wrong)
        assert any(name in problem for problem in trial.problems(good, finished=True))
    (trial.out / name).write_bytes(content[: len(content) // 2])
    assert any(name in problem for problem in trial.problems(killed, killed=True))
    (trial.out / name).write_bytes(content)
    (trial.out / ".0123456789abcdef.npz").write_bytes(b"")
    assert trial.problems(good)
    assert not trial.problems(killed, killed=True)
    for text in ("", "Traceback\nnacre: a\n", "nacre: a\nb\n"):
        assert trial.problems(Outcome(2, text, True), killed=False)
    (trial.out / "mine.txt").write_bytes(b"")
    assert any("user" in problem for problem in trial.problems(killed, killed=True))
