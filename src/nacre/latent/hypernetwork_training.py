"""Training of a hypernetwork, in PyTorch.

The neural basis has a material for every code, so the supply is endless: every step draws codes of
its own, most of them about those of known materials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent.descent import Tensor, descend, finished, free_layer, torch
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.latent.hypernetwork import COLUMN, HIDDEN_COUNT, Hypernetwork
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.latent.neural_training import train_neural
from nacre.latent.recipes import GAIN, BasisRecipe, HypernetworkRecipe
from nacre.latent.weights import tensor_reflectance
from nacre.neural.inputs import ENHANCED, PAPER
from nacre.neural.nbrdf import HIDDEN, OUTPUTS
from nacre.neural.training import initial_layers
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import SILU, Layer, dense, flat_weights
from nacre.runtime.progress import Progress
from nacre.runtime.store import Store

_REACH = 0.4  # scale of the hypernetwork's outputs, relative to that of the weights
_DIRECTIONS = 1 << 16  # pairs of directions that the basis is evaluated at, once
_KNOWN = 0.7  # fraction of codes drawn about those of known materials; others are about 0
_SPREAD = 1.5  # largest standard deviation about these: new materials are not just like known ones


def train_hypernetwork(
    materials: Sequence[Callable[[], Brdf]],
    recipe: HypernetworkRecipe,
    checkpoint: Path | None,
    report: Progress,
    base: NeuralBasis | None,
) -> Hypernetwork:
    """The hypernetwork of a neural basis that has examples, or of materials where no basis is
    given.

    The mean absolute difference of log(1 + 30 f cos theta_i) between its networks and what the
    basis has for the same codes is minimized. For parameters and errors see
    :meth:`nacre.latent.basis.LatentBasis.train`.
    """
    if base is None:
        steps = min(recipe.steps, BasisRecipe.steps)
        settings = BasisRecipe(code_dim=recipe.code_dim, steps=steps, seed=recipe.seed)
        state = Store(checkpoint).file("neural") if checkpoint else None
        base = train_neural(materials, settings, state, report)
    if not len(base.examples):
        raise NacreError("a hypernetwork needs a basis with examples")
    training = _Training(base, recipe)
    loss = training.run(checkpoint, report)
    metadata = {**base.metadata, "hypernetwork": asdict(recipe) | {"loss": loss}}
    return Hypernetwork(base, **training.layers(), metadata=metadata)


class _Training:
    def __init__(self, basis: NeuralBasis, recipe: HypernetworkRecipe) -> None:
        self._recipe, self._luma = recipe, basis.luma
        self._known = basis.examples.astype(np.float64)
        self._pairs = basis.chroma
        wi, wo = shared_directions(_DIRECTIONS, recipe.seed)
        self._inputs = torch.from_numpy(isotropic_inputs(wi, wo, PAPER))
        values = basis.values(isotropic_inputs(wi, wo, ENHANCED)).astype(np.float32)
        self._functions = torch.from_numpy(values)
        self._weight = torch.from_numpy(GAIN * wi[:, 2:])
        self._chroma = torch.from_numpy(CHROMA)
        random = np.random.default_rng((recipe.seed, 2))

        seen_of_code, width = self._luma + self._pairs, recipe.width
        self._trunk, self._channel, self._shared, self._output = (
            free_layer(random, rows, columns, 1.0 / math.sqrt(rows))
            for rows, columns in (
                (seen_of_code, width),
                (width + self._pairs, width),
                (self._luma + width, HIDDEN_COUNT),
                (seen_of_code + width, COLUMN),
            )
        )
        # Training begins at one network for all codes, the same in all channels, or nearly.
        start = flat_weights(initial_layers(HIDDEN, recipe.seed))
        self._shared[1].data.copy_(torch.from_numpy(start[:HIDDEN_COUNT]))
        column = start[HIDDEN_COUNT:].reshape(-1, OUTPUTS)[:, 0].copy()
        self._output[1].data.copy_(torch.from_numpy(column))
        for matrix in (self._shared[0], self._output[0]):
            matrix.data.mul_(0.1)

    def run(self, checkpoint: Path | None, report: Progress) -> float:
        sums = self._functions.double().sum().item(), self._known.sum()
        same = f"{tuple(self._functions.shape)} {len(self._known)} {sums}"
        groups = {1.0: [*self._trunk, *self._shared, *self._channel, *self._output]}
        stage = "hypernetwork"
        return descend(groups, self._loss, self._recipe, same, checkpoint, report, stage)

    def _loss(self, step: int) -> Tensor:
        random = np.random.default_rng((self._recipe.seed, 4, step))
        chosen = torch.from_numpy(random.integers(_DIRECTIONS, size=self._recipe.directions))
        near = self._known[random.integers(len(self._known), size=self._recipe.codes)]
        codes = random.normal(size=near.shape) * random.uniform(0.0, _SPREAD, (len(near), 1))
        codes += near * (random.random((len(near), 1)) < _KNOWN)
        luma, pairs = torch.from_numpy(codes.astype(np.float32)).split(
            [self._luma, 2 * self._pairs], dim=1
        )
        pairs = pairs.reshape(len(codes), self._pairs, 2)
        weight = self._weight[chosen]
        with torch.no_grad():
            goal = self._goal(luma, pairs, self._functions[chosen], weight)
        f_r = tensor_reflectance(self._weights(luma, pairs), self._inputs[chosen]) * weight
        # Below 0 the logarithm goes on as it does above.
        return (torch.copysign(f_r.abs().log1p(), f_r) - goal).abs().mean()

    def _goal(self, luma: Tensor, pairs: Tensor, values: Tensor, weight: Tensor) -> Tensor:
        """log(1 + 30 f cos theta_i) of codes in the basis, shape (codes, n, 3)."""
        common, of_luma, of_pairs = values.split([1, self._luma, self._pairs], dim=1)
        logarithms = (common + of_luma @ luma.T).T[..., None]
        logarithms = logarithms + (of_pairs @ pairs @ self._chroma)
        return (logarithms.clamp(max=BRIGHTEST).exp() * weight).log1p()

    def _weights(self, luma: Tensor, pairs: Tensor) -> Tensor:
        """The formula of :class:`Hypernetwork`."""
        lengths = 0.5 * pairs.square().sum(2) - 1.0
        common = dense(torch.cat([luma, lengths], 1), self._trunk, SILU)
        hidden = _scaled(torch.cat([luma, common], 1), self._shared)
        chroma = (pairs @ self._chroma).mT
        luma, common = (a[:, None].expand(-1, OUTPUTS, -1) for a in (luma, common))
        own = dense(torch.cat([common, chroma], 2), self._channel, SILU)
        columns = _scaled(torch.cat([luma, chroma, own], 2), self._output)
        return torch.cat([hidden, columns.mT.reshape(len(hidden), -1)], 1)

    def layers(self) -> dict[str, Layer]:
        return {
            "trunk": finished(self._trunk),
            "shared": finished((_REACH * self._shared[0], self._shared[1])),
            "channel": finished(self._channel),
            "output": finished((_REACH * self._output[0], self._output[1])),
        }


def _scaled(values: Tensor, layer: tuple[Tensor, Tensor]) -> Tensor:
    return _REACH * (values @ layer[0]) + layer[1]
