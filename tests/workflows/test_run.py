"""A second run fits what changed, and nothing costs more than its own material."""

from __future__ import annotations

import ast
import errno
import json
import os
import shutil
import signal
import threading
import time
import weakref
from dataclasses import replace
from pathlib import Path

import pytest

import nacre
from nacre.analytic import MODELS
from nacre.errors import FormatError, NacreError
from nacre.runtime import code_fingerprint
from nacre.runtime.lock import exclusive
from nacre.workflows import (
    MANIFEST,
    AnalyticFitting,
    NetworkFitting,
    Threads,
    Watcher,
    fit_library,
    material,
)
from nacre.workflows import run as module
from tests.tiers import tiered
from tests.workflows.support import QUICK, RECIPE, Staged, contents, lines, sources, table

LAMBERT = AnalyticFitting(MODELS["lambert"], {"samples": 1000})


@pytest.fixture
def folder(tmp_path):
    for index, name in enumerate("abc"):
        table(tmp_path / f"in/{name}.binary", 5 + index)
    return tmp_path / "in"


@pytest.fixture
def output(tmp_path):
    return tmp_path / "new/lib"


@pytest.fixture
def changed(tmp_path, monkeypatch):
    """Changes every function of a module, in a copy of nacre that only fingerprints are made of."""
    source, copy = Path(nacre.__file__).parent, tmp_path / "code/nacre"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("*.safetensors", "*.pyc"))
    monkeypatch.setattr(nacre, "__file__", str(copy / "__init__.py"))

    def change(module: str) -> None:
        tree = ast.parse((copy / module).read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                node.body.insert(0, ast.Assert(ast.Constant(time.monotonic())))
        (copy / module).write_text(ast.unparse(ast.fix_missing_locations(tree)))
        forget()

    def forget() -> None:
        code_fingerprint._fingerprint.cache_clear()

    forget()
    yield change
    forget()


def test_a_library_is_fitted_once(folder, output):
    table(folder / "sub/a.binary")
    outcome = fit_library([folder], output, QUICK)
    assert sources(outcome.fitted) == {"a.binary", "b.binary", "c.binary", "sub/a.binary"}
    assert outcome.failed == outcome.unchanged == ()
    assert set(contents(output)) == {
        MANIFEST,
        *(f"{name}.safetensors" for name in ("a", "b", "c", "sub/a")),
    }
    for record in lines(output):
        material = nacre.load(output / record["output"])
        assert record["sha256"] == material.metadata["source"]["sha256"]
        assert record["losses"] == material.metadata["quality"]
        assert record["nacre"] == nacre.__version__
        assert record["seconds"] > 0
    before = contents(output)
    again = fit_library([folder], output, QUICK)
    assert again.fitted == again.failed == ()
    assert sources(again.unchanged) == sources(outcome.fitted)
    assert contents(output) == before


def test_fits_do_not_depend_on_how_many_run_at_a_time(folder, tmp_path):
    for jobs in (1, 3):
        fit_library([folder], tmp_path / str(jobs), QUICK, executor=Threads(jobs))
    for name in "abc":
        one, three = ((tmp_path / f"{jobs}/{name}.safetensors").read_bytes() for jobs in (1, 3))
        assert one == three


@pytest.mark.parametrize("same_size", [False, True])
def test_a_changed_source_is_fitted_again(folder, output, same_size):
    fit_library([folder], output, QUICK)
    path = folder / "b.binary"
    content = bytearray(table(path, 6 if same_size else 9).read_bytes())
    content[-8:] = content[-16:-8]
    path.write_bytes(content)
    outcome = fit_library([folder], output, QUICK)
    assert sources(outcome.fitted) == {"b.binary"}
    assert len(lines(output)) == 3
    assert sources(fit_library([folder], output, QUICK).fitted) == set()


def test_a_source_is_hashed_again_only_if_it_was_touched(folder, output, monkeypatch):
    fit_library([folder], output, QUICK)
    hashed = []
    digest = module.digest
    monkeypatch.setattr(module, "digest", lambda path: hashed.append(path.name) or digest(path))
    os.utime(folder / "b.binary", (1, 1))
    for expected in (["b.binary"], []):
        hashed.clear()
        assert len(fit_library([folder], output, QUICK).unchanged) == 3
        assert [name for name in hashed if name.endswith(".binary")] == expected


def test_other_settings_fit_all_again_another_version_none(folder, output, monkeypatch):
    fit_library([folder], output, QUICK)
    other = NetworkFitting(replace(RECIPE, seed=1))
    assert len(fit_library([folder], output, other).fitted) == 3
    monkeypatch.setattr(nacre, "__version__", "99")
    assert len(fit_library([folder], output, other).unchanged) == 3
    assert {line["nacre"] for line in lines(output)} != {"99"}


def test_a_change_of_code_refits_what_it_decides(folder, output, changed):
    nacre.save(nacre.load(folder / "a.binary"), folder / "d.npz")
    fit_library([folder], output, LAMBERT)
    changed("measured/merl_array.py")
    assert sources(fit_library([folder], output, LAMBERT).fitted) == {"d.npz"}
    assert sources(fit_library([folder], output, LAMBERT).fitted) == set()


@pytest.mark.slow
def test_code_is_of_the_reader_the_fit_and_the_writer(folder, changed):
    fittings = QUICK, LAMBERT
    before = [fitting.code(folder / "a.binary") for fitting in fittings]
    for paths, expected in (
        (("mitsuba/network.py", "measured/rgl.py", "cli/fit.py"), [False, False]),
        (("neural/training.py",), [True, False]),
        (("analytic/lambert.py",), [False, True]),
        (("measured/raw.py",), [True, True]),
    ):
        for path in paths:
            changed(path)
        after = [fitting.code(folder / "a.binary") for fitting in fittings]
        assert [a != b for a, b in zip(after, before, strict=True)] == expected
        before = after


@pytest.mark.slow
def test_what_a_manifest_does_not_know_the_code_of_is_fitted_again(folder, output):
    fit_library([folder], output, LAMBERT)
    older = [{k: v for k, v in line.items() if k != "code"} for line in lines(output)]
    text = "".join(json.dumps(line) + "\n" for line in older)
    (output / MANIFEST).write_text(text)
    before = {path: path.read_bytes() for path in output.glob("*.json")}
    assert len(fit_library([folder], output, LAMBERT).fitted) == 3
    assert {path: path.read_bytes() for path in output.glob("*.json")} == before
    assert len(fit_library([folder], output, LAMBERT).unchanged) == 3


@pytest.mark.parametrize("damage", tiered([b"", b"x", None], [b"x"]))
def test_a_missing_or_damaged_fit_is_made_again(folder, output, damage):
    fit_library([folder], output, QUICK)
    path = output / "b.safetensors"
    whole = path.read_bytes()
    path.unlink() if damage is None else path.write_bytes(damage + whole[1:])
    assert sources(fit_library([folder], output, QUICK).fitted) == {"b.binary"}
    assert path.read_bytes() == whole


def test_analytic_models_lie_beside_networks(folder, output):
    fit_library([folder], output, QUICK)
    outcome = fit_library([folder], output, LAMBERT)
    assert set(outcome.fitted[0].losses) == {"loss"}
    assert len(lines(output)) == 6
    assert len(fit_library([folder], output, QUICK).unchanged) == 3
    assert len(fit_library([folder], output, LAMBERT).unchanged) == 3


def test_what_fails_is_told_tried_again_and_costs_nothing_else(folder, output):
    (folder / "bad.binary").write_bytes(b"bad")

    def before(brdf, progress):
        if brdf.name == "b":
            raise ZeroDivisionError("by\nzero")
        if brdf.name == "c":
            raise MemoryError

    outcome = fit_library([folder], output, Staged(before=before))
    assert sources(outcome.fitted) == {"a.binary"}
    reasons = {record.source: record.error for record in outcome.failed}
    assert reasons["bad.binary"].startswith("is of no known format")
    assert reasons["b.binary"] == "ZeroDivisionError: by"
    assert reasons["c.binary"] == "out of memory"
    assert {line["source"]: line["error"] for line in lines(output)} == {
        "a.binary": None,
        **reasons,
    }
    (folder / "bad.binary").unlink()
    outcome = fit_library([folder], output, Staged(before=lambda brdf, progress: None))
    assert sources(outcome.fitted) == {"b.binary", "c.binary"}
    assert [line["error"] for line in lines(output)] == [None] * 3


@pytest.mark.slow
def test_a_full_disk_fails_what_it_meets_and_keeps_what_was_done(folder, output, monkeypatch):
    full = threading.Event()
    fsync = os.fsync

    def maybe(descriptor):
        if full.is_set():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(descriptor)

    def before(brdf, progress):
        if brdf.name != "a":
            full.set()

    monkeypatch.setattr(os, "fsync", maybe)
    outcome = fit_library([folder], output, Staged(before=before), executor=Threads(1))
    assert sources(outcome.fitted) == {"a.binary"}
    assert all("No space left on device" in record.error for record in outcome.failed)
    assert set(contents(output)) == {MANIFEST, "a.safetensors"}
    full.clear()
    outcome = fit_library([folder], output, QUICK)
    assert (len(outcome.fitted), len(outcome.unchanged)) == (2, 1)
    assert len(lines(output)) == 3


@pytest.mark.slow
def test_a_fit_that_could_not_be_recorded_is_made_again(folder, output, monkeypatch):
    fit_library([folder], output, QUICK)
    table(folder / "d.binary")
    monkeypatch.setattr(module.Manifest, "_append", _no_space)
    monkeypatch.setattr(module.Manifest, "tidy", lambda self, wanted: None)
    outcome = fit_library([folder], output, QUICK)
    assert sources(outcome.failed) == {"d.binary"}
    assert "library.jsonl: cannot be written: No space" in outcome.failed[0].error
    monkeypatch.undo()
    assert sources(fit_library([folder], output, QUICK).fitted) == {"d.binary"}


def _no_space(*arguments):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.slow
def test_an_interrupt_keeps_what_is_done(folder, output):
    def before(brdf, progress):
        if brdf.name == "b":
            for step in range(6000):  # until the run says that nobody waits
                if step % 1000 == 0:  # an interrupt that falls into a destructor is lost
                    os.kill(os.getpid(), signal.SIGINT)
                progress("working", 0, 1, "")
                time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        fit_library([folder], output, Staged(before=before), executor=Threads(1))
    errors = {line["source"]: line["error"] for line in lines(output)}
    assert errors == {"a.binary": None, "b.binary": module.UNFINISHED}
    assert set(contents(output)) == {MANIFEST, "a.safetensors"}
    outcome = fit_library([folder], output, QUICK)
    assert (len(outcome.fitted), len(outcome.unchanged)) == (2, 1)


def test_a_second_run_is_refused_and_a_lock_of_the_dead_is_not(folder, output):
    output.mkdir(parents=True)
    lock = output / module.LOCK
    with (
        exclusive(lock),
        pytest.raises(NacreError, match="another run is fitting into this folder"),
    ):
        fit_library([folder], output, QUICK)
    assert contents(output) == {}
    lock.touch()
    assert len(fit_library([folder], output, QUICK).fitted) == 3
    assert not lock.exists()


def test_temporaries_of_killed_runs_go_and_those_of_others_stay(folder, output):
    output.mkdir(parents=True)
    for name in (".0123456789abcdef.safetensors", ".mine.safetensors", "0123456789abcdef.json"):
        (output / name).touch()
    fit_library([folder], output, QUICK)
    assert set(contents(output)) == {
        ".mine.safetensors",
        "0123456789abcdef.json",
        MANIFEST,
        *(f"{name}.safetensors" for name in "abc"),
    }


def test_no_more_materials_are_held_than_jobs(folder, output, monkeypatch):
    for index in range(6):
        table(folder / f"more{index}.binary")
    held, most, lock = 0, 0, threading.Lock()

    def count(step):
        nonlocal held, most
        with lock:
            held += step
            most = max(most, held)

    load = material.load_brdf

    def counted(path):
        brdf = load(path)
        count(1)
        weakref.finalize(brdf, count, -1)
        return brdf

    def before(brdf, progress):
        if brdf.name.endswith(("1", "3", "5")):
            raise ValueError("errors hold frames, and frames the material")

    monkeypatch.setattr(material, "load_brdf", counted)
    outcome = fit_library([folder], output, Staged(before=before), executor=Threads(2))
    assert (len(outcome.fitted), len(outcome.failed)) == (6, 3)
    assert most <= 2
    assert held == 0


def test_a_watcher_hears_of_every_material(folder, output):
    heard = []

    class Notes(Watcher):
        def begin(self, materials):
            heard.append(materials)

        def start(self, name):
            heard.append(f"start {name}")
            return super().start(name)

        def end(self, name, error):
            heard.append(f"end {name} {error}")

    fit_library([folder / "a.binary"], output, QUICK)
    (folder / "b.binary").write_bytes(b"")
    fit_library([folder], output, QUICK, executor=Threads(1), watcher=Notes())
    assert heard == [
        2,
        "start b.binary",
        "end b.binary is empty; copy or download it again",
        "start c.binary",
        "end c.binary None",
    ]


def test_what_failed_before_or_ended_the_process_comes_last(folder, output):
    order = []

    def before(brdf, progress):
        order.append(brdf.name)
        assert {line["source"]: line["error"] for line in lines(output)}[
            f"{brdf.name}.binary"
        ] == module.UNFINISHED
        if brdf.name == "a":
            raise ValueError("not this one")

    for _ in range(2):
        assert sources(
            fit_library([folder], output, Staged(before=before), executor=Threads(1)).failed
        ) == {"a.binary"}
        table(folder / "b.binary", 9)
    assert order == ["a", "b", "c", "b", "a"]


def test_what_cannot_begin_says_so_and_makes_nothing(folder, output, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(NacreError, match="empty: no measured materials found"):
        fit_library([tmp_path / "empty"], output, QUICK)
    neural = tmp_path / "x.safetensors"
    neural.touch()
    with pytest.raises(FormatError, match="is the input as well"):
        fit_library([folder, neural], tmp_path, QUICK)
    assert set(contents(tmp_path)) == {*(f"in/{name}.binary" for name in "abc"), "x.safetensors"}
    with pytest.raises(FormatError, match="cannot be written"):
        fit_library([folder], neural, QUICK)


def test_a_device_that_is_not_there_is_found_before_the_work(folder, output):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    with pytest.raises(NacreError, match="abacus"):
        fit_library([folder], output, NetworkFitting(RECIPE, "abacus"))
    assert not output.exists()


@pytest.mark.slow
def test_a_file_in_the_place_of_a_folder_fails_its_material_only(folder, output):
    table(folder / "sub/x.binary")
    output.mkdir(parents=True)
    (output / "sub").touch()
    outcome = fit_library([folder], output, QUICK)
    assert sources(outcome.failed) == {"sub/x.binary"}
    assert len(outcome.fitted) == 3
