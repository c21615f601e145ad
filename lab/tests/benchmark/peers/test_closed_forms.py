"""Peers without training: regressions are those of closed forms, and bytes are those stored."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from nacre.analytic import MODELS
from nacre.errors import NacreError
from nacre.sampling import draw_samples
from nacre_lab.benchmark.methods import methods
from nacre_lab.benchmark.peers import gaussian_process
from nacre_lab.benchmark.peers.closed_forms import SIZES
from nacre_lab.benchmark.peers.gaussian_process import features, greedy, round_weights, trends
from nacre_lab.benchmark.peers.spherical_gaussians import SphericalGaussians
from nacre_lab.benchmark.protocol import PROTOCOLS

GLOSSY = MODELS["ggx"](diffuse=(0.3, 0.2, 0.1), specular=(0.5, 0.5, 0.6), roughness=0.3)
KNOWN = methods(PROTOCOLS["quick"])


def _problem(rows: int = 60, columns: int = 12) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(0)
    return random.normal(size=(rows, columns)), random.normal(size=(rows, 2))


@pytest.mark.parametrize("power", [1.0, 1.5])
def test_a_process_through_all_points_interpolates(
    power: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    if power == 1.0:
        monkeypatch.setattr(gaussian_process, "_kernel", np.sqrt)
    random = np.random.default_rng(0)
    points, others = random.random((30, 3)), random.random((200, 3))
    values = np.sin(points @ [3.0, 1.0, 2.0])[:, None]
    columns = features(points, points, np.zeros((4, 30)))
    # Kriging with a linear mean, to which the kernel's part is orthogonal.
    mean, kernel = columns[:, :4], columns[:, 4:]
    system = np.block([[mean, kernel], [np.zeros((4, 4)), mean.T]])
    found = np.linalg.solve(system, np.concatenate([values, np.zeros((4, 1))]))
    np.testing.assert_allclose(columns @ found, values, atol=1e-9)
    if power == 1.0:  # which scipy has, too
        between = features(others, points, np.zeros((4, 30))) @ found
        oracle = RBFInterpolator(points, values, kernel="linear", degree=1)(others)
        np.testing.assert_allclose(between, oracle, atol=1e-6)


def test_trends_are_taken_out_of_the_kernel() -> None:
    random = np.random.default_rng(1)
    design, x = random.random((80, 2)), random.random((7, 2))
    points = design[::9]
    trend = trends(design, points)
    left = features(design, points, trend)
    np.testing.assert_allclose(left[:, :3].T @ left[:, 3:], 0.0, atol=1e-10)
    distances = np.linalg.norm(x[:, None] - points, axis=2) ** 1.5
    whole = features(x, points, trend)
    np.testing.assert_allclose(whole[:, 3:] + whole[:, :3] @ trend, distances, atol=1e-7)


def test_every_column_chosen_lowers_the_error_most() -> None:
    columns, values = _problem()
    chosen = greedy(columns.T @ columns, columns.T @ values, 2, 4).tolist()
    assert chosen[:2] == [0, 1]

    def error(taken: list[int]) -> float:
        found = np.linalg.lstsq(columns[:, taken], values)[0]
        return float(((columns[:, taken] @ found - values) ** 2).sum())

    for k in range(2, 6):
        errors = {j: error([*chosen[:k], j]) for j in range(12) if j not in chosen[:k]}
        assert chosen[k] == min(errors, key=lambda j: errors[j])


def test_weights_are_rounded_so_that_others_make_up_for_it() -> None:
    columns, values = _problem()
    columns = columns.cumsum(axis=1) + 10.0  # nearly dependent
    gram, moment = columns.T @ columns, columns.T @ values
    exact = np.linalg.solve(gram, moment)
    together = round_weights(gram, moment)
    assert together.dtype == np.float16

    def error(weights: np.ndarray) -> float:
        return float(((columns @ (weights - exact)) ** 2).sum())

    assert error(together.astype(np.float64)) < 0.5 * error(exact.astype(np.float16))


def test_a_process_of_few_bytes_is_close_and_the_same_compiled() -> None:
    found = gaussian_process.fit(GLOSSY, 600)
    assert 590 < found.nbytes <= 600
    pairs = draw_samples(GLOSSY, 4000, 5, distribution="mixed")
    compiled = found.eval(pairs.wi, pairs.wo)
    exact = found.eval(pairs.wi.astype(np.float64), pairs.wo.astype(np.float64))
    np.testing.assert_allclose(compiled, exact, rtol=2e-3, atol=1e-3)
    relative = np.abs(exact - pairs.rgb) / pairs.rgb
    assert np.median(relative) < 0.02
    assert np.percentile(relative, 90) < 0.1
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    turned = found.eval(pairs.wi.astype(np.float64) @ turn, pairs.wo.astype(np.float64) @ turn)
    np.testing.assert_allclose(turned, exact, rtol=1e-4)
    with pytest.raises(NacreError, match="does not fit into 100 bytes"):
        gaussian_process.fit(GLOSSY, 100)


def test_peers_are_known_by_name() -> None:
    assert {f"gaussian-process-{nbytes}" for nbytes in SIZES} <= KNOWN.keys()
    assert "our own" in KNOWN["spherical-gaussians"].about


def test_spherical_gaussians_add_up() -> None:
    values: dict[str, Any] = {
        p.name: (0.0,) * 3 if p.color else p.low for p in SphericalGaussians.parameters
    }
    one = {"normal_reflectance": 1.0, "masking": 0.01, "sharpness_2": 8.0}
    lobe = SphericalGaussians(**values | one | {"amplitude_2": (1.0, 2.0, 0.5)})
    assert lobe.nbytes == 4 * len(values) + 4 * 2 * 7
    c = np.cos(0.3)
    w = np.array([np.sin(0.3), 0.0, c])
    # Light and view meet at 0.6 across the normal; with hardly any masking G is 1.
    found = lobe.eval(w * [-1.0, 1.0, 1.0], w)
    np.testing.assert_allclose(found, np.array([1.0, 2.0, 0.5]) / (4.0 * c * c), rtol=1e-3)
    found = lobe.eval(w, w)
    expected = np.exp(8.0 * (c - 1.0)) * np.array([1.0, 2.0, 0.5]) / (4.0 * c * c)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
