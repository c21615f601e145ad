"""`nacre view`."""

from __future__ import annotations

import base64
import gzip
import json
import os
import re
import signal
import struct
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.btf import TableBtf
from nacre.neural import Recipe
from nacre.textures.height_file import write_heights
from nacre.textures.latent_file import save_latent_map
from tests.cli.support import assert_refused, run, run_json
from tests.targets import made_texture
from tests.tiers import tiered
from tests.variants import require_mitsuba

GGX = Ggx(name="Gray", diffuse=(0.2, 0.1, 0.05), specular=(0.04, 0.04, 0.04), roughness=0.3)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two materials, one of them in two forms, and things that are none."""
    monkeypatch.chdir(tmp_path)
    recipe = Recipe(samples=20_000, epochs=1, starts=1)
    for name in ("metals", "metals/.hidden"):
        Path(name).mkdir()
    nacre.save(GGX, "metals/gray.json")
    nacre.save(nacre.fit(GGX, recipe), "metals/gray.safetensors")
    nacre.save(GGX, "metals/.hidden/gray.json")
    nacre.save(GGX, "other.json")
    Path("notes.txt").write_text("no material")
    Path("package.json").write_text("{}")
    return tmp_path


def facts(page: Path) -> Any:
    """What a page holds, as its scripts read it."""
    text = re.search(r'id="data">([^<]*)<', page.read_text("utf-8"))
    assert text is not None
    whole = gzip.decompress(base64.b64decode(text[1]))
    (length,) = struct.unpack("<I", whole[:4])
    return json.loads(whole[4 : 4 + length])


def test_folders_are_searched_and_files_of_one_name_are_one_material(
    folder: Path, capsys: Any
) -> None:
    options = "--title", "All", "--notice", "notes.txt"
    said = run_json(capsys, "view", ".", "-o", "page.html", *options)
    assert said["materials"] == 2
    assert said["size_bytes"] == Path("page.html").stat().st_size
    materials = {each["group"]: each for each in facts(Path("page.html"))["materials"]}
    assert [form["label"] for form in materials["metals"]["forms"]] == ["Network", "ggx"]
    assert [form["label"] for form in materials[""]["forms"]] == ["ggx"]
    assert facts(Path("page.html"))["notice"] == "no material"
    assert "<title>All</title>" in Path("page.html").read_text("utf-8")


@pytest.mark.slow
def test_pages_are_the_same_each_time(folder: Path) -> None:
    for name in ("a.html", "b.html"):
        assert run("view", "metals", "-o", name, "--title", "Same") == 0
    assert Path("a.html").read_bytes() == Path("b.html").read_bytes()


def test_what_cannot_be_shown_is_said(folder: Path, capsys: Any) -> None:
    assert_refused(capsys, "nothing.json: no such file", "view", "nothing.json")
    assert_refused(capsys, "ends in .html", "view", "other.json", "-o", "page.txt")
    assert_refused(capsys, "leave out --output", "view", "other.json", "-o", "x.html", "--port", 1)
    assert_refused(capsys, "package.json", "view", "package.json", "-o", "x.html")
    Path("empty").mkdir()
    assert_refused(capsys, "empty: holds no material", "view", "empty", "-o", "x.html")
    cut = Path("metals/gray.safetensors").read_bytes()[:2000]
    Path("cut.safetensors").write_bytes(cut)
    assert_refused(capsys, "cut.safetensors", "view", "cut.safetensors", "-o", "x.html")


def test_damaged_files_in_a_folder_are_passed_over(folder: Path, capsys: Any) -> None:
    cut = Path("metals/gray.safetensors").read_bytes()[:2000]
    Path("metals/cut.safetensors").write_bytes(cut)
    assert run("view", "metals", "-o", "page.html") == 1
    assert "cut.safetensors" in capsys.readouterr().err
    assert len(facts(Path("page.html"))["materials"]) == 1


@pytest.mark.slow
def test_textures_are_shown_and_one_may_have_a_height_field(folder: Path, capsys: Any) -> None:
    require_mitsuba()
    Path("cloths").mkdir()
    texture = made_texture.texture()
    save_latent_map(texture.latent, "cloths/cloth.safetensors")
    write_heights(made_texture.heights().heights, "heights.exr")
    raw = TableBtf(np.zeros((2, 2, 4, 3), np.float32), texture.wi[:4], texture.wo[:4])
    nacre.save(raw, "cloths/raw.npz")
    command = "view", "cloths", "other.json", "-o", "page.html"
    assert run(*command, "--height-field", "heights.exr", "--json", "--depth", 2) == 1
    said = capsys.readouterr()
    assert "is not encoded" in said.err
    assert json.loads(said.out)["materials"] == 2
    (held,) = facts(Path("page.html"))["textures"]
    heights = 2.0 * made_texture.heights().heights
    highest = heights.max() - heights.mean()
    assert held["relief"]["top"] == pytest.approx(highest, rel=1e-3)
    write_heights(made_texture.heights().heights, "cloths/cloth.exr")
    Path("cloths/raw.npz").rename("raw.npz")
    assert run("view", "cloths", "-o", "beside.html") == 0
    (held,) = facts(Path("beside.html"))["textures"]
    assert held["relief"]["top"] == pytest.approx(0.5 * highest, rel=1e-3)
    assert_refused(capsys, "is not encoded", "view", "raw.npz", "-o", "x.html")
    assert_refused(capsys, "not for 0", "view", "other.json", "--height-field", "heights.exr")


def test_files_of_others_are_kept(folder: Path, capsys: Any) -> None:
    Path("page.html").write_text("mine")
    assert_refused(capsys, "page.html", "view", "other.json", "-o", "page.html")
    assert Path("page.html").read_text() == "mine"


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize(
    ("stop", "code"),
    tiered([(signal.SIGINT, 0), (signal.SIGTERM, 143)], [(signal.SIGINT, 0)]),
)
def test_a_page_is_served_until_it_is_stopped(
    folder: Path, stop: signal.Signals, code: int
) -> None:
    command = [sys.executable, "-m", "nacre", "-q", "view", "other.json", "--no-open", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:
        try:
            assert served.stdout is not None
            lines: list[str] = []
            while not (lines and lines[-1].startswith("}")):
                lines.append(served.stdout.readline())
            url = json.loads("".join(lines))["url"]
            with urllib.request.urlopen(url, timeout=10) as answer:
                assert b"<!doctype html>" in answer.read(100)
            served.send_signal(stop)
            assert served.wait(10) == code
        finally:
            served.kill()
