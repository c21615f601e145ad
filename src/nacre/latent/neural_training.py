"""Training of a neural basis, together with the codes of its materials, in PyTorch."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Doubles, Weights
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent.descent import Tensor, descend, finished, free, torch
from nacre.latent.directions import isotropic_inputs, sampled, shared_directions
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.latent.recipes import GAIN, BasisRecipe, PredictorRecipe
from nacre.neural.inputs import ENHANCED
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import RELU, dense
from nacre.numerics.pca import largest_first
from nacre.runtime.progress import Progress

_CODE_RATE = 4.0  # learning rate of the codes, as a multiple of that of the network
_PRIOR = 1e-4  # weight of the mean squared length of a code in the loss
_MEAN_LOGARITHM = -2.0  # ln f_r where training begins


def train_neural(
    materials: Sequence[Callable[[], Brdf]],
    recipe: BasisRecipe,
    checkpoint: Path | None,
    report: Progress,
) -> NeuralBasis:
    """A neural basis of materials.

    The mean absolute difference of log(1 + 30 f cos theta_i) is minimized over the network and the
    codes of the materials at once. For parameters and errors see
    :meth:`nacre.latent.basis.LatentBasis.train`. It takes 12 bytes of memory per direction and
    material.
    """
    if len(materials) < 2:
        raise NacreError("a neural basis needs two materials or more")
    wi, wo = shared_directions(recipe.directions, recipe.seed)
    values, names = sampled(materials, wi, wo, report)
    training = _Training(isotropic_inputs(wi, wo, ENHANCED), wi[:, 2], np.stack(values), recipe)
    loss = training.run(checkpoint, report)
    settings = asdict(recipe) | {"hidden": list(recipe.hidden)}
    basis = training.basis({"materials": names, "loss": loss, "training": settings})
    if not recipe.predictors:
        return basis
    from nacre.latent.predictor_training import with_predictors

    steps = min(recipe.steps, PredictorRecipe.steps)
    return with_predictors(basis, PredictorRecipe(steps=steps, seed=recipe.seed), report)


class _Training:
    def __init__(
        self,
        inputs: Weights,
        cosine: Weights,
        f_r: Weights,
        recipe: BasisRecipe,
    ) -> None:
        self._recipe = recipe
        self._inputs, self._f_r = torch.from_numpy(inputs), torch.from_numpy(f_r)
        self._weight = torch.from_numpy(GAIN * cosine)[:, None]
        random = np.random.default_rng((recipe.seed, 2))
        luma, materials = recipe.code_dim - 2 * recipe.pairs, len(f_r)

        def normal(deviation: float, *shape: int) -> Tensor:
            return free(random.normal(0.0, deviation, shape))

        widths = list(itertools.pairwise((inputs.shape[1], *recipe.hidden)))
        self._weights = [normal(math.sqrt(2.0 / n), n, width) for n, width in widths]
        self._biases = [normal(0.0, width) for _, width in widths]
        last = recipe.hidden[-1]
        self._functions = normal(0.1 / math.sqrt(last), last + 1, 1 + luma + recipe.pairs)
        self._functions.data[:, 0] *= 10.0
        self._functions.data[-1, 0] = _MEAN_LOGARITHM
        self._luma = normal(0.5, materials, luma)
        self._pairs = normal(0.5, materials, recipe.pairs, 2)

    def run(self, checkpoint: Path | None, report: Progress) -> float:
        network = [*self._weights, *self._biases, self._functions]
        groups = {1.0: network, _CODE_RATE: [self._luma, self._pairs]}
        same = f"{tuple(self._f_r.shape)} {self._f_r.double().sum().item()!r}"
        return descend(groups, self._loss, self._recipe, same, checkpoint, report)

    def _loss(self, step: int) -> Tensor:
        random = np.random.default_rng((self._recipe.seed, 4, step))
        batch = random.integers(len(self._inputs), size=self._recipe.batch)
        chosen = torch.from_numpy(batch)
        values = self._inputs[chosen]
        for layer in zip(self._weights, self._biases, strict=True):
            values = dense(values, layer, RELU)
        values = values @ self._functions[:-1] + self._functions[-1]
        count, luma = self._luma.shape
        common = torch.nn.functional.pad(self._luma, (1, 0), value=1.0) @ values[:, : 1 + luma].T
        chroma = (self._pairs @ torch.from_numpy(CHROMA)).transpose(1, 2)
        logarithms = common[..., None] + (chroma @ values[:, 1 + luma :].T).transpose(1, 2)
        weight, f_r = self._weight[chosen], self._f_r[:, chosen]
        weighted = torch.log1p(logarithms.clamp(max=BRIGHTEST).exp() * weight)
        error = (weighted - torch.log1p(f_r.clamp(min=0.0) * weight)).abs()
        length = (self._luma.square().sum() + self._pairs.square().sum()) / count
        return error[f_r >= 0.0].mean() + _PRIOR * length

    def basis(self, metadata: dict[str, Any]) -> NeuralBasis:
        """The basis, for codes with mean 0 and covariance 1."""
        luma, pairs = (c.detach().double().numpy() for c in (self._luma, self._pairs))
        functions = self._functions.detach().double().numpy()
        count, mean = luma.shape[1], luma.mean(axis=0)
        common, of_luma, of_pairs = np.split(functions, [1, 1 + count], axis=1)
        # Permutations of the channels make both values of a pair vary alike, about 0.
        both = np.concatenate([pairs[..., 0], pairs[..., 1]])
        luma_deviations, pair_deviations = _deviations(luma - mean), _deviations(both)
        whitened = [
            common + of_luma @ mean[:, None],
            of_luma @ luma_deviations.T,
            of_pairs @ pair_deviations.T,
        ]
        examples = [
            np.linalg.solve(luma_deviations.T, (luma - mean).T).T,
            np.linalg.solve(pair_deviations.T, pairs).reshape(len(pairs), -1),
        ]
        hidden = [finished(layer) for layer in zip(self._weights, self._biases, strict=True)]
        output, codes = (np.hstack(parts).astype(np.float32) for parts in (whitened, examples))
        return NeuralBasis(hidden, output, count, codes, metadata)


def _deviations(values: Doubles) -> Doubles:
    """A square matrix that gives rows of covariance 1 the covariance of `values`, (n, k)."""
    squares, vectors = largest_first(values.T @ values / len(values))
    return np.sqrt(np.maximum(squares, 1e-12))[:, None] * vectors.T
