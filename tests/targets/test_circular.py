"""Sine and cosine as shading languages compute them."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.targets.circular import CIRCULAR

FUNCTIONS = {"sin": np.sin, "cos": np.cos}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_errors_are_those_of_floats(name: str) -> None:
    x = np.concatenate([np.linspace(-300.0, 300.0, 200_001), np.pi / 2 * np.arange(-9, 10)])
    x = x.astype(np.float32)
    found = CIRCULAR[name](x)
    assert found.dtype == np.float32
    expected = FUNCTIONS[name](x.astype(np.float64))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=3e-7)
