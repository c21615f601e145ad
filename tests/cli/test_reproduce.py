"""`nacre reproduce`."""

from __future__ import annotations

import pytest

from tests.cli.support import run
from tests.reproduce.support import write_materials

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
pytest.importorskip("skimage", reason="needs the extra 'render'")


@pytest.fixture
def here(tmp_path, monkeypatch):
    write_materials(tmp_path)
    monkeypatch.chdir(tmp_path)
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
        (["fig6", "a.safetensors", "--quick", "--methods", "published"], "nothing could be tried"),
        (["fig6", "a.safetensors", "-o", "a.safetensors"], "a.safetensors"),
    ],
)
def test_reproduce_refuses_in_one_line(here, capsys, arguments, words):
    assert run("reproduce", *arguments) == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.splitlines()[-1].startswith("nacre: ")
