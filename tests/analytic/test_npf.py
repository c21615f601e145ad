"""NPF: its tables come back, and it explains measurements better than a formula does."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS, fit
from nacre.measured import ScatteredBrdf
from tests.analytic.materials import EXAMPLES
from tests.data import require_data
from tests.measured.support import hemisphere

NPF = MODELS["npf"]


def test_the_tables_that_made_the_data_are_found():
    truth = EXAMPLES["npf"]
    fitted = fit(truth, NPF, samples=8000)
    assert fitted.metadata["fit"]["loss"] < 1e-5
    wi, wo = (hemisphere(np.random.default_rng(k), 5000) for k in range(2))
    error = np.abs(fitted.eval(wi, wo) / truth.eval(wi, wo) - 1.0)
    assert np.quantile(error, 0.99) < 1e-3
    np.testing.assert_allclose(fitted.values["diffuse"], truth.values["diffuse"], rtol=1e-3)
    found, made = (np.array(brdf.values["distribution"])[:, :60] for brdf in (fitted, truth))
    np.testing.assert_allclose(found / found[:, :1], made / made[:, :1], rtol=1e-2)


def test_factors_are_normalised():
    fitted = fit(EXAMPLES["ggx"], NPF, samples=3000)
    theta = np.linspace(0, 1, 90) ** 2 * np.pi / 2
    solid = 2 * np.pi * np.sin(theta) * np.cos(theta)
    for row in fitted.values["distribution"]:
        assert np.sum(
            np.diff(theta) * (row * solid)[1:] + np.diff(theta) * (row * solid)[:-1]
        ) / 2 == (pytest.approx(1.0, abs=0.01))
    for name in ("fresnel", "masking"):
        assert [max(row) for row in fitted.values[name]] == [1.0, 1.0, 1.0]


def test_the_same_seed_gives_the_same_tables():
    one, two, three = (fit(EXAMPLES["ggx"], NPF, samples=2000, seed=s) for s in (1, 1, 2))
    assert one.values == two.values
    assert one.values != three.values


@pytest.mark.parametrize("value", [0.0, 0.3])
def test_a_scan_of_one_color_can_be_fitted(value):
    random = np.random.default_rng(0)
    wi, wo = hemisphere(random, 800), hemisphere(random, 800)
    fitted = fit(ScatteredBrdf(wi, wo, np.full((800, 3), value)), NPF)
    np.testing.assert_allclose(fitted.eval(wi, wo), value, rtol=0.01, atol=1e-4)


def test_measured_satin_is_closer_than_ggx():
    satin = nacre.load(require_data("rgl", "satin_rosaline_rgb.bsdf"))
    losses = {
        name: fit(satin, MODELS[name], samples=10_000).metadata["fit"]["loss"]
        for name in ("npf", "ggx")
    }
    assert losses["npf"] < 0.8 * losses["ggx"]
