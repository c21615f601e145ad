"""The transform of spheres against SciPy's harmonics, and the loss against Parseval."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import sph_harm_y

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

from nacre.analytic import MODELS  # noqa: E402
from nacre.neural import Recipe  # noqa: E402
from nacre.neural.inputs import ENHANCED  # noqa: E402
from nacre_lab.benchmark.peers.frequency import (  # noqa: E402
    FrequencyTerm,
    SphereTransform,
    fit_frequency,
)

GRAY = MODELS["lambert"](diffuse=(0.5, 0.4, 0.3), name="gray")


@pytest.mark.parametrize(("degree", "order"), [(0, 0), (1, 0), (3, 2), (6, 6), (7, 1)])
def test_a_harmonic_has_one_coefficient(degree: int, order: int) -> None:
    transform = SphereTransform(7)
    grid = np.meshgrid(transform.colatitudes, transform.longitudes, indexing="ij")
    harmonic = sph_harm_y(degree, order, *grid)
    parts = np.stack([harmonic.real, harmonic.imag, 2.0 * harmonic.real], axis=-1)
    real, imaginary, double = np.moveaxis(np.asarray(transform(torch.from_numpy(parts))), -1, 0)
    expected = np.zeros((8, 8))
    expected[order, degree] = 1.0
    np.testing.assert_allclose(real + 1j * imaginary, expected, atol=1e-6)
    np.testing.assert_allclose(double, 2.0 * real, atol=1e-6)


def test_the_loss_of_a_material_itself_is_0_and_grows_with_the_square_of_the_error() -> None:
    color = torch.tensor([0.5, 0.4, 0.3]) / np.pi

    def losses(factor: float) -> list[float]:
        def f_r(x: torch.Tensor) -> torch.Tensor:
            return (factor * color).expand(len(x), 3)

        term = FrequencyTerm(GRAY, ENHANCED, 1.0)  # values of theta_h come in the same order
        return [float(term(torch.zeros(0), f_r)) for _ in range(3)]

    assert max(losses(1.0)) < 1e-12
    one, two = losses(1.1), losses(1.2)
    np.testing.assert_allclose(two, np.multiply(4.0, one), rtol=1e-4)
    assert min(one) > 0.0


def test_a_weight_changes_the_fit_and_none_does_not() -> None:
    recipe = Recipe(samples=1000, epochs=1, batch=64)
    up = np.array([[0.0, 0.0, 1.0]])
    without, again, weighted = (
        fit_frequency(GRAY, recipe, weight).eval(up, up) for weight in (0.0, 0.0, 0.1)
    )
    np.testing.assert_array_equal(without, again)
    assert not np.array_equal(without, weighted)
