"""Rows of a file that no reflectance can hold."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.measured.deduplication import from_measurement
from nacre.metrics import known_fraction
from tests.measured.support import hemisphere
from tests.scans import Gloss


def test_rows_below_the_horizon_are_dropped_and_duplicates_averaged():
    random = np.random.default_rng(7)
    wi, wo = (hemisphere(random, 6).astype(np.float64) for _ in range(2))
    rgb = random.random((6, 3))
    rows = [0, 1, 2, 1, 3, 4, 1, 5]
    wi, wo, rgb = wi[rows], wo[rows], rgb[rows] + 0.1 * np.arange(8)[:, None]
    wi[2] *= -1.0
    rgb[5] = -1.0
    rgb[7, 2] = -0.01  # a color outside the gamut
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


def turned_and_mirrored(w):
    """Directions at four azimuths, and the mirror images of these."""
    x, y, z = w.T
    quarters = [(x, y), (-y, x), (-x, -y), (y, -x)]
    return np.concatenate([np.stack([a, s * b, z], axis=1) for a, b in quarters for s in (1, -1)])


def test_a_scan_repeated_at_other_azimuths_is_the_scan():
    random = np.random.default_rng(8)
    wi, wo = (hemisphere(random, 500).astype(np.float64) for _ in range(2))
    wi[:40] = wo[20:60] = 0.0, 0.0, 1.0  # seen or lit from the normal: the azimuth is free
    once = from_measurement(wi, wo, Gloss().eval(wi, wo), "once")
    wi, wo = turned_and_mirrored(wi), turned_and_mirrored(wo)
    often = from_measurement(wi, wo, Gloss().eval(wi, wo), "often")
    assert len(often.samples) == len(once.samples)
    np.testing.assert_allclose(often.samples.rgb, once.samples.rgb, rtol=1e-6)
    assert known_fraction(often) == pytest.approx(known_fraction(once), abs=1e-3)
    assert known_fraction(once) > 0.5
    every = from_measurement(wi, wo, Gloss().eval(wi, wo), "anisotropic", isotropic=False)
    assert len(every.samples) > 7 * len(once.samples)
