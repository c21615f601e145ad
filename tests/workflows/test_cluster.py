"""Fits on a Dask cluster of real processes: as here, whatever happens to workers and scheduler."""

from __future__ import annotations

import hashlib
import os
import signal
import socket
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

import nacre
from nacre.analytic import MODELS
from nacre.errors import MissingExtraError, NacreError
from nacre.workflows import (
    AnalyticFitting,
    Cluster,
    NetworkFitting,
    Watcher,
    fit_library,
    fit_work,
    submission,
)
from nacre.workflows import run as module
from nacre.workflows.fit_work import Fits
from nacre.workflows.worker import Setup, Task, carry_out
from tests.tiers import tiered
from tests.workflows.processes import ALLOWED_FAILURES, Scheduler, scheduler
from tests.workflows.support import QUICK, RECIPE, contents, eventually, lines, sources, table

pytest.importorskip("distributed", reason="needs the extra 'cluster'")


@dataclass(frozen=True)
class Held(NetworkFitting):
    """A quick fit; that of material b waits in its worker until a file named "go" is there."""

    recipe: nacre.Recipe = RECIPE
    folder: Path = Path()

    def fit(self, brdf, progress):
        if brdf.name == "b":
            (self.folder / f"{os.getpid()}.worker").touch()
            eventually((self.folder / "go").exists)
        return super().fit(brdf, progress)

    def worker(self) -> int:
        """The process that material b waits in, as soon as it does."""
        return int(eventually(lambda: list(self.folder.glob("*.worker")))[0].stem)

    def go(self) -> None:
        """Let it go on."""
        (self.folder / "go").touch()


@dataclass(frozen=True)
class Deadly(NetworkFitting):
    """A fit that no process outlives."""

    recipe: nacre.Recipe = RECIPE

    def fit(self, brdf, progress):
        os.kill(os.getpid(), signal.SIGKILL)


@dataclass(frozen=True)
class Changing(NetworkFitting):
    """Settings that workers see otherwise from when a file is there."""

    recipe: nacre.Recipe = RECIPE
    file: Path = Path()

    @property
    def settings(self):
        return {**super().settings, "seen": self.file.exists()}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Scheduler:
    with scheduler(tmp_path_factory.mktemp("cluster")) as running, running.workers(2):
        yield running


@pytest.fixture
def folder(tmp_path):
    for index, name in enumerate("abcdef"):
        table(tmp_path / f"in/{name}.binary", 5 + index)
    return tmp_path / "in"


@pytest.fixture
def output(tmp_path):
    return tmp_path / "lib"


@pytest.fixture
def here(folder, tmp_path) -> dict[str, bytes]:
    """What a run in this process makes, without the manifest."""
    fit_library([folder], tmp_path / "here", QUICK)
    return fits(tmp_path / "here")


def fits(folder: Path) -> dict[str, bytes]:
    return {n: data for n, data in contents(folder).items() if n.endswith(".safetensors")}


def aside(function) -> threading.Thread:
    """Run a function in a thread."""
    thread = threading.Thread(target=function, daemon=True)
    thread.start()
    return thread


@pytest.mark.slow
def test_a_killed_worker_costs_nothing(cluster, folder, output, here, tmp_path):
    fitting = Held(folder=tmp_path)

    def kill() -> None:
        os.kill(fitting.worker(), signal.SIGKILL)
        fitting.go()

    killer = aside(kill)
    outcome = fit_library([folder], output, fitting, executor=Cluster(cluster.address))
    killer.join()
    assert len(outcome.fitted) == 6
    assert len(list(tmp_path.glob("*.worker"))) == 2
    assert [line["source"] for line in lines(output)] == [f"{n}.binary" for n in "abcdef"]
    assert all(line["error"] is None for line in lines(output))
    assert fits(output) == here
    again = fit_library([folder], output, QUICK, executor=Cluster(cluster.address))
    assert (len(again.unchanged), again.fitted, again.failed) == (6, (), ())


@pytest.mark.slow
@pytest.mark.parametrize("data", tiered(["path", "content"], ["path"]))
def test_bad_files_cost_nothing_else(cluster, folder, output, here, data):
    (folder / "bad.binary").write_bytes(b"bad")
    (folder / "empty.binary").touch()
    executor = Cluster(cluster.address, data=data)
    outcome = fit_library([folder], output, QUICK, executor=executor)
    reasons = {record.source: record.error for record in outcome.failed}
    assert set(reasons) == {"bad.binary", "empty.binary"}
    assert reasons["bad.binary"].startswith("is of no known format")
    assert reasons["empty.binary"] == "is empty; copy or download it again"
    assert fits(output) == here
    assert not list(cluster.folder.rglob("*.binary"))


@pytest.mark.slow
def test_contents_are_sent_where_a_worker_has_another_file(
    cluster, folder, output, here, monkeypatch
):
    """The owner hashes another file than workers find, as on machines that share nothing."""
    digest = fit_work.digest

    def other(path):
        return digest(path) if path.name in "abc" else "0" * 64

    monkeypatch.setattr(fit_work, "digest", other)
    monkeypatch.setattr(submission, "_MOST_BYTES", 1)
    outcome = fit_library([folder], output, QUICK, executor=Cluster(cluster.address, data="path"))
    assert len(outcome.failed) == 6
    for record in outcome.failed:
        found = hashlib.sha256((folder / record.source).read_bytes()).hexdigest()
        assert record.error.startswith("on worker tcp://127.0.0.1:")
        assert record.error.endswith(f"is another file, with SHA-256 {found}")
    outcome = fit_library([folder], output, QUICK, executor=Cluster(cluster.address))
    assert len(outcome.fitted) == 6
    assert fits(output) == here


@pytest.mark.slow
def test_analytic_models_and_what_a_watcher_hears(cluster, folder, output):
    heard: dict[str, list[str]] = {}

    class Notes(Watcher):
        def start(self, name):
            stages = heard.setdefault(name, [])
            return lambda stage, done, total, note: stages.append(stage)

        def end(self, name, error):
            heard[name].append(str(error))

    fitting = AnalyticFitting(MODELS["lambert"], {"samples": 1000})
    executor = Cluster(cluster.address)
    outcome = fit_library([folder], output, fitting, executor=executor, watcher=Notes())
    assert len(outcome.fitted) == 6
    assert set(heard) == {f"{name}.binary" for name in "abcdef"}
    assert all(notes[0] == "reading" and notes[-1] == "None" for notes in heard.values())


@pytest.mark.slow
def test_a_material_that_kills_its_workers_fails(cluster, folder, output):
    executor = Cluster(cluster.address)
    outcome = fit_library([folder / "a.binary"], output, Deadly(), executor=executor)
    assert [record.error for record in outcome.failed] == [
        f"killed its worker {ALLOWED_FAILURES + 1} times"
    ]
    assert len(fit_library([folder], output, QUICK, executor=executor).fitted) == 6


@pytest.mark.slow
def test_an_interrupt_keeps_what_is_done(cluster, folder, output, here, tmp_path):
    fitting = Held(folder=tmp_path)

    class Interrupt(Watcher):
        """As Ctrl-C would: a signal that falls into a destructor is lost."""

        def end(self, name, error):
            fitting.worker()
            raise KeyboardInterrupt

    executor = Cluster(cluster.address)
    with pytest.raises(KeyboardInterrupt):
        fit_library([folder], output, fitting, executor=executor, watcher=Interrupt())
    fitting.go()
    errors = {line["source"]: line["error"] for line in lines(output)}
    assert set(errors.values()) == {None, module.UNFINISHED}
    assert errors["b.binary"] == module.UNFINISHED
    done = {source for source, error in errors.items() if error is None}
    outcome = fit_library([folder], output, QUICK, executor=Cluster(cluster.address))
    assert sources(outcome.unchanged) == done
    assert sources(outcome.fitted) == {f"{n}.binary" for n in "abcdef"} - done
    assert fits(output) == here


@pytest.mark.slow
def test_other_versions_and_settings_are_refused(cluster, folder, output, tmp_path, monkeypatch):
    class Join(Watcher):
        def begin(self, materials):
            fitting.file.touch()

    fitting = Changing(file=tmp_path / "seen")
    with pytest.raises(NacreError, match=r"a worker has a nacre .* with other settings"):
        fit_library([folder], output, fitting, executor=Cluster(cluster.address), watcher=Join())
    assert fits(output) == {}
    monkeypatch.setattr(nacre, "__version__", "99")
    with pytest.raises(
        NacreError, match=r"worker tcp://.*: has nacre 0.*, but the run 99; install"
    ):
        fit_library([folder], tmp_path / "other", QUICK, executor=Cluster(cluster.address))
    assert not (tmp_path / "other").exists()


@pytest.mark.slow
def test_a_setting_that_only_one_side_knows_is_a_difference():
    older = NetworkFitting(RECIPE)
    object.__delattr__(older, "recipe")
    setup = Setup(Fits(older), QUICK.digest, nacre.__version__, QUICK.code(), "topic", 1.0)
    with pytest.raises(NacreError, match="with other settings"):
        carry_out(setup, Task("token", ("a.binary", ""), None))


@pytest.mark.slow
def test_a_worker_of_other_code_is_refused():
    setup = Setup(Fits(QUICK), QUICK.digest, nacre.__version__, "other", "topic", 1.0)
    with pytest.raises(NacreError, match="with other code than the run's"):
        carry_out(setup, Task("token", ("a.binary", ""), None))


@pytest.mark.slow
def test_a_cluster_that_is_not_there_or_goes_away(folder, output, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        nobody = f"tcp://127.0.0.1:{server.getsockname()[1]}"
    for address, words in (
        (nobody, f"{nobody}: no Dask scheduler has answered for 0.5 s"),
        ("wrong://127.0.0.1:1", "wrong://127.0.0.1:1: cannot be used: unknown address scheme"),
    ):
        with pytest.raises(NacreError, match=words):
            fit_library([folder], output, QUICK, executor=Cluster(address, patience=0.5))
    (tmp_path / "cluster").mkdir()
    with scheduler(tmp_path / "cluster") as running:
        with pytest.raises(NacreError, match=r"has no worker after 0\.5 s"):
            fit_library([folder], output, QUICK, executor=Cluster(running.address, patience=0.5))
        assert not output.exists()
        fitting = Held(folder=tmp_path)

        def kill() -> None:
            eventually(lambda: output.exists() and len(fits(output)) == 1)
            running.process.send_signal(signal.SIGKILL)

        with running.workers(1):
            killer = aside(kill)
            begun = time.monotonic()
            with pytest.raises(NacreError, match="run again to continue"):
                fit_library([folder], output, fitting, executor=Cluster(running.address))
            assert time.monotonic() - begun < 60
            killer.join()
    finished = {line["source"] for line in lines(output) if line["error"] is None}
    assert finished == {"a.binary"}
    assert len(fit_library([folder], output, QUICK).unchanged) == 1


def test_without_dask_the_extra_is_named(folder, output, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'nacre-materials\[cluster\]'"):
        fit_library([folder], output, QUICK, executor=Cluster())
