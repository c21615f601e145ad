"""Spectral networks from the command line: fitted, shown, compared, exported."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from tests.spectra import BANDS, Coated, scanned, spectral_network

QUICK = ["--epochs", "1", "--samples", "4000"]


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scan") / "coated.csv"
    nacre.save(scanned(Coated(), 120), path)
    return path


def test_a_scan_becomes_a_spectral_network(
    scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "coated.safetensors"
    main(["fit", str(scan), "--model", "spectral", *QUICK, "--hidden", "8,8", "-o", str(output)])
    assert "held-out samples" in capsys.readouterr().out
    found = nacre.load(output)
    np.testing.assert_allclose(found.wavelengths, BANDS)
    assert found == nacre.fit(
        nacre.load(scan), model="spectral", epochs=1, samples=4000, hidden=(8, 8)
    ).replaced(name=found.name, source=found.source)
    main(["info", str(output), "--json"])
    (facts,) = json.loads(capsys.readouterr().out)
    assert facts["bands"] == len(BANDS)


def test_spectra_are_compared_under_lamps(
    scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "random.safetensors"
    nacre.save(spectral_network(), path)
    output = str(tmp_path / "a.png")
    main(["compare", str(scan), str(path), "--size", "16", "-o", output, "--json"])
    colors = json.loads(capsys.readouterr().out)["figures"]["colors"]
    assert set(colors) == {"ciede2000_d65", "ciede2000_a", "ciede2000_f11"}
    assert min(colors.values()) > 1.0


def test_exports_hold_the_color_or_bands(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    nacre.save(spectral_network(), path)
    for name, more in (("color.glsl", []), ("band.glsl", ["--bands", "520"])):
        main(["export", str(path), "--to", "glsl", "-o", str(tmp_path / name), *more])
    color, band = ((tmp_path / name).read_text() for name in ("color.glsl", "band.glsl"))
    assert color != band


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--physical"], "--physical is not for spectral networks"),
        (["--max-bytes", "4000"], "--max-bytes is not for spectral networks"),
        (["--inputs", "paper"], "enhanced inputs"),
        (["-o", "a.h5"], "holds RGB networks only"),
    ],
)
def test_options_for_rgb_are_refused(
    scan: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    more: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["fit", str(scan), "--model", "spectral", *QUICK, *more])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert words in error
    assert not list(tmp_path.iterdir())


def test_a_material_in_rgb_has_no_spectrum_to_fit(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fit", "rgl:paper_white", "--model", "spectral", "-o", "none.safetensors"])
    assert "known in RGB only" in capsys.readouterr().err
