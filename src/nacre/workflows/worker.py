"""What a worker of a Dask cluster does: a task of a run, if it has the same nacre as the owner."""

from __future__ import annotations

import abc
import time
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

import nacre
from nacre.errors import NacreError, require
from nacre.runtime.parallel import one_blas_thread, one_of_many
from nacre.runtime.progress import Progress


class Reported(Protocol):
    """A job; what its worker reports is passed on to `progress`."""

    @property
    def progress(self) -> Progress: ...


JobT = TypeVar("JobT", bound=Reported)
ResultT = TypeVar("ResultT")


@dataclass(frozen=True)
class Unread:
    """A worker does not have what the owner has under a path, for this reason."""

    reason: str


@dataclass(frozen=True)
class Here:
    """Where a task is carried out."""

    address: str  # of the worker
    folder: str  # for temporary files
    report: Progress  # tells the owner


class Work(abc.ABC, Generic[JobT, ResultT]):
    """A kind of work for a cluster, as the owner of a run has it; it is sent with every task.

    The owner makes each job into an item, and maybe content to send with it; a worker does it.
    """

    verb: ClassVar[str]
    """First word of the names of tasks, by which the scheduler's dashboard groups them."""
    kept: ClassVar[str]
    """What becomes of what is done when the cluster ends, and how to continue."""

    @property
    @abc.abstractmethod
    def digest(self) -> str:
        """SHA-256 of the settings, in hexadecimal."""

    @property
    def nbytes(self) -> int:
        """Bytes that are sent with every task, if they matter."""
        return 0

    @abc.abstractmethod
    def code(self) -> str | None:
        """Fingerprint of the code that decides results; None if there is none."""

    @abc.abstractmethod
    def check(self) -> None:
        """Raise a NacreError if this process cannot do the work."""

    @abc.abstractmethod
    def pack(self, job: JobT, *, send: bool) -> tuple[Any, npt.NDArray[Any] | None]:
        """What a worker needs to know, and, if `send` or there is no other way, what to work on.

        An OSError or FormatError says that it cannot be read.
        """

    @abc.abstractmethod
    def do(self, item: Any, content: npt.NDArray[Any] | None, here: Here) -> ResultT | Unread:
        """Carry out a task in a worker; without content, read it. Its own errors are results."""

    @abc.abstractmethod
    def failed(self, job: JobT, error: Exception) -> ResultT:
        """The result of a job that cannot be read or done; raises if the run cannot go on."""


@dataclass(frozen=True)
class Setup:
    """What workers must know about a run, as its owner has it."""

    work: Work[Any, Any]
    settings: str  # digest of the work
    nacre: str  # version
    code: str | None  # fingerprint of the code that decides results
    topic: str  # for messages about progress
    interval: float  # shortest time in s between two messages about a stage of a task


@dataclass(frozen=True, eq=False)
class Task:
    """A job on its way to a worker."""

    token: str  # its name in messages
    item: Any
    content: npt.NDArray[np.generic] | None  # Dask sends arrays without a copy


def check(setup: Setup) -> None:
    """Raise a NacreError if this process has another nacre, or cannot do the work."""
    _check_version(setup)
    setup.work.check()


def carry_out(setup: Setup, task: Task) -> Any:
    """Do one task; raises a NacreError if this process has another nacre than the run."""
    _check_version(setup)
    one_blas_thread().__enter__()  # never undone: other threads of the worker have tasks too
    worker = require("distributed", "cluster").get_worker()
    if worker.state.nthreads > 1:
        one_of_many()
    report = _Report(setup, task.token, worker)
    here = Here(worker.address, worker.local_directory, report)
    return setup.work.do(task.item, task.content, here)


def _check_version(setup: Setup) -> None:
    if nacre.__version__ != setup.nacre:
        raise NacreError(
            f"has nacre {nacre.__version__}, but the run {setup.nacre}; install the same on both"
        )
    try:
        same = setup.work.digest == setup.settings
    except AttributeError:  # a setting that only one side knows
        same = False
    if not same:
        raise NacreError(
            f"has a nacre {nacre.__version__} with other settings than the run's; "
            "install the same on both"
        )
    if setup.work.code() != setup.code:
        raise NacreError(
            f"has a nacre {nacre.__version__} with other code than the run's; "
            "install the same on both"
        )


class _Report:
    """Reports the progress of a task to the owner of the run, not too often."""

    def __init__(self, setup: Setup, token: str, worker: Any) -> None:
        self._setup, self._token, self._worker = setup, token, worker
        self._stage, self._time = "", 0.0

    def __call__(self, stage: str, done: int, total: int, note: str) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._time >= self._setup.interval:
            self._stage, self._time = stage, now
            message = [self._token, stage, int(done), int(total), note]
            self._worker.log_event(self._setup.topic, message)
