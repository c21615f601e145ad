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
