"""Any reflectance as scattered samples: what a file of them gives back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.geometry import split
from nacre.measured import ScatteredBrdf, scattered
from tests.measured.support import hemisphere, relative_error
from tests.reflectances import Glossy


class Iridescent(Glossy):
    """A spectrum that changes with the half vector."""

    name = "rainbow"
    wavelengths = np.array([400.0, 500.0, 600.0, 700.0])

    def eval_bands(self, wi, wo):
        f = self.eval_components(split(wi), split(wo))[0][:, None]
        return f * (1.0 + 0.5 * np.cos(self.wavelengths / 100.0 + wi[:, 2:] + wo[:, 2:]))


class Unknown(Brdf):
    """Nothing was measured."""

    def eval_components(self, wi, wo):
        f = 0.0 * wi[2] * wo[2]
        return f, f, f

    def valid_components(self, wi, wo):
        return wi[2] + wo[2] < 0.0


@pytest.mark.parametrize(
    ("brdf", "middle", "tail"),
    [
        (Glossy(0.5, 0.0, 1.0), 1e-4, 1e-4),
        (Glossy(0.3, 0.05, 0.3), 2e-3, 2e-2),
        (Glossy(0.3, 0.05, 0.03), 1e-3, 3e-2),
        (Glossy(0.3, 0.05, 0.15, 0.5), 1e-2, 8e-2),
    ],
    ids=["diffuse", "glossy", "sharp", "anisotropic"],
)
def test_what_is_written_comes_back(tmp_path: Path, brdf: Brdf, middle: float, tail: float) -> None:
    path = tmp_path / "samples.csv"
    nacre.save(brdf, path)
    back = nacre.load(path)
    assert isinstance(back, ScatteredBrdf)
    assert back.isotropic == brdf.isotropic
    facts = back.describe()
    assert facts["averaged as duplicates"] == facts["dropped below the horizon"] == 0
    rng = np.random.default_rng(0)
    wi, wo = (hemisphere(rng, 10_000).astype(np.float64) for _ in "io")
    cosine = wi[:, 2:]
    error = relative_error(back.eval(wi, wo) * cosine, brdf.eval(wi, wo) * cosine)
    assert np.median(error) < middle
    assert np.quantile(error, 0.95) < tail
    at = back.samples
    np.testing.assert_allclose(at.rgb, brdf.eval(at.wi, at.wo), rtol=1e-5)


def test_spectra_are_sampled_too(tmp_path: Path) -> None:
    source = Iridescent(0.3, 0.05, 0.3)
    nacre.save(source, tmp_path / "samples.csv")
    back = nacre.load(tmp_path / "samples.csv")
    np.testing.assert_array_equal(back.wavelengths, source.wavelengths)
    rng = np.random.default_rng(0)
    wi, wo = (hemisphere(rng, 5000).astype(np.float64) for _ in "io")
    error = relative_error(back.eval_spectral(wi, wo), source.eval_spectral(wi, wo))
    assert np.median(error) < 2e-3
    assert np.quantile(error, 0.95) < 2e-2
    nacre.save(back, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "samples.csv").read_bytes()


@pytest.mark.parametrize("isotropic", [True, False])
def test_directions_differ_and_are_above_the_horizon(isotropic: bool) -> None:
    wi, wo = scattered.directions(isotropic)
    assert min(wi[:, 2].min(), wo[:, 2].min()) > 0.0
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1.0)
    rows = np.round(np.concatenate([wi, wo], axis=1), 6)
    assert len(np.unique(rows, axis=0)) == len(rows)
    steep = np.minimum(wi[:, 2], wo[:, 2])
    assert steep.min() < 0.05


def test_what_is_known_nowhere_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="at least one sample"):
        nacre.save(Unknown(), tmp_path / "a.csv")
    assert not list(tmp_path.iterdir())
