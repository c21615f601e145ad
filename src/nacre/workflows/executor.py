"""Executors, which carry out the fits of a run: their base class, and threads."""

from __future__ import annotations

import abc
import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TypeAlias

from nacre.runtime.parallel import core_count, one_blas_thread, one_of_many
from nacre.runtime.progress import Progress
from nacre.workflows.fitting import Fitting
from nacre.workflows.manifest import Record
from nacre.workflows.material import Fit, fit_file
from nacre.workflows.watcher import Watcher


@dataclass(frozen=True, eq=False)
class Job:
    """A measured file to fit, and what is known about it so far.

    `progress` is called during the fit, from one thread at a time.
    """

    path: Path
    record: Record
    progress: Progress


Results: TypeAlias = Generator[tuple[Job, Fit], None, None]
"""Jobs with their fits, in any order."""

Stream: TypeAlias = Callable[[Iterator[Job]], Results]
"""Carries out jobs: takes the next when there is room, and returns each once.

If it is closed before its end, it abandons the jobs that it has taken.
"""


class Executor(abc.ABC):
    """A way to carry out fits; it reads measured files and writes nothing."""

    @abc.abstractmethod
    def open(self, fitting: Fitting, watcher: Watcher) -> AbstractContextManager[Stream]:
        """Prepare a run; the block gets the stream for its jobs.

        Raises
        ------
        NacreError
            If nothing can be fitted in this way; the stream raises it if that shows later.
        MissingExtraError
            If a library is not installed.
        """


class _Stopped(BaseException):
    """Ends a fit that nobody waits for any more; not an error of the material."""


class Threads(Executor):
    """Fits in `count` threads of this process, one per core if None.

    Most of a fit runs without Python's lock. At most `count` materials are in memory.
    """

    def __init__(self, count: int | None = None) -> None:
        self._count = count or core_count()

    def open(self, fitting: Fitting, watcher: Watcher) -> AbstractContextManager[Stream]:
        fitting.check()
        return nullcontext(partial(self._results, fitting))

    def _results(self, fitting: Fitting, jobs: Iterator[Job]) -> Results:
        stopped = threading.Event()

        def fit(job: Job) -> Fit:
            def report(stage: str, done: int, total: int, note: str) -> None:
                if stopped.is_set():
                    raise _Stopped
                job.progress(stage, done, total, note)

            return fit_file(job.path, fitting, report)

        running: dict[Future[Fit], Job] = {}
        begin = one_of_many if self._count > 1 else None
        with one_blas_thread(), ThreadPoolExecutor(self._count, initializer=begin) as pool:
            try:
                while True:
                    for job in islice(jobs, self._count - len(running)):
                        running[pool.submit(fit, job)] = job
                    if not running:
                        return
                    for future in wait(running, return_when=FIRST_COMPLETED).done:
                        yield running.pop(future), future.result()
            finally:  # an interrupt must not wait for jobs that have not begun
                stopped.set()
                pool.shutdown(wait=False, cancel_futures=True)
