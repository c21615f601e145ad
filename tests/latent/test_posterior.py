"""Codes from few samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.latent.directions import shared_directions
from nacre.latent.posterior import _mixture
from nacre.measured.scattered import ScatteredBrdf
from nacre.numerics.direction_samples import DirectionSamples
from tests.latent.made import random_basis

CODE = np.array([0.9, -1.3, 0.4, 0.2, 1.1, -0.7])
WI, WO = shared_directions(3000, 11)


def test_few_samples_tell_what_they_can():
    made = random_basis()
    truth = made.decode(CODE)
    target = truth.eval(WI, WO)

    def error(count: int) -> float:
        samples = DirectionSamples(WI[:count], WO[:count], truth.eval(WI[:count], WO[:count]))
        code = made.encode(samples)
        assert np.abs(code).max() < 5.0
        return float(np.abs(np.log(made.decode(code).eval(WI, WO) / target)).mean())

    assert error(1000) < 0.02
    assert error(100) < 0.1
    average = np.abs(np.log(made.decode(np.zeros(6)).eval(WI, WO) / target)).mean()
    assert error(2) < average


def test_the_mean_over_priors_is_that_of_a_grid():
    """One value and one sample: the integral over all codes can be taken numerically."""
    values, slopes, centers = np.array([1.3]), np.array([[0.7]]), np.array([[-1.0], [2.0]])
    codes = np.linspace(-30.0, 30.0, 60001)

    def normal(x, deviation):
        return np.exp(-0.5 * (x / deviation) ** 2) / deviation

    weights, sums = [], []
    for noise in (0.1, 0.2, 0.4):
        for center, width, count in ((-1, 0.3, 2), (2, 0.3, 2), (-1, 0.5, 2), (2, 0.5, 2),
                                     (-1, 0.8, 2), (2, 0.8, 2), (0, 1.0, 1)):  # fmt: skip
            density = normal(codes - center, width) * normal(values - 0.7 * codes, noise)
            weights.append(density.sum() ** 0.4 / count)
            sums.append((codes * density).sum() / density.sum())
    expected = np.average(sums, weights=weights)
    assert _mixture(values, slopes, centers, 1).code == pytest.approx([expected], abs=1e-6)


def test_materials_are_expected_to_be_like_those_of_the_training():
    made = random_basis()
    known = made.examples[2].astype(float)
    f_r = made.decode(known).eval(WI[:40], WO[:40])
    code = made.encode(DirectionSamples(WI[:40], WO[:40], f_r))
    np.testing.assert_allclose(code, known, atol=0.1)


def test_scans_have_the_code_of_their_samples():
    made = random_basis()
    f_r = made.decode(CODE).eval(WI[:300], WO[:300])
    scan = ScatteredBrdf(WI[:300], WO[:300], f_r, "scan")
    np.testing.assert_array_equal(made.encode(scan), made.encode(scan.samples))
    with pytest.raises(FormatError, match="scan: is anisotropic"):
        made.encode(ScatteredBrdf(WI[:300], WO[:300], f_r, "scan", isotropic=False))


def test_no_sample_has_no_code():
    made = random_basis()
    with pytest.raises(ValueError, match="one sample"):
        made.encode(DirectionSamples(WI[:0], WO[:0], WI[:0]))


def test_a_sample_of_a_color_outside_the_gamut_counts_as_black():
    made = random_basis()
    f_r = made.decode(CODE).eval(WI[:100], WO[:100])
    negative, black = f_r.copy(), f_r.copy()
    negative[::7, 1], black[::7, 1] = -0.2, 0.0
    codes = (made.encode(DirectionSamples(WI[:100], WO[:100], f)) for f in (negative, black))
    np.testing.assert_array_equal(*codes)


def test_codes_are_drawn_from_the_mixture():
    values, slopes, centers = np.array([1.3]), np.array([[0.7]]), np.array([[-1.0], [2.0]])
    found = _mixture(values, slopes, centers, 1)
    drawn = found.draw(20000, 3)
    middle = found.doubts @ found.means
    assert drawn.mean() == pytest.approx(middle[0], abs=0.02)
    spread = found.doubts @ (found.deviations**2 + found.means**2) - middle**2
    assert drawn.var() == pytest.approx(spread[0], rel=0.03)
    assert found.doubts.max() < found.weights.max()
    np.testing.assert_array_equal(found.draw(5, 3), found.draw(5, 3))


def test_what_is_drawn_does_not_depend_on_which_axes_were_found():
    random = np.random.default_rng(1)
    slopes = np.vstack([random.normal(size=(4, 9)), np.zeros((2, 9))])  # two values are not told of
    found = _mixture(random.normal(size=9), slopes, random.normal(size=(5, 6)), 6)
    axes = found.axes * [1.0, -1.0, 1.0, -1.0, 1.0, 1.0]
    axes[:, :2] = axes[:, :2] @ [[0.6, -0.8], [0.8, 0.6]]  # those of no slope are any
    np.testing.assert_allclose(replace(found, axes=axes).draw(50), found.draw(50), atol=1e-9)


def faulty(count: int = 60, **faults: object) -> tuple[float, float]:
    """Errors of codes of samples with a fault, and of the same where the fault is allowed for."""
    made = random_basis()
    f_r = made.decode(CODE).eval(WI[:count], WO[:count]).astype(float)
    random = np.random.default_rng(4)
    sigma = None
    if "outliers" in faults:
        f_r[::9] *= 30.0
    if "factor" in faults:
        f_r *= faults["factor"]
    if "noise" in faults:
        sigma = np.where(np.arange(count) % 2, 0.0, 2.0 * f_r.mean())
        f_r = np.maximum(f_r + sigma[:, None] * random.normal(size=f_r.shape), 0.0)
    allowed = {"free_scale": "factor" in faults}
    samples = DirectionSamples(WI[:count], WO[:count], f_r)
    plain = made.posterior(samples)
    found = made.posterior(DirectionSamples(WI[:count], WO[:count], f_r, sigma), **allowed)
    return tuple(float(np.abs(p.code - CODE).mean()) for p in (plain, found))


def test_noise_that_is_stated_is_allowed_for():
    plain, found = faulty(noise=True)
    assert found < 0.5 * plain


def test_outliers_hardly_count():
    clean, _ = faulty()
    _, found = faulty(outliers=True)
    assert found < clean + 0.1


def test_the_factor_of_an_instrument_is_found():
    plain, found = faulty(factor=1.7, free_scale=True)
    assert found < 0.5 * plain
    made = random_basis()
    f_r = 1.7 * made.decode(CODE).eval(WI[:60], WO[:60])
    factor, deviation = made.posterior(
        DirectionSamples(WI[:60], WO[:60], f_r), free_scale=True
    ).scale
    assert abs(np.log(factor / 1.7)) < 2.0 * deviation < 0.5
