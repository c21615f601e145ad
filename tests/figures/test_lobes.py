"""Lobes are traced where they are steep and end where the measurement does."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.figures.lobes import lobe
from nacre.geometry import from_spherical, join
from tests.data import require_data
from tests.mitsuba.reflectances import Constant, Lobe
from tests.reflectances import Brushed


class Unknown(Constant):
    """Known nowhere."""

    def valid_components(self, wi, wo):
        return wi[2] > 2.0


class Cone(Constant):
    """Known for viewers within 40 degrees of the normal."""

    def valid_components(self, wi, wo):
        return wo[2] > math.cos(math.radians(40.0))


def exact(brdf: Brdf, incidence: float, theta: np.ndarray) -> np.ndarray:
    return brdf.eval(join(from_spherical(incidence, math.pi)), join(from_spherical(theta, 0.0)))


@pytest.mark.parametrize("degrees", [0.0, 45.0, 80.0])
@pytest.mark.parametrize("exponent", [10.0, 1000.0, 1e5, 1e6])
def test_lines_between_points_follow_the_lobe(exponent, degrees):
    brdf = Lobe(exponent)
    incidence = math.radians(degrees)
    found = lobe(brdf, incidence)
    assert len(found.theta) < 2000
    f, peak = found.rgb[:, 0], exact(brdf, incidence, np.array([incidence]))[0, 0]
    assert peak in f
    theta = np.random.default_rng(0).uniform(-1.5, 1.5, 5000)
    theta = np.append(theta, incidence + np.random.default_rng(1).normal(0, 0.02, 5000))
    theta = theta[np.abs(theta) < 1.5]
    truth = exact(brdf, incidence, theta)[:, 0]
    line = np.interp(theta, found.theta, np.log(np.maximum(f, 1e-7 * peak)))
    seen = truth > 1e-5 * peak
    assert np.abs(line - np.log(truth, where=seen, out=np.zeros_like(line)))[seen].max() < 0.05


def test_a_diffuse_lobe_takes_few_points():
    found = lobe(Constant(0.5), math.radians(30.0))
    assert len(found.theta) < 320
    assert (np.diff(found.theta) > 0.0).all()
    np.testing.assert_allclose(found.rgb, 0.5 / math.pi, rtol=1e-6)
    expected = 0.5 / math.pi * np.cos(found.theta)
    np.testing.assert_allclose(found.intensity()[:, 1], expected, rtol=1e-6)


def test_what_is_not_known_is_a_gap_with_sharp_ends():
    found = lobe(Cone(0.5), math.radians(20.0))
    known = np.isfinite(found.rgb).all(axis=1)
    np.testing.assert_array_equal(known, np.abs(found.theta) < math.radians(40.0))
    for side in (-1.0, 1.0):
        distance = np.degrees(side * found.theta) - 40.0
        assert -0.02 < distance[known].max() < 0.0 < distance[~known & (distance > 0)].min() < 0.02


def test_the_mirror_direction_is_at_the_azimuth():
    across, along = (lobe(Brushed(), 0.8, azimuth) for azimuth in (0.0, math.pi / 2))
    assert across.theta[across.rgb[:, 0].argmax()] == pytest.approx(0.8, abs=0.1)
    tail = [np.interp(-0.6, item.theta, item.rgb[:, 0]) for item in (across, along)]
    assert tail[1] > 4.0 * tail[0]


def test_black_and_unknown_materials_are_lobes_too():
    assert (lobe(Constant(0.0), 0.5).rgb == 0.0).all()
    assert np.isnan(lobe(Unknown(0.5), 0.5).rgb).all()


@pytest.mark.parametrize("incidence", [-0.1, math.pi / 2, math.nan])
def test_light_below_the_horizon_has_no_lobe(incidence):
    with pytest.raises(ValueError, match="incidence must lie in"):
        lobe(Constant(0.5), incidence)


def test_gaps_of_a_real_scan_are_those_of_its_validity():
    brdf = nacre.load(require_data("cornell", "cayman.brdf"))
    found = lobe(brdf, math.radians(75.0))
    wi = join(from_spherical(found.incidence, math.pi))
    known = brdf.valid(wi, join(from_spherical(found.theta, 0.0)))
    np.testing.assert_array_equal(np.isfinite(found.rgb).all(axis=1), known)
    assert 0.2 < known.mean() < 0.95
