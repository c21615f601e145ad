"""What a worker of a Dask cluster does: one material, by path or sent along."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
from nacre.errors import FormatError, NacreError, require
from nacre.io.files import digest
from nacre.runtime.parallel import one_blas_thread
from nacre.workflows.fitting import Fitting
from nacre.workflows.material import Fit, explain, fit_file


@dataclass(frozen=True)
class Setup:
    """What a run asks of its workers.

    Parameters
    ----------
    fitting
        What to fit.
    settings
        Its digest, as the owner of the run computes it.
    nacre
        The owner's version.
    code
        Fingerprint of the code that decides fits, as the owner has it.
    topic
        Under which workers tell how far they are.
    interval
        Shortest time between two such messages on one stage of a material, in s.
    """

    fitting: Fitting
    settings: str
    nacre: str
    code: str | None
    topic: str
    interval: float


@dataclass(frozen=True, eq=False)
class Task:
    """A material to fit.

    Messages name it by the token. The path is absolute, as the owner of the file has it, its
    SHA-256 in hexadecimal. The content is an array, which Dask passes on without copying it, or
    None where the file is to be read under its path.
    """

    token: str
    path: str
    sha256: str
    content: npt.NDArray[np.uint8] | None


@dataclass(frozen=True)
class Unread:
    """A worker has not the owner's file under its path: which worker, and what is there."""

    reason: str


def check(setup: Setup) -> None:
    """Raise what any fit would raise in this process.

    Raises
    ------
    NacreError
        If its nacre is another, or cannot carry out the fitting.
    """
    _check_version(setup)
    setup.fitting.check()


def work(setup: Setup, task: Task) -> Fit | Unread:
    """Carry out one fit.

    Raises
    ------
    NacreError
        If the nacre of this process is not that of the run.
    """
    _check_version(setup)
    one_blas_thread().__enter__()  # never undone: other threads of the worker fit as well
    worker = require("distributed", "cluster").get_worker()
    report = _Report(setup, task.token, worker)
    if task.content is None:
        path = Path(task.path)
        try:
            found = digest(path)
        except FormatError as error:
            return Unread(f"on worker {worker.address}: {explain(error, path)}")
        if found != task.sha256:
            return Unread(f"on worker {worker.address}: is another file, of SHA-256 {found}")
        return fit_file(path, setup.fitting, report)
    with tempfile.TemporaryDirectory(
        dir=worker.local_directory, ignore_cleanup_errors=True
    ) as folder:
        path = Path(folder) / PurePath(task.path).name
        task.content.tofile(path)
        return fit_file(path, setup.fitting, report)


def _check_version(setup: Setup) -> None:
    if nacre.__version__ != setup.nacre:
        raise NacreError(
            f"has nacre {nacre.__version__}, the run {setup.nacre}; install the same on both"
        )
    try:
        same = setup.fitting.digest == setup.settings
    except AttributeError:  # a setting that only one of them knows
        same = False
    if not same:
        raise NacreError(
            f"has a nacre {nacre.__version__} with other settings than the run's; "
            "install the same on both"
        )
    if setup.fitting.code() != setup.code:
        raise NacreError(
            f"has a nacre {nacre.__version__} of other code than the run's; "
            "install the same on both"
        )


class _Report:
    """Tells the owner of the run how a fit goes on, not too often."""

    def __init__(self, setup: Setup, token: str, worker: Any) -> None:
        self._setup, self._token, self._worker = setup, token, worker
        self._stage, self._time = "", 0.0

    def __call__(self, stage: str, done: int, total: int, note: str) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._time >= self._setup.interval:
            self._stage, self._time = stage, now
            message = [self._token, stage, int(done), int(total), note]
            self._worker.log_event(self._setup.topic, message)
