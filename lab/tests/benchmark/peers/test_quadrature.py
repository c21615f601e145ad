"""Terms of physical laws on networks of the usual kind, and their gradients."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

from nacre.analytic import MODELS  # noqa: E402
from nacre.neural import Recipe  # noqa: E402
from nacre.neural.fit_data import prepare  # noqa: E402
from nacre.neural.torch import SampleStack  # noqa: E402
from nacre.runtime.progress import silent  # noqa: E402
from nacre_lab.benchmark.peers.penalized import PenalizedTrainer  # noqa: E402
from nacre_lab.benchmark.peers.quadrature import (  # noqa: E402
    ChromaticityTerm,
    PassivityTerm,
    fit_quadrature,
)

SHORT = Recipe(physical=True, samples=4000, epochs=3, batch=64)


def test_only_what_exceeds_the_ceiling_counts() -> None:
    term = PassivityTerm(2.0, 0.9)

    def albedo(*colors: float) -> float:
        value = torch.tensor(colors) / np.pi
        return float(term(torch.zeros(0), lambda x: value.expand(len(x), 3)))

    assert albedo(0.9, 0.5, 0.1) == pytest.approx(0.0, abs=1e-12)
    assert albedo(1.0, 1.1, 0.1) == pytest.approx(2.0 * (0.01 + 0.04), rel=1e-5)


def test_colors_of_the_right_norm_cost_nothing() -> None:
    rows = torch.tensor([[0.0, 3.0, 4.0, 0.0, 0.5]])  # one input, f cos, cos
    term = ChromaticityTerm(1.0)
    assert float(term(rows, lambda x: torch.tensor([[0.0, 0.0, 10.0]]))) == pytest.approx(0.0)
    expected = np.log(1.0 + 5.0) - np.log(1.0 + 2.5)
    assert float(term(rows, lambda x: torch.tensor([[0.0, 0.0, 5.0]]))) == pytest.approx(expected)


def test_a_gradient_with_terms_is_that_of_differences() -> None:
    gray = MODELS["lambert"](diffuse=(0.9, 0.9, 0.9))
    material = prepare(gray, SHORT, silent)
    term = ChromaticityTerm(0.7)
    trainer, plain = PenalizedTrainer(material, [term]), PenalizedTrainer(material, [])
    samples = SampleStack([material.training], "cpu")
    rows = samples.blocks.reshape(1, -1, samples.blocks.shape[-1])[:, :64]
    with_term, without = (t._gradient(rows)[1][-1][0].numpy() for t in (trainer, plain))

    def value(step: float) -> float:
        moved = PenalizedTrainer(material, [])
        moved._biases[-1][0, 0] += step

        def f_r(x: torch.Tensor) -> torch.Tensor:
            return moved._forward(x[None], moved._weights, moved._biases)[-1][0].exp()

        return float(term(rows[0].double().float(), f_r))

    difference = (value(1e-2) - value(-1e-2)) / 2e-2
    assert with_term[0] - without[0] == pytest.approx(difference, rel=2e-2)


def test_a_bright_material_is_held_below_1_and_is_reciprocal() -> None:
    white = MODELS["lambert"](diffuse=(1.0, 1.0, 1.0), name="white")
    found = fit_quadrature(white, SHORT, chromaticity=0.3, passivity=10.0, ceiling=0.97)
    assert found.metadata["physical"]["albedo_bound"] <= 1.0
    w = np.array([[0.6, 0.0, 0.8], [0.0, 0.28, 0.96]], np.float32)
    np.testing.assert_array_equal(found.eval(w, w[::-1]), found.eval(w[::-1], w))
