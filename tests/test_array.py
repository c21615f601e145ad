"""The same formula gives the same numbers on every array library."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.array import Table, namespace
from nacre.geometry import from_half_difference, half_difference, join, split, to_spherical
from nacre.sampling import BlinnPhongMixture
from tests.sampling.mixtures import MIXTURES
from tests.variants import require_mitsuba


def to_numpy(array) -> np.ndarray:
    return array.numpy() if hasattr(array, "numpy") else np.array(array)


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    w = random.normal(size=(2, count, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    return w[0], w[1]


def torch_components(w):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    return tuple(torch.from_numpy(c.copy()) for c in split(w))


def drjit_components(w):
    mi = require_mitsuba()
    return tuple(mi.Float(c) for c in split(w))


@pytest.mark.parametrize("convert", [torch_components, drjit_components])
def test_geometry_and_lobes_agree_with_numpy(convert):
    wi, wo = pairs(500)
    u = np.random.default_rng(0).random((500, 3), dtype=np.float32)
    mixtures = BlinnPhongMixture(0.6, 80.0), *MIXTURES.values()

    def formulas(wi, wo, u):
        h, d = half_difference(wi, wo)
        found = [*h, *d, *from_half_difference(h, d)[0], *to_spherical(h)]
        for mixture in mixtures:
            drawn, density = mixture.sample_components(wo, u)
            # Sharp lobes magnify what the libraries' last bits differ in.
            found += [*drawn, density / (1.0 + density), mixture.pdf_components(wi, wo)]
        return found

    ours = formulas(*(convert(w) for w in (wi, wo, u)))
    for one, other in zip(ours, formulas(*(split(w) for w in (wi, wo, u))), strict=True):
        np.testing.assert_allclose(to_numpy(one), other, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("convert", [torch_components, drjit_components])
def test_tables_gather_alike(convert):
    table = Table(np.arange(12.0).reshape(3, 4) ** 2)
    x = convert(np.array([[0.2, 1.9, 11.0], [4.0, 5.5, 6.0]], np.float32))
    for component, expected in zip(x, [(0, 16), (1, 25), (121, 36)], strict=True):
        xp = namespace(component)
        index = xp.to_index(component)
        np.testing.assert_array_equal(to_numpy(xp.take(table, index)), expected)
        floats = xp.to_float(index, component)
        np.testing.assert_array_equal(to_numpy(floats), np.floor(to_numpy(component)))


def test_numpy_serves_plain_numbers():
    xp = namespace(1.0, 2)
    assert float(xp.maximum(1.0, 2.0)) == 2.0


def test_join_broadcasts():
    assert join((1.0, np.zeros((2, 1)), np.zeros(3))).shape == (2, 3, 3)
