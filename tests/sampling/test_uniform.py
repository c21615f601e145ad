"""Directions of samples."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.geometry import rusinkiewicz_angles, split
from nacre.sampling import DISTRIBUTIONS, draw_samples
from tests.reflectances import Brushed, Glossy
from tests.scans import Gloss


@pytest.mark.parametrize("brdf", [Gloss(), Brushed()])
def test_hemisphere_samples_are_uniform_over_the_solid_angle(brdf):
    samples = draw_samples(brdf, 40_000, 0, distribution="hemisphere")
    # Archimedes: heights of points on a sphere are uniform.
    for w in (samples.wi, samples.wo):
        heights = np.histogram(w[:, 2], 10, (0.0, 1.0))[0]
        assert heights == pytest.approx(np.full(10, 4_000), rel=0.1)
    turn = np.arctan2(samples.wo[:, 1], samples.wo[:, 0])
    assert np.histogram(turn, 8)[0] == pytest.approx(np.full(8, 5_000), rel=0.1)
    np.testing.assert_allclose(samples.rgb, brdf.eval(samples.wi, samples.wo), rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(samples.wi, axis=1), 1.0, atol=1e-6)


def test_rusinkiewicz_samples_are_denser_about_the_mirror_direction():
    near = {}
    for name in DISTRIBUTIONS:
        samples = draw_samples(Gloss(), 20_000, 0, distribution=name)
        half = samples.wi + samples.wo
        near[name] = np.mean(half[:, 2] > 0.99 * np.linalg.norm(half, axis=1))
    assert near["rusinkiewicz"] > 2.0 * near["hemisphere"]


@pytest.mark.parametrize("brdf", [Glossy(0.2, 0.1, 0.3), Brushed()], ids=["isotropic", "brushed"])
def test_mixed_samples_are_half_by_solid_angle_and_half_near_the_mirror_direction(brdf):
    samples = draw_samples(brdf, 60_000, 0, distribution="mixed")
    theta_h = rusinkiewicz_angles(split(samples.wi), split(samples.wo))[0]
    even = draw_samples(brdf, 60_000, 1, distribution="hemisphere")
    even_theta_h = rusinkiewicz_angles(split(even.wi), split(even.wo))[0]
    # Within x of the pole lies sqrt(x / (pi / 2)) of angles drawn as a square, before those with a
    # direction below the horizon are dropped.
    share = np.sqrt(0.01 / (0.5 * np.pi))
    close, even_close = ((theta < 0.01).mean() for theta in (theta_h, even_theta_h))
    assert even_close < 0.001
    assert 0.5 * share < close < share
    # Far from the mirror direction most are those by solid angle.
    assert (samples.wi[:, 2] < 0.1).mean() > 0.4 * (even.wi[:, 2] < 0.1).mean()
