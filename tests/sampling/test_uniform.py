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
def test_mixed_samples_are_half_rusinkiewicz_and_half_what_pictures_show(brdf):
    mixed, adaptive, even = (
        draw_samples(brdf, 60_000, 0, distribution=name)
        for name in ("mixed", "rusinkiewicz", "hemisphere")
    )

    def share(samples, angle):
        """Samples whose half vector is closer to the normal than an angle."""
        return (rusinkiewicz_angles(split(samples.wi), split(samples.wo))[0] < angle).mean()

    # Fewer pairs of the second half are dropped, so that it is the larger one in the end.
    assert share(mixed, 0.02) > 0.3 * share(adaptive, 0.02) > 5.0 * share(even, 0.02)
    assert 0.2 < (mixed.wo[:, 2] ** 2 > 0.7).mean() < 0.6
    np.testing.assert_allclose(mixed.rgb, brdf.eval(mixed.wi, mixed.wo), rtol=1e-5)


def test_mixed_samples_of_a_mirror_lie_in_its_highlight():
    mirror = Glossy(0.0, 1.0, 0.002)
    samples = draw_samples(mirror, 40_000, 0, distribution="mixed")
    theta_h = rusinkiewicz_angles(split(samples.wi), split(samples.wo))[0]
    assert (theta_h < 0.01).mean() > 0.1


def test_half_of_what_pictures_show_is_lit_from_anywhere_in_the_sky():
    u = np.random.default_rng(3).random((6, 40_000))
    wi, _ = DISTRIBUTIONS["mixed"](Glossy(0.2, 0.1, 0.3))(u)
    sky = np.zeros(u.shape[1], bool)
    sky[1::2] = u[5, 1::2] < 0.5
    lights = np.stack(wi, axis=1)[sky]
    np.testing.assert_allclose(lights[:, 2], 1.0 - u[2, sky], atol=1e-6)
    turn = np.mod(np.arctan2(lights[:, 1], lights[:, 0]), 2.0 * np.pi)
    np.testing.assert_allclose(turn, 2.0 * np.pi * u[3, sky], atol=1e-6)


def test_progress_goes_up_to_all_samples():
    told = []
    samples = draw_samples(Gloss(), 50_000, 0, progress=lambda *done: told.append(done))
    assert len(samples) == 50_000
    assert {total for _, total in told} == {50_000}
    assert [done for done, _ in told] == sorted({done for done, _ in told})
    assert told[-1][0] == 50_000
