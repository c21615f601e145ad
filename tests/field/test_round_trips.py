"""Real files through the commands, and the fit back into a format of the same tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from tests.cli.support import run
from tests.data import require_data
from tests.measured.support import hemisphere

pytestmark = pytest.mark.slow

FILES = {
    "zemax/AnoBlackEC1onAlum.bsdf": "zemax.bsdf",
    "zemax/IMX455.bsdf": "zemax.bsdf",
    "speos/test_13_brdf_one_wavelength_speos.brdf": "brdf",
    "speos/aniso_bsdf.anisotropicbsdf": "anisotropicbsdf",
    "speos/R_test.anisotropicbsdf": "anisotropicbsdf",
    "fred/AnoBlackEC1onAlum.txt": "fred.txt",
    "goniometer/20250409_S7_swir_sample.txt": "csv",
    "goniometer/test_brdf_viewer_2D_data.csv": "csv",
    "klems/2011-SA1.XML": "xml",
    "openmaterial/example_material.xomp": "xompt",
    "materialx/standard_surface_greysphere.mtlx": "mtlx",
}


@pytest.mark.parametrize("name", FILES)
def test_a_fit_is_compared_shown_and_written_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    source = require_data("field", name)
    monkeypatch.chdir(tmp_path)
    back = f"back.{FILES[name]}"
    assert run("fit", source, "--epochs", 12, "-o", "fit.safetensors") == 0
    assert run("compare", source, "fit.safetensors", "--size", 16, "-o", "compare.png") == 0
    assert run("render", "fit.safetensors", "--size", 16, "-o", "fit.png") == 0
    assert run("view", source, "fit.safetensors", "-o", "view.html") == 0
    assert run("convert", "fit.safetensors", "-o", back) == 0
    network, again = nacre.load("fit.safetensors"), nacre.load(back)
    assert network.isotropic == nacre.load(source).isotropic
    assert again.isotropic == network.isotropic
    views = hemisphere(np.random.default_rng(0), 200)
    wi, wo = views[views[:, 2] > 0.4][:80].reshape(2, 40, 3)
    ours, theirs = (each.eval(wi, wo)[:, 1] + 1e-4 for each in (network, again))
    assert np.median(np.abs(theirs / ours - 1.0)) < 0.1


def test_a_single_pair_is_fitted_and_written_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """BiRD's example has one pair of directions: too little to compare pictures of."""
    source = require_data("field", "bird/example.brdf")
    monkeypatch.chdir(tmp_path)
    assert run("fit", source, "-o", "fit.safetensors") == 0
    assert run("compare", source, "fit.safetensors", "--size", 16) == 2
    assert "SRT1: is known at none of 100000 directions" in capsys.readouterr().err
    assert run("render", "fit.safetensors", "--size", 16, "-o", "fit.png") == 0
    assert run("view", source, "fit.safetensors", "-o", "view.html") == 0
    assert run("convert", "fit.safetensors", "-o", "back.bird.brdf") == 0
    samples = nacre.load(source).samples
    network, again = nacre.load("fit.safetensors"), nacre.load("back.bird.brdf")
    expected = samples.rgb[:, 1]
    np.testing.assert_allclose(network.eval(samples.wi, samples.wo)[:, 1], expected, rtol=0.3)
    np.testing.assert_allclose(again.eval(samples.wi, samples.wo)[:, 1], expected, rtol=0.4)
