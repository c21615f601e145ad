"""What the network of `nacre fit` sees, and files that hold networks of the paper's inputs only."""

from __future__ import annotations

from pathlib import Path

import pytest

import nacre
from nacre.measured.merl import Resolution, tabulate
from tests.cli.support import assert_refused, run, run_json
from tests.reflectances import Glossy
from tests.scans import Gloss, scan

QUICK = "--epochs", 1, "--samples", 2000
PAPER_ONLY = "holds networks of the paper's inputs and activation only; fit with --inputs paper"


@pytest.fixture(autouse=True)
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small measured table in the working folder, and the default fit to it."""
    monkeypatch.chdir(tmp_path)
    nacre.save(tabulate(Glossy(0.3, 0.05, 0.3), Resolution(12, 10, 8)), "a.binary")
    assert run("fit", "a.binary", *QUICK) == 0


def test_the_default_is_enhanced_inputs_in_1350_bytes():
    network = nacre.load("a.safetensors")
    assert (network.inputs, network.precision, network.nbytes) == ("enhanced", "half", 1350)


def test_a_fit_to_h5_takes_the_papers_inputs_and_says_so(capsys):
    assert run("fit", "a.binary", "-o", "a.h5", *QUICK, quiet=False) == 0
    assert "note: a.h5: fitted with the paper's inputs" in capsys.readouterr().err
    network = nacre.load("a.h5")
    assert (network.inputs, network.nbytes) == ("paper", 2700)
    assert run("fit", "a.binary", "-o", "b.h5", "--inputs", "paper", *QUICK, quiet=False) == 0
    assert "note:" not in capsys.readouterr().err
    assert Path("a.h5").stat().st_size == Path("b.h5").stat().st_size


def test_whatever_else_would_be_in_an_h5_is_refused_by_its_remedy(capsys):
    assert_refused(capsys, PAPER_ONLY, "fit", "a.binary", "--inputs", "enhanced", "-o", "a.h5")
    assert_refused(capsys, PAPER_ONLY, "convert", "a.safetensors", "-o", "a.h5")
    assert run("fit", "a.binary", "--inputs", "paper", "-o", "b.safetensors", *QUICK) == 0
    assert run("convert", "b.safetensors", "-o", "b.h5") == 0


def test_a_scan_gets_the_papers_inputs_in_single_precision():
    nacre.save(scan(Gloss(), 300), "scan.csv")
    assert run("fit", "scan.csv", *QUICK) == 0
    network = nacre.load("scan.safetensors")
    assert (network.inputs, network.precision) == ("paper", "single")
    assert run("fit", "scan.csv", "--inputs", "enhanced", *QUICK) == 0
    assert nacre.load("scan.safetensors").inputs == "enhanced"


def test_codes_take_the_default_network_and_hypernetworks_give_the_papers_inputs(capsys):
    for name in ("neural", "hypernetwork"):
        facts = run_json(
            capsys, "latent", "encode", "a.safetensors", "--basis", name, "-o", "a.json"
        )
        assert facts["code_dim"] == 32
    assert run("latent", "decode", "a.json", "--basis", "hypernetwork", "-o", "c.h5") == 0
    assert nacre.load("c.h5").inputs == "paper"
