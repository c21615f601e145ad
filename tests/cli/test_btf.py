"""`nacre btf info`, `convert` and `picture`, and other commands given a texture."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.btf import TableBtf
from nacre.color import tone_map
from nacre.measured.textures import UTIA
from nacre.measured.textures.directions import from_degrees
from tests.cli.support import run, run_json
from tests.specimens.images import png_bytes

mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")


@pytest.fixture
def cloth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> TableBtf:
    """A texture in `cloth.npz` whose every picture is of one color."""
    monkeypatch.chdir(tmp_path)
    wi, wo = UTIA.pairs()
    grey = np.stack([wi[:, 2], wo[:, 2], 0.0 * wi[:, 0] + 0.25], axis=1)
    values = np.broadcast_to(grey, (2, 3, len(wi), 3)).astype(np.float16)
    made = TableBtf(values, wi, wo, "cloth")
    nacre.save(made, "cloth.npz")
    return made


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "felt"
    path.mkdir()
    for theta in (0, 60):
        image = np.full((4, 5, 3), 128 + theta, np.uint8)
        name = f"tl{theta:03}_pl000_tv000_pv000.png"
        (path / name).write_bytes(png_bytes(image, 5, 4))
    return path


def test_info_shows_what_is_there(capsys, cloth: TableBtf) -> None:
    assert run("info", "-v", "cloth.npz") == 0
    shown = capsys.readouterr().out
    for words in ("cloth.npz", "6,561", "75  [degrees]", "236,196  [bytes]", "float16"):
        assert words in shown
    (facts,) = run_json(capsys, "info", "cloth.npz")
    assert (facts["file"], facts["kind"]) == ("cloth.npz", "btf")
    assert facts["light_polar_angle_max_deg"] == pytest.approx(75.0, abs=0.01)
    assert (facts["width"], facts["height"], facts["lights"], facts["views"]) == (3, 2, 81, 81)
    assert facts["size_bytes"] == Path("cloth.npz").stat().st_size
    np.testing.assert_allclose(facts["value_range"], [0.25, 1.0], atol=0.01)
    expected = cloth.values.astype(float).mean(axis=(0, 1, 2))
    np.testing.assert_allclose(facts["mean_value"], expected, rtol=1e-3)


def test_info_tells_of_pairs_that_repeat(capsys, cloth: TableBtf) -> None:
    assert run("info", "cloth.npz") == 0
    assert "repeat" not in capsys.readouterr().out
    wi, wo = cloth.wi.copy(), cloth.wo.copy()
    wi[5:7], wo[5:7] = wi[4], wo[4]
    nacre.save(TableBtf(cloth.values, wi, wo), "again.npz")
    assert run("info", "again.npz") == 0
    assert "2 pairs of directions repeat others" in capsys.readouterr().out
    (facts,) = run_json(capsys, "info", "again.npz")
    assert facts["pairs_that_repeat_others"] == 2


def test_a_folder_becomes_an_archive(capsys, folder: Path) -> None:
    assert run("info", "-v", folder) == 0
    assert "sRGB, 8 bits, RGB" in capsys.readouterr().out
    assert run("convert", folder, "-o", "felt.npz", "--pixels", "radiance") == 0
    assert "felt.npz: 5 x 4 texels, 2 pairs" in capsys.readouterr().out
    expected = nacre.load(folder, quantity="radiance").texels(slice(None))
    np.testing.assert_allclose(nacre.load("felt.npz").texels(slice(None)), expected, rtol=5e-4)
    assert run("convert", "felt.npz", "-o", "x.npz", "--precision", "single") == 0
    assert nacre.load("x.npz").describe()["values"] == "float32"


def test_a_command_that_is_terminated_leaves_nothing(
    capsys, cloth: TableBtf, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "fsync", lambda _: os.kill(os.getpid(), signal.SIGTERM))
    assert run("convert", "cloth.npz", "-o", "x.npz") == 143
    assert capsys.readouterr().err.strip() == "nacre: terminated"
    assert [path.name for path in Path().iterdir()] == ["cloth.npz"]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_negative_values_that_a_factored_file_loses_are_told(capsys, cloth: TableBtf) -> None:
    values = cloth.values.astype(np.float32)
    values[0] -= 2.0
    nacre.save(TableBtf(values, cloth.wi, cloth.wo), "low.npz")
    assert run("convert", "low.npz", "-o", "x.btf") == 0
    shown = capsys.readouterr().out
    assert "x.btf: 50 % of the values were negative and became 0" in shown
    back = nacre.load("x.btf").texels(slice(None)).reshape(values.shape)
    error = 100.0 * np.abs(back - values).mean() / np.abs(values).mean()
    assert 50.0 < error < 100.0
    assert f"mean absolute error {error:.3g} % of the mean absolute value" in shown


def test_the_error_of_a_factored_file_is_told(capsys, cloth: TableBtf) -> None:
    assert run("convert", "cloth.npz", "-o", "x.btf", "--components", "1") == 0
    shown = capsys.readouterr().out
    assert "x.btf: 3 x 2 texels, 6,561 pairs of directions, " in shown
    back, values = nacre.load("x.btf").texels(slice(None)), cloth.texels(slice(None))
    error = 100.0 * np.abs(back - values).mean() / values.mean()
    assert error > 1e-3
    assert f"mean absolute error {error:.3g} % of the mean absolute value" in shown
    assert "negative" not in shown
    assert run("convert", "x.btf", "-o", "y.npz") == 0
    assert "error" not in capsys.readouterr().out


def test_a_picture_of_the_nearest_pair(capsys, cloth: TableBtf) -> None:
    options = ("--wi", "58,3", "--wo", "30,-91")
    assert run("btf", "picture", "cloth.npz", "-o", "x.exr", *options) == 0
    shown = capsys.readouterr().out
    assert "60.0" in shown
    assert "-90.0" in shown
    picture = np.array(mi.Bitmap("x.exr"))
    assert picture.shape == (2, 3, 3)
    expected = [np.cos(np.radians(60)), np.cos(np.radians(30)), 0.25]
    np.testing.assert_allclose(picture[1, 2], expected, atol=1e-3)


def test_a_sheet_of_some_pairs(cloth: TableBtf) -> None:
    lit = [np.cos(np.radians(30)), 1.0, 0.25]
    seen = [1.0, np.cos(np.radians(60)), 0.25]
    assert run("btf", "picture", "cloth.npz", "-o", "x.exr") == 0
    sheet = np.array(mi.Bitmap("x.exr"))
    assert sheet.shape == (3 * 2, 4 * 3, 3)
    np.testing.assert_allclose(sheet[1, 4], lit, atol=1e-3)
    np.testing.assert_allclose(sheet[5, 1], seen, atol=1e-3)
    assert run("btf", "picture", "cloth.npz", "-o", "x.png") == 0
    sheet = np.array(mi.Bitmap("x.png")) / 255.0
    for color in (lit, seen):
        there = np.abs(sheet - tone_map(np.array(color))).max(axis=-1) < 0.01
        rows, columns = np.nonzero(there)
        assert there.sum() > 10_000
        assert there[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1].mean() > 0.2


def test_a_sheet_shows_each_pair_once(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    wi = from_degrees([0.0, 30.0, 60.0], [0.0, 0.0, 90.0]).astype(np.float32)
    values = np.broadcast_to(np.array([0.1, 0.2, 0.3], "f4")[:, None], (2, 2, 3, 3))
    nacre.save(TableBtf(values, wi, np.roll(wi, 1, 0)), "three.npz")
    assert run("btf", "picture", "three.npz", "-o", "x.exr") == 0
    lines = capsys.readouterr().out.splitlines()
    shown = [line.split()[0] for line in lines[1:-1]]
    assert sorted(shown) == sorted(set(shown))
    sheet = np.array(mi.Bitmap("x.exr"))
    assert sheet.shape == (2, 2 * len(shown), 3)
    for place, pair in enumerate(shown):
        panel = sheet[:, 2 * place : 2 * place + 2]
        np.testing.assert_allclose(panel, 0.1 * (int(pair) + 1), atol=1e-3)


def test_a_sheet_of_large_pictures_is_reduced(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    wi = from_degrees([0.0, 60.0], [0.0, 0.0]).astype(np.float32)
    values = np.zeros((9, 602, 2, 3), np.float32)
    values[:, ::3] = 0.9
    nacre.save(TableBtf(values, wi, wi[[0, 0]]), "wide.npz")
    assert run("btf", "picture", "wide.npz", "-o", "x.exr", "--wo", "0,0") == 0
    sheet = np.array(mi.Bitmap("x.exr")).reshape(3, 2, 201, 3)
    np.testing.assert_allclose(sheet[:, :, :-1], 0.3, rtol=1e-5)
    np.testing.assert_allclose(sheet[:, :, -1], 0.45, rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("info", "absent.npz"), "absent.npz: no such file"),
        (("info", "."), "neither images named"),
        (("info", "cloth.npz", "--pixels", "radiance"), "defines its values itself"),
        (("convert", "cloth.npz", "-o", "x.csv"), "files hold one material, not a texture"),
        (("convert", "cloth.npz", "-o", "x.npz", "--components", "9"), "components: is not"),
        (("convert", "cloth.npz", "-o", "cloth.npz"), "is the input as well"),
        (("convert", "cloth.npz", "-o", "absent/x.npz"), "does not exist"),
        (("btf", "picture", "cloth.npz", "-o", "x.gif"), "a picture ends in one of"),
        (("btf", "picture", "cloth.npz", "-o", "x.png", "--wi", "90,0"), "below 90"),
        (("btf", "picture", "cloth.npz", "-o", "x.png", "--wo", "x"), "expected a polar"),
        (("convert", "cloth.npz", "-o", "x.binary"), "x.binary"),
        (("latent", "encode", "cloth.npz", "-o", "x.json"), "not one material"),
        (("btf", "tile", "cloth.npz", "-o", "x.npz"), "not one material"),
    ],
)
def test_mistakes_end_in_one_line(
    capsys, cloth: TableBtf, arguments: tuple[str, ...], words: str
) -> None:
    before = sorted(Path().iterdir())
    assert run(*arguments) in (1, 2)
    shown = capsys.readouterr().err.strip()
    assert words in shown
    assert "\n" not in shown
    assert sorted(Path().iterdir()) == before
