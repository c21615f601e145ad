"""`nacre latent interpolate`, `map`, `sample` and `project`."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from PIL import Image

import nacre
from nacre.latent.file import load_code, save_basis
from nacre.latent.map import embed, nearest
from nacre.measured import merl
from tests.cli.support import run, run_json
from tests.latent.made import random_basis
from tests.reflectances import Glossy

pytest.importorskip("mitsuba", reason="needs the extra 'render'")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a basis and six materials, tables of few nodes."""
    folder = tmp_path_factory.mktemp("views")
    save_basis(random_basis(), folder / "basis.safetensors")
    for index in range(6):
        brdf = Glossy(0.1 + 0.1 * index, 0.05, 0.2 + 0.1 * index)
        nacre.save(merl.tabulate(brdf, merl.Resolution(30, 15, 15)), folder / f"m{index}.npz")
    return folder


@pytest.fixture
def here(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_what_lies_between_is_rendered_and_kept(here, capsys):
    options = ["--basis", "basis.safetensors", "--count", 3, "--size", 32, "--spp", 1]
    command = ["latent", "interpolate", "m0.npz", "m5.npz", "-o", "x.png", "--codes", "codes"]
    assert run(*command, *options) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "x.png: 3 materials"
    codes = [json.loads((here / f"codes/0{k}.json").read_text())["values"] for k in range(3)]
    np.testing.assert_allclose(codes[1], 0.5 * np.add(codes[0], codes[2]), atol=1e-5)
    # Codes are taken as they are.
    ends = ["codes/00.json", "codes/02.json"]
    assert run("latent", "interpolate", *ends, "-o", "y.png", "--codes", "again", *options) == 0
    for k in range(3):
        again = json.loads((here / f"again/0{k}.json").read_text())["values"]
        np.testing.assert_allclose(again, codes[k], atol=1e-5)


@pytest.mark.slow
def test_a_material_moves_along_named_directions(here, capsys):
    options = ["--basis", "basis.safetensors", "--count", 3, "--size", 16, "--spp", 1]
    along = ["--along", "darker", "--along", "more-saturated"]
    command = ["latent", "interpolate", "m0.npz", *along, *options]
    found = run_json(capsys, *command, "-o", "x.png", "--codes", "codes")["materials"]
    assert [row["along"] for row in found] == ["darker"] * 3 + ["more saturated"] * 3
    assert [row["amount"] for row in found] == [-2.0, 0.0, 2.0] * 2
    with Image.open("x.png") as picture:
        assert picture.size == (48, 32)
    codes = [load_code(path, random_basis()).code for path in sorted(here.glob("codes/*.json"))]
    np.testing.assert_array_equal(codes[1], codes[4])
    np.testing.assert_allclose(codes[3][4:], 0.0, atol=1e-6)  # gray
    assert run(*command, "-o", "x.html") == 0
    assert (here / "x.html").read_text().count("<section>") == 2


def test_between_two_materials_f_is_at_most_their_mixture():
    basis = random_basis()
    random = np.random.default_rng(3)
    a, b = random.normal(size=(2, basis.code_dim))
    wi, wo = random.normal(size=(2, 500, 3))
    wi[:, 2], wo[:, 2] = np.abs(wi[:, 2]), np.abs(wo[:, 2])
    wi /= np.linalg.norm(wi, axis=-1, keepdims=True)
    wo /= np.linalg.norm(wo, axis=-1, keepdims=True)
    ends = [basis.decode(code).eval(wi, wo) for code in (a, b)]
    for t in (0.2, 0.5, 0.9):
        between = basis.decode((1 - t) * a + t * b).eval(wi, wo)
        assert np.isfinite(between).all()
        assert (between >= 0).all()
        assert (between <= (1 - t) * ends[0] + t * ends[1] + 1e-5).all()


@pytest.mark.slow
def test_a_map_shows_all_and_names_the_nearest(here, capsys):
    pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
    files = [f"m{k}.npz" for k in range(6)]
    options = ["--basis", "basis.safetensors", "--highlight", "m0.npz", "-o", "map.png"]
    assert run("latent", "map", *files, *options) == 0
    printed = capsys.readouterr().out
    assert "m0" in printed
    assert printed.splitlines()[-1] == "map.png: 6 materials"
    first = (here / "map.png").read_bytes()
    assert first.startswith(b"\x89PNG")
    assert run("latent", "map", *files, *options) == 0
    assert (here / "map.png").read_bytes() == first


@pytest.mark.slow
def test_plausible_materials_are_written_as_codes_or_in_a_picture(here, capsys):
    options = ["--count", 2, "--seed", 4, "--like", "metal"]
    assert run("latent", "sample", "-o", "drawn", *options) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "drawn: 2 materials"
    assert sorted(path.name for path in (here / "drawn").iterdir()) == ["0.json", "1.json"]
    assert run("latent", "sample", "-o", "x.png", *options, "--size", 16, "--spp", 1) == 0
    with Image.open("x.png") as picture:
        assert picture.size == (32, 16)
    reported = run_json(capsys, "latent", "project", "drawn/0.json", "-o", "same.json")
    assert reported["moved"] == 0.0
    assert reported["after"]["typical"] >= 0.05


def test_neighbors_stay_neighbors():
    pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
    random = np.random.default_rng(0)
    codes = np.concatenate([random.normal(k * 20, 1, (12, 8)) for k in range(2)])
    places = embed(codes)
    middles = places[:12].mean(axis=0), places[12:].mean(axis=0)
    own = np.linalg.norm(places[:12] - middles[0], axis=1)
    other = np.linalg.norm(places[:12] - middles[1], axis=1)
    assert (own < other).all()
    assert nearest([[0.0], [5.0], [1.0], [2.0]], 0, 2) == [2, 3]


def test_codes_that_are_alike_have_places():
    pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
    assert np.isfinite(embed(np.ones((7, 4)))).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["interpolate", "m0.npz", "m1.npz", "-o", "x.json"], "x.json"),
        (["interpolate", "m0.npz", "none.npz", "-o", "x.png"], "none.npz: no such file"),
        (["map", "m0.npz", "m1.npz", "-o", "x.png"], "a map takes at least 5 materials, got 2"),
        (["interpolate", "m0.npz", "-o", "x.png"], "expected SECOND, or a direction with --along"),
        (["interpolate", "m0.npz", "m1.npz", "-o", "x.html"], "expected no SECOND"),
        (["sample", "-o", "x", "--like", "steel"], "no material like 'steel'"),
        (["project", "m0.npz", "-o", "x.png"], "a code is a .json file"),
        (
            ["map", "m0.npz", "-o", "x.png", "--highlight", "m1.npz"],
            "m1.npz: cannot be highlighted, since it is not among",
        ),
    ],
)
def test_wrong_usage_ends_in_one_line(here, capsys, arguments, words):
    pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
    assert run("latent", *arguments, "--basis", "basis.safetensors") == 2
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.splitlines()[-1].startswith("nacre: ")
