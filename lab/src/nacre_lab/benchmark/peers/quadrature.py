"""PBNBRDF without its antiderivative: the same laws and losses on a network of the usual kind.

Reciprocity by inputs, as in :mod:`nacre_lab.benchmark.peers.antiderivative`; f_r = e^x; the albedo
of a random view in each step by quadrature, and the loss of colors' norms. In contrast to nacre's
physical fits, the network is trained on the material itself, not on its projection.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.geometry import cosine_hemisphere, join
from nacre.neural import Recipe
from nacre.neural.fit_data import SAMPLES, FitData
from nacre.neural.inputs import RECIPROCAL
from nacre.neural.nbrdf import OUTPUTS, NeuralBrdf
from nacre.neural.samples import direction_inputs, draw
from nacre.numerics.direction_samples import DirectionSamples
from nacre_lab.benchmark.peers.penalized import fit_with

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any

VIEWS, POINTS = 48, 256  # views of the bank, and directions of light for each


class PassivityTerm:
    """What the albedo of a view exceeds a ceiling by, squared, over channels.

    Parameters
    ----------
    weight
        Its factor.
    ceiling
        The albedo from which on it counts.
    seed
        Seed of the order of views.
    """

    def __init__(self, weight: float, ceiling: float, seed: int = 0) -> None:
        self._weight, self._ceiling = weight, ceiling
        self._random = np.random.default_rng((seed, 4))
        angles = np.linspace(0.0, 0.5 * math.pi, VIEWS, endpoint=False)
        u = (
            0.5 + np.arange(POINTS)[:, None] * np.array([0.7548776662466927, 0.5698402909980532])
        ) % 1
        wi = join(cosine_hemisphere(u[:, 0], u[:, 1]))

        def bank(angle: float) -> Tensor:
            wo = np.broadcast_to([math.sin(angle), 0.0, math.cos(angle)], wi.shape)
            pairs = DirectionSamples(wi, wo, np.zeros_like(wi))
            return torch.from_numpy(direction_inputs(pairs, True, RECIPROCAL).astype(np.float32))

        self._inputs = [bank(angle) for angle in angles]

    def __call__(self, _: Tensor, f_r: Callable[[Tensor], Tensor]) -> Tensor:
        """See :data:`nacre_lab.benchmark.peers.penalized.Term`."""
        inputs = self._inputs[self._random.integers(VIEWS)]
        albedo = math.pi * f_r(inputs).mean(dim=0)
        return self._weight * (albedo - self._ceiling).relu().square().sum()


@dataclass(frozen=True)
class ChromaticityTerm:
    """Errors of the norms of colors, in the logarithm of the loss, times a weight."""

    weight: float

    def __call__(self, rows: Tensor, f_r: Callable[[Tensor], Tensor]) -> Tensor:
        """See :data:`nacre_lab.benchmark.peers.penalized.Term`."""
        target, cosine = rows[:, -OUTPUTS - 1 : -1], rows[:, -1:]
        found = f_r(rows[:, : -OUTPUTS - 1]) * cosine
        error = found.norm(dim=1).log1p() - target.norm(dim=1).log1p()
        return self.weight * error.abs().mean()


def fit_quadrature(
    brdf: Brdf, recipe: Recipe, *, chromaticity: float, passivity: float, ceiling: float
) -> NeuralBrdf:
    """A physical network trained on the material itself.

    Parameters
    ----------
    brdf
        The material.
    recipe
        A physical recipe.
    chromaticity, passivity
        Factors of both terms.
    ceiling
        The albedo from which on passivity counts.

    Raises
    ------
    NacreError
        If the material is anisotropic, hardly any sample is valid, or training diverges.
    """
    if not brdf.isotropic:
        raise NacreError(f"{brdf.name or 'this material'}: is for isotropic materials")
    count = recipe.samples or SAMPLES
    recipe = replace(
        recipe,
        starts=1,
        samples=count,
        inputs=recipe.chosen_inputs,
        precision=recipe.stored_precision,
        activation=recipe.hidden_activation,
    )
    options = RECIPROCAL, recipe.loss_gain, recipe.sampling
    drawn = draw(brdf, count, recipe.seed, None, *options)
    about = {name: getattr(brdf, name) for name in ("source", "channels", "notes")}
    material = FitData(brdf.name, about, True, None, recipe, *drawn.split(recipe.held_out))
    color, energy = ChromaticityTerm(chromaticity), PassivityTerm(passivity, ceiling, recipe.seed)
    return fit_with(material, [color, energy])
