"""Points of a Sobol sequence against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from nacre.numerics.sobol import DIMENSIONS, sobol


@pytest.mark.parametrize("dimensions", range(1, DIMENSIONS + 1))
@pytest.mark.parametrize("log2_count", [0, 1, 5, 13])
def test_points_are_those_of_scipy(dimensions: int, log2_count: int) -> None:
    theirs, ours = np.random.default_rng(7), np.random.default_rng(7)
    for _ in range(2):  # sets of one generator follow one another
        wanted = qmc.Sobol(dimensions, rng=theirs).random_base2(log2_count)
        np.testing.assert_array_equal(sobol(dimensions, log2_count, ours), wanted)
