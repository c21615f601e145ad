"""`nacre reproduce`."""

from __future__ import annotations

from dataclasses import replace

import pytest

from nacre.latent.file import save_basis
from tests.cli.support import run
from tests.latent.made import predictor, random_basis
from tests.reproduce.support import write_materials

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
pytest.importorskip("skimage", reason="needs the extra 'render'")


@pytest.fixture
def here(tmp_path, monkeypatch):
    write_materials(tmp_path)
    monkeypatch.chdir(tmp_path)
    save_basis(random_basis(), tmp_path / "plain.safetensors")
    return tmp_path


def test_reproduce_writes_and_says_what_differs(here, capsys):
    options = ["--quick", "--methods", "lambert,published", "-o", "out"]
    assert run("reproduce", "fig10", "a.safetensors", "b.safetensors", *options) == 0
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
    assert "differs from the paper: scenes of nacre's own" in printed[3]
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
        save_basis(replace(random_basis(), predictors=predictors), here / "basis.safetensors")
        options = ["--quick", "--methods", "cosine,ggx-predicted", "--basis", "basis.safetensors"]
        assert run("reproduce", "fig14", "a.safetensors", *options, "-o", "out") == 0
        text = (here / "out" / "fig14.md").read_text()
        found.add(next(line for line in text.splitlines() if "| ggx-predicted |" in line))
        assert len(list((here / "out" / "cache").iterdir())) == 2 + count
    assert len(found) == 2


def test_every_sampler_can_be_chosen():
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    from nacre.cli.reproduce import _NOISE, _SAMPLERS
    from nacre.reproduce.noise_experiments import NOISE_EXPERIMENTS
    from nacre.reproduce.samplers import FITTED, PREDICTED

    assert sorted((*FITTED, *PREDICTED)) == sorted(_SAMPLERS)
    assert tuple(NOISE_EXPERIMENTS) == _NOISE


def test_reproduce_lists_methods(here, capsys):
    assert run("reproduce", "--list") == 0
    printed = capsys.readouterr().out
    assert "nbrdf-675-uniform" in printed
    assert "sgd" in printed


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fig5", "a.safetensors"], "'fig5' is not one of"),
        (["fig6"], "Missing argument 'FILES...'"),
        (["fig6", "none.bsdf"], "none.bsdf: cannot be read"),
        (["fig6", "a.safetensors", "--methods", "ggx,magic"], "'magic' is no method"),
        (["fig6", "a.safetensors", "--methods", "truth"], "'truth' is no method"),
        (["fig6", "a.safetensors", "--published", "none"], "none: is no folder"),
        (["fig6", "a.safetensors", "--environment", "none.exr"], "none.exr"),
        (["fig9", "a.safetensors"], "a.safetensors: is isotropic"),
        (["fig13", "a.safetensors", "--methods", "cosine,ggx-675"], "'ggx-675' is no method"),
        (["fig16", "a.safetensors", "--epochs", "3"], "--epochs is not for fig16"),
        (["fig13", "a.safetensors", "--methods", "ggx-predicted"], "needs --basis"),
        (["fig13", "a.safetensors", "--basis", "plain.safetensors"], "predicts no lobes"),
        (["fig13", "a.safetensors", "--basis", "none.safetensors"], "cannot be read"),
        (["fig15", "none.bsdf"], "none.bsdf: cannot be read"),
        (["fig6", "a.safetensors", "--quick", "--methods", "published"], "nothing could be tried"),
        (["fig6", "a.safetensors", "-o", "a.safetensors"], "a.safetensors"),
    ],
)
def test_reproduce_refuses_in_one_line(here, capsys, arguments, words):
    assert run("reproduce", *arguments) == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.splitlines()[-1].startswith("nacre: ")
