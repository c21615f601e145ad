"""The faults: each disturbs a command some times and says what came of it."""

from __future__ import annotations

import functools
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from tests.faults.trial import MINE, Moment, Trial, running

FAKETIME = Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1")
"""Of Debian's libfaketime; `FAKETIME_LIBRARY` names another place."""
CHAIN = 5
"""Kills before a command is let through."""


@dataclass
class Tally:
    """What came of one fault: how often what happened, and what was wrong."""

    counts: Counter[str] = field(default_factory=Counter)
    problems: list[str] = field(default_factory=list)

    def add(self, what: str, problems: list[str]) -> None:
        """Count an outcome."""
        self.counts[what] += 1
        self.problems += problems

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {what}" for what, count in self.counts.items())
        return f"{counts or 'none'}; problems: {len(self.problems)}"


Fault = Callable[[Trial, int, random.Random], Tally]


def kill(trial: Trial, times: int, dice: random.Random) -> Tally:
    """SIGKILL, to the process and its children or to it alone; then the same command again."""
    tally, killed, chain = Tally(), 0, 0
    trial.begin()
    for _ in range(3 * times + 3):
        if killed >= times:
            break
        through = chain == CHAIN
        alone = dice.random() < 0.25

        def act(process: subprocess.Popen[bytes], alone: bool = alone) -> None:
            (os.kill if alone else os.killpg)(process.pid, signal.SIGKILL)
            end = time.monotonic() + 20
            while running(process.pid) and time.monotonic() < end:
                time.sleep(0.05)
            if running(process.pid):
                tally.problems.append("children of a killed process live on")
                os.killpg(process.pid, signal.SIGKILL)

        outcome = trial.run(None if through else _moment(trial, dice), act)
        if outcome.met:
            killed, chain = killed + 1, chain + 1
            tally.add("killed", trial.problems(outcome, killed=True))
        else:
            tally.add("got through", trial.problems(outcome, finished=True))
            trial.begin(previous=dice.random() < 0.5)
            chain = 0
    tally.add("got through", trial.problems(trial.run(), finished=True))
    return tally


def stop(trial: Trial, times: int, dice: random.Random) -> Tally:
    """SIGTERM to the process, or SIGINT to it and its children, as a terminal's Ctrl-C."""
    tally = Tally()
    for number in range(times):
        sent = (signal.SIGTERM, signal.SIGINT)[number % 2]

        def act(process: subprocess.Popen[bytes], sent: signal.Signals = sent) -> None:
            (os.killpg if sent == signal.SIGINT else os.kill)(process.pid, sent)

        trial.begin(previous=dice.random() < 0.5)
        outcome = trial.run(_moment(trial, dice), act)
        if outcome.code == -sent:  # nothing of nacre has run yet
            tally.add("before nacre begins", trial.problems(outcome, killed=True))
        elif outcome.code == 0:
            tally.add("at the end" if outcome.met else "too late", trial.problems(outcome, True))
        else:
            wrong = outcome.code != 128 + sent
            problems = [f"{sent.name}: {outcome.shown}"] if wrong else []
            tally.add("stopped", problems + trial.problems(outcome))
            if number % 4 < 2:
                tally.add("went on", trial.problems(trial.run(), finished=True))
    return tally


def full(trial: Trial, times: int, dice: random.Random) -> Tally:
    """A disk with room for a part of what is written; then one with enough."""
    tally = Tally()
    for number in range(times):
        trial.begin()
        room = 8192 + int(trial.peak * (number + dice.random()) / times)
        with _mounted(trial, room) as mount:
            outcome = trial.run()
            problems = trial.problems(outcome)
            if outcome.code == 0:
                tally.add("enough room", problems)
                continue
            if "No space left on device" not in outcome.text:
                problems.append(f"does not say that the disk is full: {outcome.shown}")
            tally.add("refused", problems)
            mount("size=1g")
            tally.add("went on", trial.problems(trial.run(), finished=True))
    return tally


def read_only(trial: Trial, times: int, dice: random.Random) -> Tally:
    """A disk that may not be written to: from the start, or from some moment."""
    tally = Tally()
    for number in range(times):
        trial.begin()
        with _mounted(trial, 1 << 30) as mount:

            def act(
                _process: subprocess.Popen[bytes], mount: Callable[[str], object] = mount
            ) -> None:
                while not mount("ro") and _process.poll() is None:  # a file is being written
                    time.sleep(0.005)

            if number == 0:
                mount("ro")
                outcome = trial.run()
            else:
                outcome = trial.run(_moment(trial, dice), act)
            problems = trial.problems(outcome, finished=outcome.code == 0)
            if outcome.code and "Read-only file system" not in outcome.text:
                problems.append(f"does not say that the disk is read-only: {outcome.shown}")
            if outcome.code:  # what cannot be removed is no fault of who cannot
                problems = [p for p in problems if not p.endswith("left behind")]
            tally.add("refused" if outcome.code else "too late", problems)
            mount("rw")
            tally.add("went on", trial.problems(trial.run(), finished=True))
    return tally


def vanish(trial: Trial, times: int, dice: random.Random) -> Tally:
    """The folder of the output is moved away, with what is being written in it."""
    tally = Tally()
    gone = trial.folder / "gone"
    for _ in range(times):
        trial.begin()

        def act(_process: subprocess.Popen[bytes]) -> None:
            trial.out.rename(gone)

        outcome = trial.run(_moment(trial, dice), act)
        problems = []
        if outcome.met:
            made = trial.out.exists()
            if made:  # some commands make their folders again
                shutil.copy(gone / "mine.txt", trial.out / "mine.txt")
                problems += trial.problems(outcome, finished=outcome.code == 0)
                shutil.rmtree(trial.out)
            gone.rename(trial.out)
            if not made:
                found = trial.problems(outcome)
                problems += [p for p in found if not p.endswith("left behind")]
                if outcome.code == 0 and not all(
                    (trial.out / name).exists() for name in trial.reference
                ):
                    problems.append("says nothing of the folder that has vanished")
        else:
            problems += trial.problems(outcome, finished=True)
        told = "refused" if outcome.code else "done"
        tally.add(told if outcome.met else "too late", problems)
    return tally


def source(trial: Trial, times: int, dice: random.Random) -> Tally:
    """An input is replaced by another, removed, or cut short where it lies."""
    tally = Tally()
    if not trial.long.inputs:
        return tally
    name = dice.choice(list(trial.long.inputs))
    other = trial.with_other(name)
    path = trial.folder / "inputs" / name
    for number in range(times):
        trial.begin()
        how = ("replaced", "removed", "cut short")[number % 3]

        def act(_process: subprocess.Popen[bytes], how: str = how) -> None:
            if how == "replaced":
                trial.long.write_input(trial.folder, name, other=True)
            elif how == "removed":
                path.unlink()
            else:
                os.truncate(path, path.stat().st_size // 2)

        outcome = trial.run(_moment(trial, dice), act)
        if not outcome.met:
            tally.add("too late", trial.problems(outcome, finished=True))
            continue
        problems = trial.problems(outcome, among=other if how == "replaced" else trial.reference)
        tally.add(f"{how}: {'refused' if outcome.code else 'done'}", problems)
    return tally


def clock(trial: Trial, times: int, dice: random.Random) -> Tally:
    """The clock goes back by a day in mid-run, and files come to lie in the future."""
    tally = Tally()
    library = Path(os.environ.get("FAKETIME_LIBRARY", FAKETIME))
    if not library.exists():
        return tally
    stamp = trial.folder / "clock"
    for _ in range(times):
        trial.begin()
        stamp.write_text("+0\n")
        moment = _moment(trial, dice)
        outcome = trial.run(
            moment,
            lambda _: (stamp.write_text("-86400\n"), None)[1],
            LD_PRELOAD=str(library),
            FAKETIME_TIMESTAMP_FILE=str(stamp),
            FAKETIME_NO_CACHE="1",
            FAKETIME_DONT_FAKE_MONOTONIC="1",
        )
        tally.add("done" if outcome.met else "too late", trial.problems(outcome, finished=True))
    return tally


def together(trial: Trial, times: int, dice: random.Random) -> Tally:
    """Two processes with one output."""
    tally = Tally()
    for _ in range(times):
        trial.begin()
        first = trial.start()
        time.sleep(dice.random() * trial.seconds)
        second = trial.start()
        outcomes = [trial.end(process) for process in (first, second)]
        problems = []
        for outcome in outcomes:
            problems += trial.problems(outcome)
        if all(outcome.code for outcome in outcomes):
            problems.append(f"neither gets through: {outcomes[0].shown}, {outcomes[1].shown}")
        done = sum(outcome.code == 0 for outcome in outcomes)
        tally.add(f"{done} of 2 done", problems)
        tally.add("went on", trial.problems(trial.run(), finished=True))
    return tally


def stranger(trial: Trial, times: int, dice: random.Random) -> Tally:
    """A user's file comes to lie where the output is to be: before the start, or in mid-run."""
    tally = Tally()
    if not trial.long.called:
        return tally
    (name,) = (n for n in trial.reference if not n.endswith(".csv"))
    for number in range(times):
        trial.begin()
        path = trial.out / name

        def act(_process: subprocess.Popen[bytes], path: Path = path) -> None:
            path.write_bytes(MINE)

        if number == 0:
            path.write_bytes(MINE)
            outcome = trial.run()
        else:
            outcome = trial.run(Moment(seconds=dice.uniform(0.05, 0.95) * trial.seconds), act)
        if number and not outcome.met:
            tally.add("too late", trial.problems(outcome, finished=True))
            continue
        kept = path.read_bytes() == MINE
        problems = [] if kept else [f"{name}: a file of the user's was replaced"]
        path.unlink()
        tally.add("refused" if outcome.code else "done", problems + trial.problems(outcome))
    return tally


def worker(trial: Trial, times: int, dice: random.Random) -> Tally:
    """A worker of the cluster is killed; it is started again, and its work given to another."""
    tally = Tally()
    for _ in range(times if _DASK in " ".join(trial.command) else 0):
        trial.begin()

        def act(_process: subprocess.Popen[bytes]) -> None:
            (started,) = _children(os.getpid(), "dask_worker")
            os.kill(dice.choice(_children(started, "spawn_main")), signal.SIGKILL)

        outcome = trial.run(_moment(trial, dice), act)
        tally.add("done" if outcome.met else "too late", trial.problems(outcome, finished=True))
    return tally


def lost(trial: Trial, times: int, dice: random.Random) -> Tally:
    """The scheduler is killed; then the command goes on without a cluster."""
    tally = Tally()
    if _DASK not in " ".join(trial.command):
        return tally
    trial.begin()

    def act(_process: subprocess.Popen[bytes]) -> None:
        (scheduler,) = _children(os.getpid(), "dask_scheduler")
        os.kill(scheduler, signal.SIGKILL)

    outcome = trial.run(Moment(change=dice.randint(2, max(2, trial.changes // 2))), act)
    tally.add("refused" if outcome.code else "done", trial.problems(outcome))
    place = trial.command.index(_DASK)
    del trial.command[place : place + 2]
    tally.add("went on", trial.problems(trial.run(), finished=True))
    return tally


_DASK = "--scheduler"


def _children(parent: int, word: str) -> list[int]:
    """Processes that a process started, with a word in their arguments."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            of = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            if of == parent and word in (path / "cmdline").read_text():
                found.append(int(path.name))
    return found


def _moment(trial: Trial, dice: random.Random) -> Moment:
    """Any time of a run, or just when something changes in `out`."""
    if trial.changes and dice.random() < 0.5:
        return Moment(change=dice.randint(1, int(trial.changes)))
    return Moment(seconds=dice.uniform(0.02, 1.0) * trial.seconds)


@functools.cache
def can_mount() -> bool:
    """Whether this user may mount a file system of its own."""
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run(
            ["mount", "-t", "tmpfs", "tmpfs", folder], stderr=subprocess.DEVNULL
        ).returncode:
            return False
        subprocess.run(["umount", folder], check=True)
    return True


@contextmanager
def _mounted(trial: Trial, size: int) -> Iterator[Callable[[str], bool]]:
    """`out` on a disk of its own; gives what changes its settings."""
    options = f"size={max(size >> 12, 1) << 12}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", trial.out], check=True)

    def change(setting: str) -> bool:
        command = ["mount", "-o", f"remount,{setting}", str(trial.out)]
        return subprocess.run(command, stderr=subprocess.DEVNULL).returncode == 0

    try:
        (trial.out / "mine.txt").write_bytes(MINE)
        yield change
    finally:
        subprocess.run(["umount", "-l", trial.out], check=True)


FAULTS: dict[str, Fault] = {
    "kill": kill,
    "stop": stop,
    "full": full,
    "read-only": read_only,
    "vanish": vanish,
    "source": source,
    "clock": clock,
    "together": together,
    "stranger": stranger,
    "worker": worker,
    "scheduler": lost,
}
"""All of them, by name."""
MOUNTED = "full", "read-only"
"""Those that need :func:`can_mount`."""
