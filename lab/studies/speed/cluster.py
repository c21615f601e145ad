"""Libraries and a texture on a Dask cluster of one machine: scaling, bytes sent, what a material
costs beside its fit, what a killed worker costs.

Scheduler and workers are processes of their own; a proxy counts what passes between this process
and the scheduler. `python -m lab.studies.speed.cluster --help`.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import psutil
from distributed import Client
from distributed.deploy.subprocess import SubprocessCluster

from lab.studies.study import Study, log, prevent_oversubscription, rgl_tables
from nacre.brdf import Brdf
from nacre.formats import load_btf
from nacre.io.files import digest
from nacre.measured import merl
from nacre.measured.merl import Resolution
from nacre.neural import Recipe
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec_file import load_codec
from nacre.workflows import (
    Cluster,
    Executor,
    Fitting,
    NetworkFitting,
    Threads,
    Watcher,
    fit_library,
)
from nacre.workflows.block_work import BlockWorkers
from nacre.workflows.encoding import Encoding, encode
from nacre.workflows.executor import Job, Results, Stream
from nacre.workflows.identity import source_fingerprint
from nacre.workflows.manifest import Record
from nacre.workflows.material import Fit
from nacre.workflows.openers import TextureFile
from nacre.workflows.submission import Data
from tests.oracles.reflectances import Glossy

MATERIALS = 1000
"""Small ones, of which each costs nothing but what surrounds a fit."""
SENT = 20
"""Large ones."""


class Proxy:
    """Passes connections on to a server, and counts the bytes each way."""

    def __init__(self, server: str) -> None:
        host, port = server.removeprefix("tcp://").split(":")
        self._server = host, int(port)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self.sent, self.received = [0], [0]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            here, _ = self._listener.accept()
            there = socket.create_connection(self._server)
            for pair in ((here, there, self.sent), (there, here, self.received)):
                threading.Thread(target=self._pass, args=pair, daemon=True).start()

    @staticmethod
    def _pass(source: socket.socket, target: socket.socket, count: list[int]) -> None:
        while data := source.recv(1 << 20):
            target.sendall(data)
            count[0] += len(data)
        target.shutdown(socket.SHUT_WR)


class Nothing(Fitting):
    """A fit that takes no time."""

    holds = "neural"
    ending = ".safetensors"
    settings: Mapping[str, Any] = {}

    def fit(self, brdf: Brdf, progress: Progress) -> Brdf:
        """See :class:`nacre.workflows.Fitting`."""
        return brdf

    def encode(self, fitted: Brdf) -> bytes:
        """See :class:`nacre.workflows.Fitting`."""
        return bytes(4000)

    def losses(self, fitted: Brdf) -> dict[str, float]:
        """See :class:`nacre.workflows.Fitting`."""
        return {"training_loss": 0.1, "held_out_loss": 0.1}

    def summary(self, fitted: Brdf) -> str:
        """See :class:`nacre.workflows.Fitting`."""
        return "nothing"


class Instant(Executor):
    """Gives every material the same finished fit: what remains is the work of the owner."""

    def open(self, fitting: Fitting, watcher: Watcher) -> AbstractContextManager[Stream]:
        """See :class:`nacre.workflows.Executor`."""
        return nullcontext(self._results)

    @staticmethod
    def _results(jobs: Iterator[Job]) -> Results:
        for job in jobs:
            yield job, Fit(bytes(4000), "0" * 64, {"training_loss": 0.1, "held_out_loss": 0.1}, 2.5)


@contextmanager
def cluster(workers: int, threads: int = 1) -> Iterator[tuple[str, psutil.Process]]:
    """Address and process of a scheduler with so many workers, of so many threads each."""
    options = {"nthreads": threads}
    kinds = {"n_workers": workers, "worker_kwargs": options}
    with SubprocessCluster(**kinds, scheduler_kwargs={"dashboard": False}) as running:
        with Client(running.scheduler_address, set_as_default=False) as client:
            client.wait_for_workers(workers)
            process = psutil.Process(client.run_on_scheduler(os.getpid))
        yield running.scheduler_address, process


def timed(function: Callable[[], Any]) -> float:
    """Seconds of a call."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def fit_all(folder: Path, fitting: Fitting, executor: Executor) -> float:
    """Seconds to fit a folder."""
    with tempfile.TemporaryDirectory() as output:
        seconds = timed(lambda: fit_library([folder], output, fitting, executor=executor))
        if len(list(Path(output).glob("*.safetensors"))) < len(list(folder.iterdir())):
            sys.exit("a fit has failed")
        return seconds


def scaling(folder: Path, fitting: Fitting, draft: Fitting) -> list[tuple[str, ...]]:
    """A row for each way to fit a folder."""
    count = len(list(folder.iterdir()))
    rows, first = [], 0.0
    for workers in (1, 2):
        fit_all(folder, draft, Threads(workers))
        seconds = fit_all(folder, fitting, Threads(workers))
        first = first or seconds
        threads = "1 thread" if workers == 1 else f"{workers} threads"
        rows.append((f"{threads} of one process", *_figures(seconds, first, count), "", ""))
    first = 0.0
    for workers, data in ((1, "path"), (2, "path"), (2, "content")):
        with cluster(workers) as (address, _):
            fit_all(folder, draft, Cluster(address))
            proxy = Proxy(address)
            seconds = fit_all(folder, fitting, Cluster(proxy.address, data=data))
            first = first or seconds
            shipped = (f"{sum(n) / count:,.0f}" for n in (proxy.sent, proxy.received))
            processes = "1 worker" if workers == 1 else f"{workers} workers"
            name = f"{processes}, --data {data}"
            rows.append((name, *_figures(seconds, first, count), *shipped))
    return rows


def _figures(seconds: float, first: float, count: int) -> tuple[str, ...]:
    return f"{seconds:.1f}", f"{60 * count / seconds:.1f}", f"{first / seconds:.2f}x"


def costs(folder: Path) -> list[tuple[str, str]]:
    """What a material costs the owner, the scheduler and the network between them, in ms."""
    small, large = folder / "small", folder / "large.binary"
    small.mkdir()
    merl.save(Glossy(0.2, 0.05, 0.3), small / "0.binary", Resolution(4, 4, 4))
    for index in range(1, MATERIALS):
        shutil.copy(small / "0.binary", small / f"{index}.binary")
    merl.save(Glossy(0.2, 0.05, 0.3), large)
    size = f"{large.stat().st_size / 1e6:.0f} MB"
    owner = fit_all(small, Nothing(), Instant())
    hashing = statistics.median(timed(lambda: digest(large)) for _ in range(5))
    with cluster(2, threads=16) as (address, process):
        paths = [small / f"{index}.binary" for index in range(MATERIALS)]
        before = _cpu_seconds(process)
        mine = _through(Cluster(address, data="path"), paths).own
        scheduling = _cpu_seconds(process) - before
    with cluster(2) as (address, _):
        sent = _through(Cluster(address, data="content"), [large] * SENT).passed
        read = _through(Cluster(address, data="path"), [large] * SENT).passed
    return [
        ("owner: manifest and file of the fit, on disk", f"{1e3 * owner / MATERIALS:.2f}"),
        ("owner: processor time to submit it and take it back", f"{1e3 * mine / MATERIALS:.2f}"),
        ("scheduler: processor time", f"{1e3 * scheduling / MATERIALS:.2f}"),
        (f"owner: SHA-256 of a MERL table of {size}", f"{1e3 * hashing:.1f}"),
        (f"all: to send its content, {size}, twice", f"{1e3 * (sent - read) / SENT:.1f}"),
    ]


def _cpu_seconds(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


class Cost(NamedTuple):
    """Seconds that passed, and of this process's processor time."""

    passed: float
    own: float


def _through(executor: Executor, paths: list[Path]) -> Cost:
    """What fits of nothing cost, without a library that they go to."""
    record = Record("", None, None, None, "", "", "")
    jobs = (Job(path, record, lambda *report: None) for path in paths)
    with executor.open(Nothing(), Watcher()) as stream:
        start, own = time.perf_counter(), time.process_time()
        for _, fit in stream(jobs):
            if fit.error:
                sys.exit(fit.error)
        return Cost(time.perf_counter() - start, time.process_time() - own)


def texture_blocks(path: Path, texels: int, rounds: int) -> list[tuple[str, ...]]:
    """A row for each way to encode a texture: medians of turns, one after the other."""
    btf, codec = load_btf(path), load_codec("basis")
    opener = TextureFile(path.absolute(), None, None, source_fingerprint(path))
    blocks = -(-btf.texel_count // texels)

    def run(
        address: str | None, data: Data = "path", progress: Progress = silent
    ) -> tuple[float, Encoding]:
        workers = BlockWorkers(Cluster(address, data=data), opener) if address else None
        start = time.perf_counter()
        found = encode(btf, codec, texels_per_block=texels, workers=workers, progress=progress)
        return time.perf_counter() - start, found

    with ExitStack() as stack:
        (one, _), (two, _) = (stack.enter_context(cluster(count)) for count in (1, 2))
        ways: dict[str, Callable[[], tuple[float, Encoding]]] = {
            "one process": lambda: run(None),
            "1 worker, --data path": lambda: run(one),
            "2 workers, --data path": lambda: run(two),
            "2 workers, --data content": lambda: run(two, "content"),
            "2 workers, one killed": lambda: run(two, progress=_Killer(two, btf.texel_count // 3)),
        }
        first = run(None)[1]
        for address in (one, two):
            run(address)
        turns: list[dict[str, tuple[float, Encoding]]] = [{} for _ in range(rounds)]
        for turn in turns:
            with Client(two, set_as_default=False) as client:
                client.wait_for_workers(2)  # the killed one is started again
            for name, way in ways.items():
                turn[name] = way()
                log(f"{name}: {turn[name][0]:.1f} s")
    rows = []
    for name in ways:
        seconds = statistics.median(turn[name][0] for turn in turns)
        whole = statistics.median(turn["one process"][0] / turn[name][0] for turn in turns)
        same = all(
            np.array_equal(found.codes, first.codes) and found.errors == first.errors
            for _, found in (turn[name] for turn in turns)
        )
        rate = f"{blocks / seconds:.1f}"
        rows.append((name, rate, f"{whole:.2f}x", "yes" if same else "no"))
    return rows


class _Killer:
    """Kills a worker when so many texels are done."""

    def __init__(self, address: str, texels: int) -> None:
        self._address, self._texels = address, texels

    def __call__(self, stage: str, done: int, total: int, note: str) -> None:
        """See :class:`nacre.runtime.progress.Progress`."""
        if done >= self._texels:
            self._texels = total + 1
            with Client(self._address, set_as_default=False) as client:
                os.kill(min(client.run(os.getpid).values()), signal.SIGKILL)


def main() -> None:
    """Print Markdown tables."""
    study = Study(__doc__, __file__)
    study.add_argument("--epochs", type=int, default=100)
    study.add_argument("--materials", type=int, default=14, help="fits; even, for two workers")
    study.add_argument("--no-costs", action="store_true", help="leave out the first table")
    study.add_argument("--no-fits", action="store_true", help="leave out the second table")
    study.add_argument("--texture", type=Path, help="file; for the third table")
    study.add_argument("--texels", type=int, default=32, help="per block of the texture")
    study.add_argument("--rounds", type=int, default=5, help="turns of the third table")
    options = study.options()
    prevent_oversubscription()
    if options.texture:
        rows = texture_blocks(options.texture, options.texels, options.rounds)
        columns = "way", "blocks a second", "speed of one process", "same bits"
        study.table(columns, rows, "textures")
    tables = rgl_tables()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name, "in")
        folder.mkdir()
        for index in range(options.materials):
            table = tables[index % len(tables)]
            shutil.copy(table, folder / f"{index}-{table.name}")
        if not options.no_costs:
            study.table(("what a material costs beside its fit", "ms"), costs(Path(name)), "costs")
        if options.no_fits:
            return
        draft = NetworkFitting(Recipe(epochs=1, samples=1000))
        rows = scaling(folder, NetworkFitting(Recipe(epochs=options.epochs)), draft)
        columns = (
            f"{options.materials} fits",
            "s",
            "materials a minute",
            "speed-up",
            "bytes to the scheduler, per material",
            "bytes back",
        )
        study.table(columns, rows, "fits")


if __name__ == "__main__":
    main()
