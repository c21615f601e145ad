"""`nacre plot`, and what `nacre info` and `nacre compare` give to other programs."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.metrics import albedo
from nacre.neural import Layer, NeuralBrdf
from tests.cli.support import run


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two neural materials."""
    folder = tmp_path_factory.mktemp("materials")
    random = np.random.default_rng(0)
    for name in ("a", "b"):
        layers = [
            Layer(random.normal(0, 0.5, (6, 8)).astype(np.float32), np.zeros(8, np.float32)),
            Layer(random.normal(0, 0.2, (8, 3)).astype(np.float32), np.full(3, 0.2, np.float32)),
        ]
        nacre.save(NeuralBrdf(layers), folder / f"{name}.safetensors")
    (folder / "cut.safetensors").write_bytes((folder / "a.safetensors").read_bytes()[:-100])
    return folder


@pytest.fixture
def here(folder, tmp_path, monkeypatch):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_plot_writes_a_picture(here, ending, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    options = ["--incidence", "0,60.5", "--channel", "rgb", "--cosine", "--azimuth", 20]
    files = ["a.safetensors", "b.safetensors", here / "a.safetensors", "a.safetensors"]
    assert run("plot", *files, "-o", f"x.{ending}", *options) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(f"x.{ending}: a.safetensors, b.safetensors, ")
    assert printed.endswith("a.safetensors, a.safetensors (2)\n")
    head = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending]
    assert (here / f"x.{ending}").read_bytes().startswith(head)


def test_plots_default_to_lobes_png(here):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    assert run("plot", "a.safetensors") == 0
    assert (here / "lobes.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plot"], "Missing argument"),
        (["plot", "a.safetensors", "-o", "x.jpg"], "x.jpg: a plot ends in one of .png"),
        (["plot", "a.safetensors", "-o", "x"], "x: a plot ends in one of .png"),
        (["plot", "a.safetensors", "-o", "absent/x.png"], "does not exist; create it"),
        (["plot", "a.safetensors", "--incidence", "90"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--incidence", "a"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--incidence", "nan"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--floor", "0"], "0.0 is not in the range"),
        (["plot", "a.safetensors", "--azimuth", "nan"], "is not a finite number"),
        (["plot", "a.safetensors", "--floor", "nan"], "is not a finite number"),
        (["plot", "a.safetensors", "--channel", "hue"], "'hue' is not one of"),
        (["plot", *["a.safetensors"] * 8], "at most 7 materials"),
        (["plot", "a.safetensors", "cut.safetensors"], "cut.safetensors"),
        (["plot", "none.safetensors"], "none.safetensors: cannot be read"),
        (["info", "a.safetensors", "--plot", "x.jpg"], "x.jpg: a plot ends in one of .png"),
        (["info", "a.safetensors", "--plot", "absent/x.png"], "does not exist; create it"),
        (["info", *["a.safetensors"] * 8, "--plot", "x.png"], "at most 7 materials"),
        (["info", "cut.safetensors", "--plot", "x.png", "--json"], "cut.safetensors"),
    ],
)
def test_wrong_usage_says_so_before_any_work(here, capsys, arguments, words):
    before = sorted(here.iterdir())
    assert run(*arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err
    assert printed.err.startswith("nacre: ")
    assert printed.err.count("\n") == 1
    assert sorted(here.iterdir()) == before


def test_the_missing_extra_is_named_before_any_work(here, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    for arguments in (["plot", "cut.safetensors"], ["info", "cut.safetensors", "--plot", "x.png"]):
        assert run(*arguments) == 2
        assert "nacre-materials[plot]" in capsys.readouterr().err


def test_info_shows_energy_reciprocity_and_units(here, capsys):
    assert run("info", "a.safetensors") == 0
    printed = capsys.readouterr().out
    expected = albedo(nacre.load("a.safetensors"), 0.0).value
    (line,) = [line for line in printed.splitlines() if "albedo at 0 degrees" in line]
    assert ", ".join(f"{v:.4g}" for v in expected) in line
    assert "[red, green, blue: part of the light that is reflected]" in line
    for words in ("reciprocity error", "energy", "unknown pairs", "largest albedo at"):
        assert words in printed
    assert run("info", "a.safetensors", "--no-physics") == 0
    assert "albedo" not in capsys.readouterr().out


def test_info_gives_the_same_facts_as_json(here, capsys):
    assert run("info", "a.safetensors", "b.safetensors") == 0
    lines = capsys.readouterr().out.splitlines()
    assert run("info", "a.safetensors", "b.safetensors", "--json") == 0
    first, second = json.loads(capsys.readouterr().out)
    for item in (first, second):
        assert set(item["units"]) <= set(item["facts"])
        for key in item["facts"]:
            assert sum(line.startswith(f"  {key}  ") for line in lines) == 2, key
    assert first["facts"]["file"] == "a.safetensors"
    assert first["facts"]["layers"] == "6-8-3"
    assert first["facts"]["sha256"] != second["facts"]["sha256"]
    assert len(first["facts"]["largest albedo"]) == 3


def test_info_plots_what_it_can_read(here, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    files = ["a.safetensors", "cut.safetensors", "b.safetensors"]
    assert run("info", *files, "--no-physics", "--json", "--plot", "x.svg") == 2
    printed = capsys.readouterr()
    assert [item["facts"]["file"] for item in json.loads(printed.out)] == [files[0], files[2]]
    assert "cut.safetensors" in printed.err
    assert (here / "x.svg").exists()


def test_compare_gives_its_figures_as_json(here, capsys):
    pytest.importorskip("skimage", reason="needs the extra 'render'")
    files = ["a.safetensors", "a.safetensors"]
    assert run("compare", *files, "-o", "x.png", "--size", 16, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["truth"], found["other"], found["picture"]) == (*files, "x.png")
    assert set(found["figures"]) == {"environment", "directional", "angles"}
    assert found["figures"]["environment"]["SSIM"] == 1.0
    assert found["figures"]["environment"]["PSNR (dB)"] is None  # infinite
