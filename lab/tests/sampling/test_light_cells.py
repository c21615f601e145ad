"""Cells of light: densities, samples, shares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare

from nacre.geometry import join, split
from nacre.mitsuba.environment import pixel_directions
from nacre_lab.sampling.light_cells import LightCells

from .lights import lamps


def sphere(count):
    """Even points on the sphere (Fibonacci)."""
    y = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    phi = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    radius = np.sqrt(1.0 - y * y)
    return radius * np.cos(phi), y, radius * np.sin(phi)


@pytest.mark.parametrize("count", [1, 7, 64, 512])
def test_densities_integrate_to_one_in_each_cell(count):
    cells = LightCells(lamps(), count)
    number = 400_000
    cell, density = cells.at_components(sphere(number))
    whole = np.bincount(cell, density, count) * 4.0 * np.pi / number
    assert np.abs(whole - 1.0).max() < (0.02 if count < 512 else 0.2)


@pytest.mark.parametrize("count", [1, 7, 64])
def test_samples_have_the_density_that_is_said(count):
    cells = LightCells(lamps(), count)
    rng = np.random.default_rng(0)
    number = 200_000
    cell = rng.choice(count, number, p=cells.energies / cells.energies.sum())
    w = cells.sample_components(cell, tuple(rng.random((4, number))))
    np.testing.assert_allclose(np.linalg.norm(join(w), axis=-1), 1.0, atol=1e-9)
    found, density = cells.at_components(w)
    assert (found == cell).mean() > 0.9999
    assert (density > 0.0).all()
    # All cells together have the density of the map's light, in boxes of heights and azimuths.
    counts, points = 12, sphere(400_000)
    at, inside = cells.at_components(points)
    expected = cells.energies[at] / cells.energies.sum() * inside

    def box(w):
        turn = (np.arctan2(w[2], w[0]) / (2.0 * np.pi)) % 1.0
        rows = np.minimum((0.5 * w[1] + 0.5) * counts, counts - 1).astype(int)
        return rows * counts + np.minimum(turn * counts, counts - 1).astype(int)

    have = np.bincount(box(w), minlength=counts**2)
    want = np.bincount(box(points), expected, minlength=counts**2)
    assert chisquare(have, want * (number / want.sum())).pvalue > 1e-6


def test_cells_share_the_light():
    cells = LightCells(lamps(), 8)
    shares = cells.energies / cells.energies.sum()
    assert shares.max() < 2.5 / 8
    np.testing.assert_allclose(np.linalg.norm(cells.middles, axis=1), 1.0)


def test_a_mean_over_samples_is_the_light():
    light = lamps()
    cells, rng = LightCells(light, 16), np.random.default_rng(1)
    number = 100_000
    shares = cells.energies / cells.energies.sum()
    cell = rng.choice(16, number, p=shares)
    w = join(cells.sample_components(cell, tuple(rng.random((4, number)))))
    _, density = cells.at_components(split(w))
    values = light.radiance(w)[:, 1] / (density * shares[cell])
    fine, solid_angle = pixel_directions(513, 1024)
    truth = float((light.radiance(fine)[..., 1] * solid_angle[:, None]).sum())
    assert abs(values.mean() - truth) < 5.0 * values.std() / np.sqrt(number)


@pytest.mark.parametrize("count", [0, 513])
def test_no_such_cells(count):
    with pytest.raises(ValueError, match="16 x 32"):
        LightCells(lamps(), count)
