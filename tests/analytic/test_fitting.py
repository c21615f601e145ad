"""The fitter finds the parameters that made the data, through noise and from scans."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic import MODELS, Ggx, fit
from nacre.errors import NacreError
from nacre.measured import ScatteredBrdf
from nacre.sampling import draw_samples
from tests.analytic.materials import EXAMPLES
from tests.measured.support import hemisphere
from tests.tiers import tiered

SEARCHED = [n for n in EXAMPLES if not MODELS[n].tables and MODELS[n].fitted_on == "samples"]


@pytest.mark.parametrize("name", tiered(SEARCHED, {"ggx", "ward", "lafortune"} & {*SEARCHED}))
def test_known_parameters_are_found(name):
    truth = EXAMPLES[name]
    fitted = fit(truth, MODELS[name], samples=10_000)
    assert fitted.metadata["fit"]["loss"] < 1e-4
    wi, wo = (hemisphere(np.random.default_rng(k), 5000) for k in range(2))
    expected = truth.eval(wi, wo)
    np.testing.assert_allclose(fitted.eval(wi, wo), expected, rtol=0.02, atol=1e-3)


@pytest.mark.parametrize("gain", [1.0, 16.0])
def test_outliers_do_not_pull(gain):
    truth = EXAMPLES["ggx"]
    samples = draw_samples(truth, 3000, 0)
    noisy = samples.rgb.copy()
    noisy[::20] *= 30.0
    scan = ScatteredBrdf(samples.wi, samples.wo, noisy)
    fitted = fit(scan, Ggx, gain=gain)
    for name, value in truth.values.items():
        np.testing.assert_allclose(fitted.values[name], value, rtol=0.02)


def test_the_same_seed_gives_the_same_parameters():
    one, two, three = (fit(EXAMPLES["ggx"], Ggx, samples=2000, starts=4, seed=s) for s in (1, 1, 2))
    assert one.values == two.values
    assert one.values != three.values


def test_an_anisotropic_model_of_an_isotropic_material_is_isotropic():
    fitted = fit(EXAMPLES["cook-torrance"], MODELS["ggx-anisotropic"], samples=5000)
    values = fitted.values
    assert values["roughness_x"] == pytest.approx(values["roughness_y"], rel=0.2)


def test_black_can_be_fitted():
    random = np.random.default_rng(0)
    wi, wo = hemisphere(random, 500), hemisphere(random, 500)
    fitted = fit(ScatteredBrdf(wi, wo, np.zeros((500, 3))), MODELS["lambert"])
    assert max(fitted.values["diffuse"]) < 1e-5


def test_wrong_settings_are_refused():
    for settings in ({"gain": 0.0}, {"gain": np.inf}, {"samples": 0}, {"starts": 0}):
        with pytest.raises(ValueError, match="positive"):
            fit(EXAMPLES["ggx"], Ggx, **settings)


def test_nothing_valid_is_an_error():
    class Unknown(Ggx):
        def valid_components(self, wi, wo):
            return wi[2] > 2.0

    unknown = Unknown(name="fog", **EXAMPLES["ggx"].values)
    with pytest.raises(NacreError, match="fog: hardly any"):
        fit(unknown, Ggx)
