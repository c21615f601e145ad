"""What a worker of a Dask cluster does: it fits one material, read from a path or sent to it."""

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
    """What workers must know about a run, as its owner has it."""

    fitting: Fitting
    settings: str  # digest of the fitting
    nacre: str  # version
    code: str | None  # fingerprint of the code that determines fits
    topic: str  # for messages about progress
    interval: float  # shortest time in s between two messages about a stage of a material


@dataclass(frozen=True, eq=False)
class Task:
    """A material to fit."""

    token: str  # its name in messages
    path: str  # absolute, for the owner of the run
    sha256: str  # in hexadecimal
    content: npt.NDArray[np.uint8] | None  # Dask sends arrays without a copy; None: read the path


@dataclass(frozen=True)
class Unread:
    """A worker does not have the owner's file under its path, for this reason."""

    reason: str


def check(setup: Setup) -> None:
    """Raise a NacreError if this process has another nacre, or cannot carry out the fits."""
    _check_version(setup)
    setup.fitting.check()


def work(setup: Setup, task: Task) -> Fit | Unread:
    """Carry out one fit; raises a NacreError if this process has another nacre than the run."""
    _check_version(setup)
    one_blas_thread().__enter__()  # never undone: other threads of the worker fit too
    worker = require("distributed", "cluster").get_worker()
    report = _Report(setup, task.token, worker)
    if task.content is None:
        path = Path(task.path)
        try:
            found = digest(path)
        except FormatError as error:
            return Unread(f"on worker {worker.address}: {explain(error, path)}")
        if found != task.sha256:
            return Unread(f"on worker {worker.address}: is another file, with SHA-256 {found}")
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
            f"has nacre {nacre.__version__}, but the run {setup.nacre}; install the same on both"
        )
    try:
        same = setup.fitting.digest == setup.settings
    except AttributeError:  # a setting that only one side knows
        same = False
    if not same:
        raise NacreError(
            f"has a nacre {nacre.__version__} with other settings than the run's; "
            "install the same on both"
        )
    if setup.fitting.code() != setup.code:
        raise NacreError(
            f"has a nacre {nacre.__version__} with other code than the run's; "
            "install the same on both"
        )


class _Report:
    """Reports the progress of a fit to the owner of the run, not too often."""

    def __init__(self, setup: Setup, token: str, worker: Any) -> None:
        self._setup, self._token, self._worker = setup, token, worker
        self._stage, self._time = "", 0.0

    def __call__(self, stage: str, done: int, total: int, note: str) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._time >= self._setup.interval:
            self._stage, self._time = stage, now
            message = [self._token, stage, int(done), int(total), note]
            self._worker.log_event(self._setup.topic, message)
