"""Libraries whose materials train together: each is fitted once, and fails by itself."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'latent'")

import nacre
from nacre.analytic import MODELS
from nacre.errors import NacreError
from nacre.neural import fitting
from nacre.workflows import (
    AnalyticFitting,
    NetworkFitting,
    Stacks,
    Threads,
    Watcher,
    fit_files,
    fit_library,
)
from tests.cli.support import run
from tests.workflows.support import QUICK, RECIPE, contents, lines, sources, table

LISTED = "folder", "files", "mixed"
ON_DEVICE = NetworkFitting(RECIPE, "cpu")


@pytest.fixture
def folder(tmp_path):
    for index, name in enumerate("abc"):
        table(tmp_path / f"in/{name}.binary", 5 + index)
    (tmp_path / "in/bad.binary").write_bytes(b"not a table")
    return tmp_path / "in"


def test_materials_that_train_together_are_as_if_alone(folder, tmp_path):
    outcomes = [
        fit_library([folder], tmp_path / name, ON_DEVICE, executor=executor)
        for name, executor in (("together", Stacks()), ("alone", Threads(1)))
    ]
    for outcome in outcomes:
        assert sources(outcome.fitted) == {"a.binary", "b.binary", "c.binary"}
        assert sources(outcome.failed) == {"bad.binary"}
    for name in "abc":
        together, alone = (
            nacre.load(tmp_path / where / f"{name}.safetensors") for where in ("together", "alone")
        )
        assert together.metadata["source"] == alone.metadata["source"]
        for a, b in zip(together.layers, alone.layers, strict=True):
            np.testing.assert_allclose(a.weights, b.weights, atol=2e-2)
    for record in lines(tmp_path / "together"):
        if record["error"] is None:
            material = nacre.load(tmp_path / "together" / record["output"])
            assert record["sha256"] == material.metadata["source"]["sha256"]
            assert record["losses"] == material.metadata["quality"]
            assert record["seconds"] > 0


def test_a_second_run_fits_only_what_failed(folder, tmp_path):
    fit_library([folder], tmp_path / "lib", ON_DEVICE, executor=Stacks())
    before = contents(tmp_path / "lib")
    table(folder / "bad.binary")
    outcome = fit_library([folder], tmp_path / "lib", ON_DEVICE, executor=Stacks())
    assert sources(outcome.fitted) == {"bad.binary"}
    assert sources(outcome.unchanged) == {"a.binary", "b.binary", "c.binary"}
    after = contents(tmp_path / "lib")
    assert {k: after[k] for k in before if "json" not in k} == {
        k: v for k, v in before.items() if "json" not in k
    }


def test_an_interrupted_stack_is_fitted_by_the_next_run(folder, tmp_path):
    class Interrupt(Watcher):
        def start(self, name):
            def report(stage, done, total, note):
                if stage == "training":
                    raise KeyboardInterrupt

            return report

    with pytest.raises(KeyboardInterrupt):
        fit_library([folder], tmp_path / "lib", ON_DEVICE, executor=Stacks(), watcher=Interrupt())
    assert not list((tmp_path / "lib").glob("*.safetensors"))
    outcome = fit_library([folder], tmp_path / "lib", ON_DEVICE, executor=Stacks())
    assert sources(outcome.fitted) == {"a.binary", "b.binary", "c.binary"}


@pytest.fixture
def stacked(monkeypatch):
    """How many materials each batch had."""
    sizes, fit_stack = [], fitting._fit_stack
    monkeypatch.setattr(
        fitting,
        "_fit_stack",
        lambda stack, *rest: (sizes.append(len(stack)), fit_stack(stack, *rest))[1],
    )
    return sizes


@pytest.mark.slow
def test_files_train_together_as_those_of_a_folder_do(folder, tmp_path, stacked, capsys):
    options = ["--device", "cpu", "--hidden", "4", "--epochs", "1", "--samples", "1000"]
    files = [folder / f"{name}.binary" for name in ("a", "b", "bad", "c")]
    mixed = [files[0], tmp_path / "rest"]
    shutil.copytree(folder, mixed[1], ignore=shutil.ignore_patterns("a.*"))
    for name, inputs in (("folder", [folder]), ("files", files), ("mixed", mixed)):
        (tmp_path / name).mkdir()
        assert run("fit", *inputs, "-o", tmp_path / name, *options) == 1
        told = capsys.readouterr()
        assert "bad.binary: is of no known format" in told.err
        assert len(list((tmp_path / name).glob("*.safetensors"))) == 3
    assert stacked == [3, 3, 3]
    for name in "abc":
        fits = {(tmp_path / where / f"{name}.safetensors").read_bytes() for where in LISTED}
        assert len(fits) == 1
    (tmp_path / "files/b.safetensors").write_bytes(b"mine")
    assert run("fit", *files[:2], "-o", tmp_path / "files", *options) == 2
    assert "b.safetensors: exists" in capsys.readouterr().err
    assert (tmp_path / "files/b.safetensors").read_bytes() == b"mine"
    assert stacked[3:] == []


def test_fits_for_a_device_are_stacked_unless_an_executor_is_named(folder, tmp_path, stacked):
    paths = [folder / f"{name}.binary" for name in "ab"]
    outputs = [tmp_path / f"{name}.safetensors" for name in "ab"]
    for found in (fit_files(paths, outputs, ON_DEVICE), fit_files(paths, outputs, QUICK)):
        assert [file.fit.error for file in found] == [None, None]
    fit_library([folder], tmp_path / "lib", ON_DEVICE)
    fit_library([folder], tmp_path / "alone", ON_DEVICE, executor=Threads(1))
    assert stacked == [2, 3, 1, 1, 1]


@pytest.mark.parametrize(
    ("fitting", "words"),
    [
        (QUICK, "only networks can be fitted on a device"),
        (AnalyticFitting(MODELS["lambert"]), "only networks can be fitted on a device"),
        (replace(ON_DEVICE, device="abacus"), "device 'abacus' cannot be used"),
    ],
)
def test_what_cannot_be_stacked_is_refused(folder, tmp_path, fitting, words):
    with pytest.raises(NacreError, match=words):
        fit_library([folder], tmp_path / "lib", fitting, executor=Stacks())
    assert not (tmp_path / "lib").exists()
