"""Rows of a file that no reflectance can hold."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.measured.cleaning import from_measurement
from tests.measured.support import hemisphere


def test_rows_below_the_horizon_are_dropped_and_duplicates_averaged():
    random = np.random.default_rng(7)
    wi, wo = (hemisphere(random, 6).astype(np.float64) for _ in range(2))
    rgb = random.random((6, 3))
    rows = [0, 1, 2, 1, 3, 4, 1, 5]
    wi, wo, rgb = wi[rows], wo[rows], rgb[rows] + 0.1 * np.arange(8)[:, None]
    wi[2] *= -1.0
    rgb[5] = -1.0
    rgb[7, 2] = -0.01  # a colour outside the gamut
    brdf = from_measurement(wi, wo, rgb, "rows")
    facts = brdf.describe()
    assert facts["samples"] == 4
    assert facts["dropped below the horizon"] == 1
    assert facts["dropped as not measured"] == 1
    assert facts["averaged as duplicates"] == 2
    expected = np.stack([rgb[0], rgb[[1, 3, 6]].mean(axis=0), rgb[4], rgb[7]])
    np.testing.assert_allclose(brdf.samples.rgb, expected)
    np.testing.assert_allclose(brdf.samples.wi, wi[[0, 1, 4, 7]])
    with pytest.raises(ValueError, match="no sample"):
        from_measurement(-np.abs(wi), wo, rgb, "rows")
