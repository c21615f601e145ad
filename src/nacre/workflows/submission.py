"""Submission of the jobs of a run to a Dask cluster, and collection of their results."""

from __future__ import annotations

import queue
import secrets
import time
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeAlias

from nacre.errors import FormatError, NacreError, reason, require
from nacre.workflows.worker import JobT, ResultT, Setup, Task, Unread, Work, carry_out

Data: TypeAlias = Literal["auto", "path", "content"]
"""How workers get measured files: "path", they read the same path; "content", it is sent to them;
"auto", it is sent if a worker does not find the same content under the path."""

_PER_THREAD = 2  # jobs in flight per thread of the cluster: one in work, and the next
_MOST_BYTES = 1 << 30  # in flight, which the scheduler holds in memory


class EndedError(NacreError):
    """The cluster has ended a run, through no fault of its jobs: what is finished is kept."""


@dataclass(frozen=True)
class _Flight(Generic[JobT]):
    """A job on the cluster; `sent` is the bytes that went with it."""

    job: JobT
    future: Any
    sent: int


class Submission(Generic[JobT, ResultT]):
    """Carries out jobs on a cluster, sending only as many at a time as keep it busy.

    The Dask client is connected, and the address is for messages. If no worker is left, it waits
    `patience` seconds for one.
    """

    def __init__(
        self, client: Any, setup: Setup, address: str, data: Data, patience: float
    ) -> None:
        self._client, self._setup, self._data = client, setup, data
        self._work: Work[JobT, ResultT] = setup.work
        self._address, self._patience = address, patience
        self._flights: dict[str, _Flight[JobT]] = {}
        self._unread: deque[JobT] = deque()
        self._done: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._threads, self._asked, self._seen = 1, -1.0, time.monotonic()

    def __call__(self, jobs: Iterator[JobT]) -> Generator[tuple[JobT, ResultT], None, None]:
        """Jobs with their results, in any order; see :data:`nacre.workflows.executor.Stream`."""
        self._client.subscribe_topic(self._setup.topic, self._report)
        try:
            while True:
                yield from self._submit(jobs)
                if not self._flights:
                    return
                yield from self._collect()
        except OSError as error:  # from a call to the scheduler; errors of files are handled
            raise self._end("the connection to the scheduler is lost") from error

    def _submit(self, jobs: Iterator[JobT]) -> Iterator[tuple[JobT, ResultT]]:
        """Send jobs while there is room; return those that cannot be read."""
        room = _PER_THREAD * self._thread_count()
        flights = self._flights.values()
        while len(flights) < room and sum(flight.sent for flight in flights) < _MOST_BYTES:
            send = self._data == "content" or bool(self._unread)
            job = self._unread.popleft() if self._unread else next(jobs, None)
            if job is None:
                return
            try:
                item, content = self._work.pack(job, send=send)
            except (OSError, FormatError) as error:
                yield job, self._work.failed(job, error)
                continue
            key = f"{self._work.verb}-{secrets.token_hex(16)}"
            sent = self._work.nbytes + (0 if content is None else content.nbytes)
            task = Task(key, item, content)
            future = self._client.submit(carry_out, self._setup, task, key=key, pure=False)
            self._flights[key] = _Flight(job, future, sent)
            future.add_done_callback(lambda future: self._done.put(future.key))

    def _collect(self) -> Iterator[tuple[JobT, ResultT]]:
        """Return all finished jobs, after waiting a while for one."""
        futures = {key: self._flights[key].future for key in self._done_keys()}
        # A job whose worker has died since is pending again.
        whole = {k: f for k, f in futures.items() if f.status not in ("error", "cancelled")}
        results = self._client.gather(whole, errors="skip") if whole else {}
        for key, future in futures.items():
            job = self._flights.pop(key).job
            result = results.get(key) or self._failed(job, future)
            future.release()  # its destructor would swallow an interrupt
            if not isinstance(result, Unread):
                yield job, result
            elif self._data == "auto":
                self._unread.append(job)
            else:
                yield job, self._work.failed(job, NacreError(result.reason))
        if self._client.status != "running":
            raise OSError(f"the client is {self._client.status}")

    def _done_keys(self) -> list[str]:
        """Keys of the jobs that have ended since the last call; waits up to a second for one."""
        keys = []
        with suppress(queue.Empty):
            keys.append(self._done.get(timeout=1.0))
            while True:
                keys.append(self._done.get_nowait())
        return keys

    def _failed(self, job: JobT, future: Any) -> ResultT:
        """What becomes of a job without a result; raises if the fault is not its own."""
        if future.cancelled():
            raise self._end("the scheduler has ended or has dropped the work")
        error = future.exception()
        if isinstance(error, require("distributed", "cluster").KilledWorker):
            times = error.allowed_failures + 1
            return self._work.failed(job, EndedError(f"killed its worker {times} times"))
        if isinstance(error, NacreError):
            raise self._end(f"a worker {error}")
        raise self._end(f"{type(error).__name__}: {reason(error)}")

    def _thread_count(self) -> int:
        """Number of threads of the cluster a moment ago; at least 1."""
        now = time.monotonic()
        if now - self._asked > 1.0:
            self._threads = sum(self._client.nthreads().values())
            self._asked = now
            if self._threads:
                self._seen = now
            elif now - self._seen > self._patience:
                raise self._end(f"has had no worker for {self._patience:g} s")
        return max(1, self._threads)

    def _report(self, event: tuple[float, Any]) -> None:
        """Pass on the progress of a worker, unless the job is already back."""
        token, *progress = event[1]
        if flight := self._flights.get(token):
            flight.job.progress(*progress)

    def _end(self, why: str) -> EndedError:
        return EndedError(f"{self._address}: {why}; {self._work.kept}")
