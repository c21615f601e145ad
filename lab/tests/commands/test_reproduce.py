"""`nacre reproduce`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import nacre
from lab.tests.reproduce.support import write_materials
from nacre.latent.file import save_basis
from tests.cli.support import run
from tests.latent.made import material, predictor, random_basis

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
pytest.importorskip("skimage", reason="needs the extra 'render'")


@pytest.fixture
def here(tmp_path, monkeypatch):
    write_materials(tmp_path)
    monkeypatch.chdir(tmp_path)
    save_basis(random_basis(), tmp_path / "plain.safetensors")
    return tmp_path


@pytest.fixture
def coded(here):
    """Six materials, and a basis that says it was trained on two of them."""
    for seed in range(6):
        nacre.save(material(seed), here / f"m{seed}.json")
    names = [nacre.load(here / f"m{seed}.json").name for seed in range(2)]
    basis = replace(random_basis(), metadata={"materials": names})
    save_basis(basis, here / "basis.safetensors")
    return here


def test_reproduce_writes_and_says_what_differs(here, capsys):
    options = ["--quick", "--methods", "lambert,published", "-o", "out"]
    files = "a.safetensors", "b.safetensors"
    assert run("reproduce", "fig10", *files, *options, quiet=False) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[:3] == ["out/fig10.csv", "out/fig10.md", "out/fig10.png"]
    assert "differs from the paper: spheres" in printed.out
    assert "left out: published (a): no published network a.h5" in printed.err
    assert len(list((here / "out" / "cache").glob("*.npz"))) == 4
    kept = {path: path.stat().st_mtime_ns for path in (here / "out" / "cache").iterdir()}
    assert run("reproduce", "table1", "a.safetensors", "b.safetensors", *options) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (here / "out" / "cache").iterdir()}


def test_noise_is_reproduced_for_samplers(here, capsys):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    options = ["--quick", "--methods", "cosine,own", "-o", "out"]
    assert run("reproduce", "fig14", "a.safetensors", *options) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[:3] == ["out/fig14.csv", "out/fig14.md", "out/fig14.png"]
    assert "differs from the paper: nacre's own scenes" in printed[3]
    assert "| cosine |" in (here / "out" / "fig14.md").read_text()
    lines = (here / "out" / "fig14.csv").read_text().splitlines()
    assert lines[0] == "picture,sampler,samples,seconds,MAE,RMSE,MAPE,PSNR"
    assert len(lines) == 1 + 2 * 4
    kept = {path: path.stat().st_mtime_ns for path in (here / "out" / "cache").iterdir()}
    assert len(kept) == 3
    assert run("reproduce", "fig13", "a.safetensors", *options) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in (here / "out" / "cache").iterdir()}


def test_noise_of_predicted_lobes_is_kept_by_basis(here, capsys):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    found = set()
    for count, seed in enumerate((1, 2), 1):
        predictors = {"ggx": predictor("ggx", seed=seed)}
        basis = random_basis().replaced(predictors=predictors, metadata={"materials": ["other"]})
        save_basis(basis, here / "basis.safetensors")
        options = ["--quick", "--methods", "cosine,ggx-predicted", "--basis", "basis.safetensors"]
        assert run("reproduce", "fig14", "a.safetensors", *options, "-o", "out") == 0
        text = (here / "out" / "fig14.md").read_text()
        found.add(next(line for line in text.splitlines() if "| ggx-predicted |" in line))
        assert len(list((here / "out" / "cache").iterdir())) == 2 + count
    assert len(found) == 2


def test_codes_of_held_out_materials_are_reproduced(coded, capsys):
    pytest.importorskip("torch", reason="needs the extra 'latent'")
    files = [f"m{k}.json" for k in range(6)]
    options = ["--quick", "--methods", "neural", "-o", "out"]
    assert run("reproduce", "table2", *files, *options) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[:2] == ["out/table2.csv", "out/table2.md"]
    assert "differs from the paper: the data differ" in printed[2]
    assert "| neural | 128 | held out |" in (coded / "out" / "table2.md").read_text()


def test_a_map_rings_what_its_basis_was_not_trained_on(coded, capsys):
    pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
    files = [f"m{k}.json" for k in range(6)]
    options = ["--basis", "basis.safetensors", "-o", "out"]
    assert run("reproduce", "fig11", *files, *options) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "out/fig11.png: 6 materials, 4 that the basis was not trained on"
    highlights = [option for k in range(2, 6) for option in ("--highlight", f"m{k}.json")]
    assert run("latent", "map", *files, *highlights, *options[:2], "-o", "map.png") == 0
    pictures = [Image.open(coded / name) for name in ("map.png", "out/fig11.png")]
    assert np.array_equal(*map(np.asarray, pictures))


def test_rows_show_what_lies_between_pairs(coded, capsys):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    files = [f"m{k}.json" for k in range(4)]
    options = ["--quick", "--basis", "basis.safetensors", "-o", "out"]
    assert run("reproduce", "fig12", *files, *options) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "out/fig12.png: 4 materials"
    assert "differs from the paper: codes from the given basis" in printed[1]
    assert (coded / "out" / "fig12.png").read_bytes().startswith(b"\x89PNG")


def test_reproduce_lists_methods(here, capsys):
    assert run("reproduce", "--list") == 0
    printed = capsys.readouterr().out
    assert "nbrdf-675-uniform" in printed
    assert "sgd" in printed
    assert "autoencoder-projected" in printed
    assert "unified-SIZE" in printed
    assert all(name in printed for name in ("table2", "fig11", "btf-tsne"))
    assert "blinn-phong, power-iterations, rgl, nacre, cosine, ggx-fitted, own" in printed


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fig4", "a.safetensors"], "'fig4' is no known experiment"),
        (["fig6"], "type: nacre reproduce EXPERIMENT INPUT..."),
        (["btf-table1", "x", "--minutes", "nan"], "--minutes: expected a number"),
        (["fig6", "none.bsdf"], "none.bsdf: no such file"),
        (["fig6", "a.safetensors", "--methods", "ggx,magic"], "'magic' is not a method"),
        (["fig6", "a.safetensors", "--methods", "truth"], "'truth' is not a method"),
        (["fig6", "a.safetensors", "--published", "none"], "none: no such file"),
        (["fig6", "a.safetensors", "--environment", "none.exr"], "none.exr"),
        (["fig9", "a.safetensors"], "a.safetensors: is isotropic"),
        (["fig13", "a.safetensors", "--methods", "cosine,ggx-675"], "'ggx-675' is not a method"),
        (["fig16", "a.safetensors", "--epochs", "3"], "--epochs is not for fig16"),
        (["fig13", "a.safetensors", "--basis", "plain.safetensors"], "predicts no lobes"),
        (["fig13", "a.safetensors", "--basis", "none.safetensors"], "no such file"),
        (["table2", "a.safetensors", "b.safetensors"], "table2 takes at least 5 materials, got 2"),
        (["table2", "a.safetensors", "--methods", "ggx"], "'ggx' is not a method"),
        (["table2", "a.safetensors", "--basis", "plain.safetensors"], "--basis is not for table2"),
        (
            ["fig11", "a.safetensors", "--basis", "plain.safetensors"],
            "does not say which materials",
        ),
        (["fig11", "a.safetensors", "--methods", "neural"], "--methods is not for fig11"),
        (["fig12", "a.safetensors", "--jobs", "2"], "--jobs is not for fig12"),
        (["fig12", "a.safetensors", "--basis", "plain.safetensors"], "pairs of materials, got 1"),
        (["fig12", "a.safetensors", "--basis", "none.safetensors"], "no such file"),
        (["fig15", "none.bsdf"], "none.bsdf: no such file"),
        (["fig6", "a.safetensors", "--quick", "--methods", "published"], "nothing could be tried"),
        (["fig6", "a.safetensors", "-o", "a.safetensors"], "a.safetensors"),
    ],
)
def test_reproduce_refuses_in_one_line(here, capsys, arguments, words):
    assert run("reproduce", *arguments) == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.splitlines()[-1].startswith("nacre: ")
