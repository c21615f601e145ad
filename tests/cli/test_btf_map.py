"""`nacre btf map` and `nacre btf nearest`."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import textures
from nacre.btf import TableBtf
from nacre.io.image_file import read_header
from nacre.measured.textures import BONN
from nacre.textures import LatentMap
from nacre.textures.codecs import save_codec
from tests.cli.support import assert_refused, run, run_json
from tests.textures.codecs.basis.made import codec

pytest.importorskip("openTSNE", reason="needs the extra 'latent'")
pytest.importorskip("matplotlib", reason="needs the extra 'plot'")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three textures of one model, one of another, a model and a texture."""
    monkeypatch.chdir(tmp_path)
    wi, wo = (w[:2] for w in BONN.pairs())
    random = np.random.default_rng(1)
    for name, seed in {"felt01": 0, "felt02": 0, "wood01": 0, "other": 7}.items():
        codes = random.normal(size=(3, 4, 2)).astype(np.float32)
        textures.save_latent_map(LatentMap(codes, codec(seed), wi, wo, name), f"{name}.safetensors")
    save_codec(codec(), "model.safetensors")
    values = np.full((1, 1, 2, 3), 0.5, np.float32)
    nacre.save(TableBtf(values, wi, wo), "texture.npz")
    return tmp_path


def _rows(path: str) -> list[dict[str, str]]:
    return list(csv.DictReader(Path(path).read_text().splitlines()))


def test_a_map_is_drawn_saved_and_added_to(here, capsys) -> None:
    arguments = "felt01.safetensors felt02.safetensors -o map.png --table map.csv"
    options = "--save map.safetensors --count 8"
    assert run("btf", "map", *arguments.split(), *options.split()) == 0
    assert "map.png: 16 texels of 2 textures" in capsys.readouterr().out
    assert read_header("map.png").width > 1000
    first = Path("map.png").read_bytes(), _rows("map.csv")
    assert [row["texture"] for row in first[1]] == ["felt01"] * 8 + ["felt02"] * 8
    assert {row["family"] for row in first[1]} == {"felt"}
    assert run("btf", "map", *arguments.split(), *options.split(), "--force") == 0
    assert Path("map.png").read_bytes() == first[0]
    (found,) = run_json(capsys, "info", "map.safetensors")
    assert (found["kind"], found["texels"]) == ("map", 16)
    more = "wood01.safetensors --into map.safetensors -o more.png --table more.csv --colors"
    assert run("btf", "map", *more.split(), "--count", 3) == 0
    rows = _rows("more.csv")
    assert rows[:16] == first[1]
    assert [row["texture"] for row in rows[16:]] == ["wood01"] * 3


def test_the_nearest_texels_are_told_and_shown(here, capsys) -> None:
    near = "felt01.safetensors felt01.safetensors felt02.safetensors wood01.safetensors --texel 2,1"
    assert run("btf", "nearest", *near.split(), "--json", "--count", 4) == 0
    found = json.loads(capsys.readouterr().out)["nearest"]
    assert len(found) == 4
    assert [n["distance"] for n in found] == sorted(n["distance"] for n in found)
    assert all((n["file"], n["x"], n["y"]) != ("felt01.safetensors", 2, 1) for n in found)
    assert (
        run("btf", "nearest", "felt01.safetensors", "--texel", "0,0", "--json", "--count", 99) == 0
    )
    found = json.loads(capsys.readouterr().out)["nearest"]
    assert len({(n["x"], n["y"]) for n in found} | {(0, 0)}) == 12
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    assert run("btf", "nearest", *near.split(), "--one-each", "-o", "near.png") == 0
    assert "near.png: 4 spheres" in capsys.readouterr().out
    assert read_header("near.png").width > 300


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("map texture.npz -o x.png", "is a texture, expected an encoded texture"),
        ("map model.safetensors -o x.png", "is a texture codec, expected an encoded texture"),
        ("map felt01.safetensors other.safetensors -o x.png", "encoded by another model than felt"),
        ("map felt01.safetensors felt01.safetensors -o x.png", "felt01: appears twice"),
        ("map felt01.safetensors -o x.png --count 4", "at least 5 texels, got 4"),
        ("map felt01.safetensors -o x.jpg", "a plot ends in one of"),
        ("map felt01.safetensors -o x.png --save x.json", "is saved as a .safetensors file"),
        ("map felt01.safetensors -o x.png --into felt02.safetensors", "not a map of texels"),
        ("map felt01.safetensors -o x.png --into absent.safetensors", "no such file"),
        ("nearest felt01.safetensors --texel 4,0", "has 4 x 3 texels, none in column 4, row 0"),
        (
            "nearest felt01.safetensors other.safetensors --texel 0,0",
            "encoded by another model than felt",
        ),
        ("nearest felt01.safetensors texture.npz --texel 0,0", "is a texture, expected an encoded"),
        ("nearest felt01.safetensors --texel 0,0 -o felt01.safetensors", "a plot ends in one of"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(here, capsys, arguments, words) -> None:
    assert_refused(capsys, words, "btf", *arguments.split())
