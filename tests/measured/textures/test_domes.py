"""Directions of the domes against lists that others made."""

import numpy as np

from nacre.measured.textures import BONN, UTIA
from tests.data import require_data


def test_bonn_dome_is_the_published_list() -> None:
    path = require_data("bonn", "ubo2014_directions.csv")
    published = np.loadtxt(path, delimiter=",", skiprows=1)
    assert np.abs(BONN.directions - published).max() < 2e-6


def test_numbers_of_directions_and_pairs() -> None:
    assert len(BONN.directions) == 151
    assert len(UTIA.directions) == 81
    wi, wo = UTIA.pairs()
    assert len(wi) == 6561
    assert np.array_equal(wi[:81], UTIA.directions)
    assert (wo[:81] == UTIA.directions[0]).all()


def test_utia_dome_has_rings_of_even_azimuths_from_0() -> None:
    """Steps of 60, 30, 20, 18 and 15 degrees at polar angles 15 degrees apart."""
    expected = [[0.0, 0.0, 1.0]]
    for polar, step in ((15, 60), (30, 30), (45, 20), (60, 18), (75, 15)):
        theta = np.radians(polar)
        for azimuth in np.radians(np.arange(0, 360, step)):
            x, y = np.cos(azimuth), np.sin(azimuth)
            expected.append([np.sin(theta) * x, np.sin(theta) * y, np.cos(theta)])
    np.testing.assert_allclose(UTIA.directions, expected, atol=1e-6)
