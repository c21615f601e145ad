"""Fits, and other work, on a Dask cluster."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

import nacre
from nacre.errors import NacreError, reason, require
from nacre.runtime.parallel import core_count
from nacre.workflows.executor import Executor, Stream
from nacre.workflows.fit_work import Fits
from nacre.workflows.fitting import Fitting
from nacre.workflows.submission import Data, Submission
from nacre.workflows.watcher import Watcher
from nacre.workflows.worker import JobT, ResultT, Setup, Work, check

LOCAL = "local"
"""Address for worker processes on this machine, started for the run."""

_SILENT = logging.CRITICAL + 1
"""Above all levels: one error that names the cluster tells what went wrong."""

_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""For local workers, which a terminal's Ctrl-C reaches too: this process ends them."""

_MESSAGES = 200
"""Most progress messages per second from all workers together."""


class Cluster(Executor):
    """Work in the worker processes of a Dask cluster, as much at a time as it has threads.

    This process reads or hashes the measured files and collects the results.

    Parameters
    ----------
    address
        Address of the scheduler, `tcp://host:8786` or `tls://host:8786`; or :data:`LOCAL`.
    data
        How workers get the measured files: see :data:`nacre.workflows.submission.Data`.
    workers
        Processes of a local cluster; one per core if None.
    patience
        Seconds to wait for the scheduler, and for a worker while there is none.
    """

    def __init__(
        self,
        address: str = LOCAL,
        *,
        data: Data = "auto",
        workers: int | None = None,
        patience: float = 30.0,
    ) -> None:
        self.data = data
        self._address, self._workers, self._patience = address, workers, patience

    def open(self, fitting: Fitting, watcher: Watcher) -> AbstractContextManager[Stream]:
        return self.connect(Fits(fitting), watcher)

    @contextmanager
    def connect(
        self, work: Work[JobT, ResultT], watcher: Watcher
    ) -> Iterator[Submission[JobT, ResultT]]:
        """Prepare work of any kind, as :meth:`open` does fits: the block gets the stream for its
        jobs.
        """
        distributed = require("distributed", "cluster")
        # Otherwise Dask warns about every file that is sent.
        settings = {"distributed.admin.large-graph-warning-threshold": "1 TiB"}
        with ExitStack() as stack:
            stack.enter_context(distributed.utils.silence_logging_cmgr(_SILENT))
            stack.enter_context(require("dask", "cluster").config.set(settings))
            client = stack.enter_context(self._client(distributed, stack))
            try:
                client.wait_for_workers(1, self._patience)
            except TimeoutError as error:
                raise self._error(f"has no worker after {self._patience:g} s") from error
            if client.dashboard_link:
                watcher.dashboard(client.dashboard_link)
            interval = max(0.5, sum(client.nthreads().values()) / _MESSAGES)
            topic = f"nacre-{secrets.token_hex(8)}"
            setup = Setup(work, work.digest, nacre.__version__, work.code(), topic, interval)
            self._check(client, setup)
            yield Submission(client, setup, self._address, self.data, self._patience)

    def _client(self, distributed: Any, stack: ExitStack) -> Any:
        """A client of the cluster; a local cluster is started first."""
        place: Any = self._address
        if place == LOCAL:
            cluster = distributed.LocalCluster(
                n_workers=self._workers or core_count(),
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",
                silence_logs=_SILENT,
                preload=[_IGNORE_INTERRUPTS],
            )
            place = stack.enter_context(cluster)
            # What the scheduler in this process does at each garbage collection may swallow Ctrl-C.
            require("distributed.gc", "cluster").disable_gc_diagnosis(force=True)
        try:
            return distributed.Client(place, timeout=self._patience, set_as_default=False)
        except OSError as error:
            text = f"no Dask scheduler has answered for {self._patience:g} s"
            raise self._error(text) from error
        except (
            ValueError,
            RuntimeError,
            TypeError,
        ) as error:  # wrong address, or no TLS
            raise self._error(f"cannot be used: {reason(error)}") from error

    def _check(self, client: Any, setup: Setup) -> None:
        """Refuse workers that would fail; those that join later are checked by their first task."""
        for worker, error in client.run(check, setup, on_error="return").items():
            if isinstance(error, NacreError):
                raise self._error(f"worker {worker}: {error}") from error
            if error is not None:
                text = f"{type(error).__name__}: {reason(error)}"
                raise self._error(f"worker {worker} does not have this nacre: {text}") from error

    def _error(self, text: str) -> NacreError:
        return NacreError(f"{self._address}: {text}")
