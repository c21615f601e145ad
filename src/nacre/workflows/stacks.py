"""Fits of many materials as one batch on a PyTorch device."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from functools import partial

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.latent.estimates import Estimate
from nacre.neural import fit_many
from nacre.workflows.executor import Executor, Job, Results, Stream, Threads
from nacre.workflows.fitting import Fitting, NetworkFitting
from nacre.workflows.material import Fit, explain, finished
from nacre.workflows.watcher import Watcher


class Stacks(Executor):
    """Fits of networks on a device by :func:`nacre.fit_many`.

    One stack is in work at a time; if the process dies, all of its materials are lost.
    """

    def open(self, fitting: Fitting, watcher: Watcher) -> AbstractContextManager[Stream]:
        """See :class:`Executor`; refuses fits without a device."""
        if not isinstance(fitting, NetworkFitting) or fitting.device is None:
            raise NacreError("only networks can be fitted on a device, and it must be named")
        fitting.check()
        return nullcontext(partial(_results, fitting, fitting.device))


def usual_executor(fitting: Fitting, count: int | None = None) -> Executor:
    """A stack for fits on a device, else `count` threads, or one per core."""
    stacked = isinstance(fitting, NetworkFitting) and fitting.device is not None
    return Stacks() if stacked else Threads(count)


def _results(fitting: NetworkFitting, device: str, jobs: Iterator[Job]) -> Results:
    taken: list[tuple[Job, str | None, Estimate | None]] = []
    unread: list[tuple[Job, Fit]] = []

    def materials() -> Iterator[Brdf]:
        for job in jobs:
            try:
                job.progress("reading", 0, 1, "")
                brdf = load_brdf(job.path)
                few = fitting.estimate(brdf)
            except Exception as error:
                unread.append((job, Fit(error=explain(error, job.path))))
                continue
            taken.append((job, (brdf.source or {}).get("sha256"), few))
            yield few.material if few else brdf

    def report(stage: str, done: int, total: int, note: str) -> None:
        taken[-1][0].progress(stage, done, total, note)

    start = time.perf_counter()
    for index, result in fit_many(materials(), fitting.recipe, device=device, progress=report):
        while unread:
            yield unread.pop()
        job, sha256, few = taken[index]
        # For materials fitted together, the mean of all so far.
        seconds = (time.perf_counter() - start) / len(taken)
        try:
            if isinstance(result, Exception):
                raise result
            fit = finished(fitting, few.kept_by(result) if few else result, sha256, seconds)
        except Exception as error:
            fit = Fit(error=explain(error, job.path))
        yield job, fit
    while unread:
        yield unread.pop()
