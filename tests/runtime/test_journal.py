"""Journals: loops that are taken again, and go on where they were stopped."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.runtime.journal import Journal
from nacre.runtime.store import Store


def work(journal: Journal, stop: tuple[int, int] | None = None, by: str = "error") -> list[str]:
    """Two loops of sums with a product between; the steps taken, and the result at the end."""
    taken: list[str] = []

    def add(loop: int, count: int, factor: float) -> float:
        total = np.zeros(())

        def take(step: int) -> None:
            nonlocal total
            taken.append(f"{loop}.{step}")
            if by == "signal" and (loop, step) == stop:
                signal.raise_signal(signal.SIGINT)
            total = total + factor * step

        def restore(kept: np.ndarray) -> None:
            nonlocal total
            total = kept

        for done in journal.steps(count, take, lambda: total, restore):
            if by == "error" and (loop, done) == stop:
                raise KeyboardInterrupt
        return float(total)

    with journal:
        first = add(0, 3, 1.0)
        middle = journal.once(lambda: taken.append("once") or 2.0)
        taken.append(str(add(1, 4, first * middle)))
    return taken


WHOLE = ["0.0", "0.1", "0.2", "once", "1.0", "1.1", "1.2", "1.3", "36.0"]


@pytest.mark.parametrize("by", ["error", "signal"])
@pytest.mark.parametrize(("stop", "left"), [((0, 2), 2), ((1, 1), 5), ((1, 3), 7)])
def test_work_goes_on_where_it_was_interrupted(
    tmp_path: Path, stop: tuple[int, int], left: int, by: str
) -> None:
    assert work(Journal()) == WHOLE
    store = Store(tmp_path / "x.state")
    with pytest.raises(KeyboardInterrupt):
        work(Journal(store), stop, by)
    if by == "signal":
        left += 1  # the step in which the signal comes is taken to its end
    assert work(Journal(store)) == WHOLE[left:]


def test_a_resumed_run_that_is_stopped_early_loses_nothing(tmp_path: Path) -> None:
    store = Store(tmp_path / "x.state")
    with pytest.raises(KeyboardInterrupt):
        work(Journal(store), (1, 3))
    with pytest.raises(KeyboardInterrupt), Journal(store):
        raise KeyboardInterrupt
    assert work(Journal(store)) == WHOLE[7:]


def test_everything_is_saved_now_and_then(tmp_path: Path) -> None:
    store = Store(tmp_path / "x.state")
    work(Journal(store))
    assert not store.files()
    work(Journal(store, "now", seconds=-1.0))
    assert work(Journal(store, "now")) == ["36.0"]


def test_states_of_other_work_are_refused(tmp_path: Path) -> None:
    store = Store(tmp_path / "x.state", "mine")
    work(Journal(store, seconds=-1.0))
    with pytest.raises(NacreError, match="belongs to another run"):
        Journal(Store(tmp_path / "x.state", "yours"))
    for state in ({}, {"loops": 5}, {"loops": [{"step": 9, "state": np.zeros(())}]}):
        store.save(state)
        with pytest.raises(NacreError, match=r"x\.state: cannot be read, remove it to start over"):
            work(Journal(store))
