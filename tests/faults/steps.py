"""Jobs of writing in which one call to the system after another fails, all in this process.

`python -m tests.faults.steps FOLDER`, with the library of :mod:`tests.faults.calls` preloaded,
prints how many calls have failed, and what does not hold.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count, product
from pathlib import Path

from nacre.errors import FormatError
from nacre.io.files import append_line, atomic_path, check_writable, write_encoded
from nacre.runtime.records import Records
from nacre.textures.codecs.networks.journal import Journal
from tests.faults.calls import KINDS, Kind, Plan, plan

NEW = b"new" * 10_000


@dataclass(frozen=True)
class Job:
    """What is done to a file that has content, and what it has afterwards."""

    run: Callable[[Path], object]
    old: bytes
    new: bytes


def _pieces(path: Path) -> None:
    with atomic_path(path, internal=True) as temporary, temporary.open("wb") as file:
        for start in range(0, len(NEW), 1000):
            file.write(NEW[start : start + 1000])


def _row(path: Path) -> None:
    with Journal(path, step=2) as journal:
        journal.add(3, 3.0, 0.1, 0.5, None)


def _records(path: Path, *contents: bytes) -> bytes:
    """What a file of records has."""
    Records(path, "same", 4).add(contents)
    return path.read_bytes()


def jobs(folder: Path) -> dict[str, Job]:
    """All jobs, by name."""
    one = _records(folder / "one", b"1234")
    two = _records(folder / "two", b"1234", b"5678")
    table = b"step,seconds,learning_rate,loss,validation\r\n1,1.00,0.1,0.7,\r\n2,2.00,0.1,0.6,\r\n"
    return {
        "check": Job(check_writable, b"old", b"old"),
        "whole": Job(lambda path: write_encoded(path, bytes, NEW, internal=True), b"old", NEW),
        "pieces": Job(_pieces, b"old", NEW),
        "line": Job(lambda path: append_line(path, "line\n"), b"old\n", b"old\nline\n"),
        "records": Job(lambda path: Records(path, "same", 4).add([b"5678"]), one, two),
        "table": Job(_row, table, table + b"3,3.00,0.1,0.5,\r\n"),
    }


def problems(job: Job, kind: Kind, shared: Plan, folder: Path) -> Iterator[str]:
    """For each call that has failed what does not hold, in words, which may be none."""
    for number in count(1):
        shutil.rmtree(folder)
        folder.mkdir()
        path = folder / "a.txt"
        path.write_bytes(job.old)
        shared.number, shared.error, shared.lasting = number, kind.error, kind.lasting
        shared.counts[:], shared.failed = [0] * len(shared.counts), 0
        shared.kind = kind.calls
        try:
            job.run(path)
            told = False
        except (FormatError, OSError):
            told = True
        finally:
            shared.kind = 0
        if not shared.failed:
            return
        found = path.read_bytes()
        wrong = [f"leaves {each.name}" for each in folder.iterdir() if each != path]
        if found not in (job.old, job.new):
            wrong.append(f"leaves {found[-60:]!r}")
        if not told and found != job.new:
            wrong.append("says nothing")
        yield f"{number}, {shared.call.decode()}: {', '.join(wrong)}" if wrong else ""


def main(folder: Path) -> None:
    """Print the number of calls and the problems."""
    shared, points, found = plan(), 0, []
    shared.folder = os.fsencode(folder)
    for (name, job), kind in product(jobs(folder).items(), ("space", "device")):
        each = list(problems(job, KINDS[kind], shared, folder))
        points += len(each)
        found += [f"{name}, {kind}, {problem}" for problem in each if problem]
    print(points, *found, sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
