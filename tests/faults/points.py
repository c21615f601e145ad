"""A command in which one call to the system after another fails."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.faults.calls import KINDS, Kind
from tests.faults.commands import NACRE, Long
from tests.faults.faults import Tally
from tests.faults.forks import Forks, Run
from tests.faults.trial import Moment, Outcome, Trial

ALL = 200
"""Calls up to which each fails once; of more, the first and last fifty and a hundred between."""
MORE = 4
"""Calls that there may be more where an earlier output is replaced."""


class Points(Trial):
    """A trial whose command runs in forks.

    Parameters
    ----------
    long, command, folder
        See :class:`Trial`.
    forks
        The process that forks.
    """

    def __init__(self, long: Long, command: list[str], folder: Path, forks: Forks) -> None:
        super().__init__(long, command, folder)
        self.forks, self.arguments = forks, command[len(NACRE) :]
        self.inputs: dict[Path, bytes] = {}
        self.counts: list[int] = []
        self.temporary = folder / "tmp"
        self.temporary.mkdir()

    def measure(self) -> None:
        """Run once: what it writes, in how many calls of each kind."""
        run = self.disturbed()
        assert run.code == 0, _outcome(run).shown
        self.counts = run.counts
        self.keep()
        files = (path for path in (self.folder / "inputs").rglob("*") if path.is_file())
        self.inputs = {path: path.read_bytes() for path in files}

    def run(
        self,
        moment: Moment | None = None,
        act: Callable[..., None] | None = None,
        **environment: str,
    ) -> Outcome:
        """Run undisturbed."""
        assert (moment, act, environment) == (None, None, {})
        return _outcome(self.disturbed())

    def disturbed(self, kind: Kind | None = None, number: int = 0) -> Run:
        """Run with the n-th call of a kind failing."""
        return self.forks.run(self.arguments, self.folder, kind, number)

    def problems(self, *arguments: object, **more: object) -> list[str]:
        """See :class:`Trial`; temporary files are gone, and inputs are as they were."""
        found = super().problems(*arguments, **more)  # type: ignore[arg-type]
        if not more.get("killed"):
            left = (path.name for path in self.temporary.iterdir())
            # What PyTorch compiles it keeps, for all its processes.
            found += [
                f"tmp/{name}: is left behind"
                for name in left
                if not name.startswith("torchinductor_")
            ]
        for path, content in self.inputs.items():
            if not path.exists() or path.read_bytes() != content:
                found.append(f"{path.name}: an input has changed")
        return found

    def content(self) -> dict[str, bytes]:
        """All files that are in the way of the next run, or help it."""
        return {name: self._path(name).read_bytes() for name in self._names()}


def fail_calls(trial: Points, name: str, limit: int) -> Tally:
    """Let calls of a kind fail, one in each run; each time the same command then has to succeed.

    Parameters
    ----------
    name
        The kind, one of :data:`tests.faults.calls.KINDS`.
    limit
        Most points to try, beginning and end first if there are more calls; see :func:`chosen`.
    """
    kind, tally = KINDS[name], Tally()
    count = trial.counts[kind.calls] + MORE
    for number in chosen(count, limit):
        trial.begin(previous=number % 2 == 0)
        before = trial.content()
        run = trial.disturbed(kind, number)
        outcome, died = _outcome(run), run.code < 0
        if not run.failed:
            tally.add("not met", [])
            continue
        problems = trial.problems(outcome, finished=run.code == 0, killed=died)
        if run.code > 0 and not any(words in run.text for words in kind.words):
            problems.append(f"does not say what failed: {outcome.shown}")
        what = "done" if run.code == 0 else "ended by a signal" if died else "refused"
        if run.code and trial.content() != before:
            problems += trial.problems(trial.run(), finished=True)
        tally.add(what, [f"{number} of {count}, {run.call}: {problem}" for problem in problems])
    return tally


def chosen(count: int, limit: int = ALL) -> list[int]:
    """Numbers of calls to fail, from 1: all, or a limit of them, of which a quarter is at each end
    and half evenly between.
    """
    if count <= limit:
        return list(range(1, count + 1))
    end = limit // 4
    between = np.linspace(end + 1, count - end, limit - 2 * end).round()
    return [*range(1, end + 1), *map(int, between), *range(count - end + 1, count + 1)]


def _outcome(run: Run) -> Outcome:
    return Outcome(run.code, run.text, True)
