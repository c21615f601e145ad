"""The texture network of 2019 on one reflectance."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")

from nacre.geometry import from_spherical, join
from nacre_lab.reproduce.texture_network import fit_texture_network
from tests.reflectances import Glossy


def test_the_network_learns_a_reflectance_between_the_directions_that_it_has_seen():
    paint = Glossy(0.6, 0.02, 0.5)
    found = fit_texture_network(paint, epochs=3, seed=1)
    widths = 8 + 4, 106, 106, 106, 106, 3
    weights = sum(a * b + b for a, b in itertools.pairwise(widths))
    assert found.nbytes == 4 * (8 + weights)
    wi = join(from_spherical(np.radians(np.full(50, 33.0)), np.linspace(0.0, 6.0, 50)))
    wo = join(from_spherical(np.radians(np.linspace(1.0, 65.0, 50)), np.full(50, 0.5)))
    error = np.abs(found.eval(wi, wo) - paint.eval(wi, wo))
    assert np.median(error) < 0.1 * np.median(paint.eval(wi, wo))
