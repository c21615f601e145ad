"""A Dask scheduler and workers as processes of their own, on loopback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.workflows.support import eventually

_ROOT = Path(__file__).resolve().parents[2]

ALLOWED_FAILURES = 1
"""Workers that a task may kill, and be tried again."""


@contextmanager
def _process(log: Path, *arguments: object) -> Iterator[subprocess.Popen[bytes]]:
    """A process that goes at the end of the block, with all that it started."""
    settings = {
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(ALLOWED_FAILURES),
        "PYTHONPATH": os.pathsep.join([str(_ROOT / "src"), str(_ROOT)]),
    }
    with (
        log.open("wb") as file,
        subprocess.Popen(
            [sys.executable, "-m", *map(str, arguments)],
            stdout=file,
            stderr=file,
            env=os.environ | settings,
            start_new_session=True,
        ) as process,
    ):
        try:
            yield process
        finally:
            os.killpg(process.pid, signal.SIGKILL)


class Scheduler:
    """A running scheduler.

    Parameters
    ----------
    folder
        For its files, and those of its workers.
    process
        Of the scheduler.
    """

    def __init__(self, folder: Path, process: subprocess.Popen[bytes]) -> None:
        self.folder, self.process = folder, process
        log = folder / "scheduler.log"
        line = eventually(lambda: [t for t in log.read_text().splitlines() if "tcp://" in t])[0]
        self.address = "tcp://" + line.partition("tcp://")[2].split()[0]

    @contextmanager
    def workers(self, count: int, threads: int = 1) -> Iterator[None]:
        """So many worker processes of so many threads, each started again when it dies."""
        options = ["--nworkers", count, "--nthreads", threads, "--local-directory", self.folder]
        with _process(
            self.folder / "workers.log",
            "distributed.cli.dask_worker",
            self.address,
            *options,
            "--no-dashboard",
        ):
            yield


@contextmanager
def scheduler(folder: Path) -> Iterator[Scheduler]:
    """A scheduler on a free port."""
    options = ["--host", "127.0.0.1", "--port", 0, "--no-dashboard"]
    log = folder / "scheduler.log"
    with _process(log, "distributed.cli.dask_scheduler", *options) as process:
        yield Scheduler(folder, process)
