"""`nacre plot`, and what `nacre info` and `nacre compare` give to other programs."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.measured.textures import UTIA
from nacre.metrics import albedo
from nacre.neural import Layer, NeuralBrdf
from tests.cli.support import assert_refused, run, run_json
from tests.spectra import spectral_network


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


def test_plots_are_named_after_their_input(here):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    assert run("plot", "a.safetensors") == 0
    assert (here / "a_lobes.png").stat().st_size > 1000


def test_spectra_are_plotted_over_wavelength(here, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    nacre.save(spectral_network(), here / "s.safetensors")
    assert run("plot", "s.safetensors", "--spectrum") == 0
    assert (here / "s_spectrum.png").stat().st_size > 1000
    assert run("plot", "s.safetensors", "s.safetensors", "--spectrum", "--incidence", 45) == 0
    assert (here / "spectrum.png").stat().st_size > 1000
    capsys.readouterr()
    for more, words in (
        (["a.safetensors"], "a.safetensors: is known in RGB only, and has no spectrum"),
        (["--cosine"], "--cosine is for lobes; leave it or --spectrum out"),
        (["--channel", "red"], "--channel is for lobes"),
    ):
        assert_refused(capsys, words, "plot", "s.safetensors", "--spectrum", *more)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plot"], "type: nacre plot INPUT..."),
        (["plot", "a.safetensors", "-o", "x.jpg"], "x.jpg: a plot ends in one of .png"),
        (["plot", "a.safetensors", "-o", "x"], "x: a plot ends in one of .png"),
        (["plot", "a.safetensors", "-o", "absent/x.png"], "does not exist; create it"),
        (["plot", "a.safetensors", "--incidence", "90"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--incidence", "a"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--incidence", "nan"], "from 0 to below 90"),
        (["plot", "a.safetensors", "--floor", "0"], "--floor: expected 1e-12 to 1e+12, got 0"),
        (
            ["plot", "a.safetensors", "--azimuth", "nan"],
            "expected a number (-360 to 360), got 'nan'",
        ),
        (
            ["plot", "a.safetensors", "--floor", "nan"],
            "expected a number (1e-12 to 1e+12), got 'nan'",
        ),
        (["plot", "a.safetensors", "--channel", "hue"], "'hue' is not one of"),
        (["plot", *["a.safetensors"] * 8], "1 to 7 materials"),
        (["plot", "a.safetensors", "cut.safetensors"], "cut.safetensors"),
        (["plot", "none.safetensors"], "none.safetensors: no such file"),
        (["info", "a.safetensors", "--plot", "x.jpg"], "x.jpg: a plot ends in one of .png"),
        (["info", "a.safetensors", "--plot", "absent/x.png"], "does not exist; create it"),
        (["info", *["a.safetensors"] * 8, "--plot", "x.png"], "1 to 7 materials"),
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
    assert run("info", "-v", "a.safetensors") == 0
    printed = capsys.readouterr().out
    expected = albedo(nacre.load("a.safetensors"), 0.0).value
    (line,) = [line for line in printed.splitlines() if "albedo at 0 degrees" in line]
    assert ", ".join(f"{v:.4g}" for v in expected) in line
    assert "[red, green, blue: part of the light that is reflected]" in line
    for words in ("reciprocity error", "energy", "unknown pairs", "largest albedo at"):
        assert words in printed
    assert run("info", "-v", "a.safetensors", "--no-physics") == 0
    assert "albedo" not in capsys.readouterr().out


def test_info_gives_the_same_facts_as_json(here, capsys):
    assert run("info", "-v", "a.safetensors", "b.safetensors") == 0
    lines = capsys.readouterr().out.splitlines()
    first, second = run_json(capsys, "info", "a.safetensors", "b.safetensors")
    assert [first["file"], second["file"]] == ["a.safetensors", "b.safetensors"]
    about = {"file", "kind", "summary", "looks_wrong"}  # these are not facts
    titles = [index for index, line in enumerate(lines) if line == "  figures"]
    assert [lines[index - 3 : index] for index in titles] == [
        [f"  {sentence}" for sentence in each["summary"]] for each in (first, second)
    ]
    printed = [line for line in lines if line.startswith("  ")]
    assert len(printed) == sum(len(each) - len(about) + 4 for each in (first, second))
    assert all(re.fullmatch("[a-z0-9_]+", key) for key in first)
    assert first["layers"] == "6-8-3"
    assert first["memory_bytes"] == 332
    assert first["size_bytes"] == Path("a.safetensors").stat().st_size
    assert first["sha256"] != second["sha256"]
    assert len(first["largest_albedo"]) == 3
    assert all(0.0 <= angle < 90.0 for angle in first["largest_albedo_at_deg"])


def test_info_shows_what_it_can_read(here, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    files = ["a.safetensors", "cut.safetensors", "b.safetensors"]
    assert run("info", *files, "--no-physics", "--json", "--plot", "x.svg") == 1
    printed = capsys.readouterr()
    first, failed, second = json.loads(printed.out)
    assert (first["file"], second["file"]) == (files[0], files[2])
    assert (failed.keys(), failed["file"]) == ({"file", "error"}, "cut.safetensors")
    assert printed.err == f"nacre: {failed['error']}\n"
    assert (here / "x.svg").exists()
    assert run("info", "cut.safetensors", "--json") == 2
    assert [item["file"] for item in json.loads(capsys.readouterr().out)] == ["cut.safetensors"]


def test_compare_gives_its_figures_as_json(here, capsys):
    pytest.importorskip("skimage", reason="needs the extra 'render'")
    files = ["a.safetensors", "a.safetensors"]
    found = run_json(capsys, "compare", *files, "-o", "x.png", "--size", 16)
    assert (found["reference"], found["other"], found["output"]) == (*files, "x.png")
    assert set(found["figures"]) == {"environment", "directional", "angles"}
    assert found["figures"]["environment"]["ssim"] == 1.0
    assert found["figures"]["environment"]["psnr_db"] is None  # infinite


def test_a_texture_is_plotted_by_its_mean_or_a_texel(here, capsys):
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    wi, wo = UTIA.pairs()
    values = np.full((2, 3, len(wi), 3), 0.5, np.float32)
    nacre.save(TableBtf(values, wi, wo, "cloth"), "cloth.npz")
    found = run_json(capsys, "plot", "a.safetensors", "cloth.npz", "-o", "x.svg")
    assert found["materials"] == ["a.safetensors", "cloth.npz"]
    assert run("plot", "cloth.npz", "-o", "x.svg", "--texel", "2,1") == 0
    for texel, words in (("3,0", "has 3 x 2 texels, none in column 3"), ("1", "like 12,7")):
        assert_refused(capsys, words, "plot", "cloth.npz", "--texel", texel)
    assert_refused(capsys, "--texel is for textures", "plot", "a.safetensors", "--texel", "0,0")
