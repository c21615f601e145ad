"""Training of the autoencoder of the NBRDF paper, in PyTorch.

The loss compares pictures: spheres under directional lights of the networks that come out and of
those that go in, after a gamma curve. Networks are those of the materials, all fitted from one, and
of geometric means of two materials, without which the encoder knows the few materials by heart; all
of them with permuted channels.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.descent import descend
from nacre.latent.directions import isotropic_inputs, sampled
from nacre.latent.distillation import Distillation
from nacre.latent.recipes import AutoencoderRecipe
from nacre.latent.weight_networks import reflectance
from nacre.latent.weights import COUNT, SHAPES
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import OUTPUTS
from nacre.neural.training import schedule
from nacre.numerics.mlp import Layer
from nacre.runtime.progress import Progress, silent

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any
Floats = npt.NDArray[np.float32]

_GAMMA, _DARKEST = 2.2, 1e-12
"""Of the tone curve, and the value below which it is clamped."""
_STEEPEST = 0.3
"""Bound of the norm of a gradient: the curve is all but vertical where it is dark."""


def train_autoencoder(
    materials: Sequence[Callable[[], Brdf]],
    pixels: tuple[Floats, Floats],
    recipe: AutoencoderRecipe | None = None,
    *,
    checkpoint: Path | None = None,
    progress: Progress | None = None,
) -> Autoencoder:
    """An autoencoder of materials.

    Parameters
    ----------
    materials
        Functions that give the materials, isotropic; called once each.
    pixels
        Directions to the light and to the viewer at the pixels of the pictures, shapes (n, 3);
        see :func:`nacre.render.sphere.lit_pixels`.
    recipe
        Settings.
    checkpoint
        File for the state of the training, from which a later call goes on. It stays, for the
        caller to remove once the autoencoder is saved.
    progress
        Called as it goes on.

    Raises
    ------
    FormatError
        If a material is anisotropic.
    NacreError
        If there are fewer than two materials, one is known at none of the directions, training
        diverges, or the checkpoint is of another training or damaged.
    """
    recipe = recipe or AutoencoderRecipe()
    if len(materials) < 2:
        raise NacreError("an autoencoder needs two materials or more")
    report = progress or silent
    distillation = Distillation(recipe.seed)
    values, names = sampled(materials, distillation.wi, distillation.wo, report)
    common = distillation.common(values)
    networks = distillation.networks(common, values, recipe.mixtures, report)
    training = _Training(networks, pixels, recipe)
    loss = training.run(checkpoint, report)
    metadata = {"materials": names, "loss": loss, "training": asdict(recipe)}
    return training.autoencoder(common, metadata)


class _Training:
    """The layers and the state of the optimizer."""

    def __init__(
        self, weights: Floats, pixels: tuple[Floats, Floats], recipe: AutoencoderRecipe
    ) -> None:
        self._recipe = recipe
        orders = list(itertools.permutations(range(OUTPUTS)))
        networks = np.stack([permuted(weights, order) for order in orders], axis=1)
        self._centre = networks.mean(axis=(0, 1))
        self._scale = _spreads(networks.reshape(-1, COUNT).std(axis=0))
        self._networks = torch.from_numpy((networks - self._centre) / self._scale)
        wi, wo = pixels
        self._inputs = torch.from_numpy(isotropic_inputs(wi, wo, PAPER))
        self._cosine = torch.from_numpy(math.pi * wi[:, 2:])
        random = np.random.default_rng((recipe.seed, 2))

        def layer(rows: int, columns: int, scale: float) -> tuple[Tensor, Tensor]:
            matrix = random.normal(0.0, scale / math.sqrt(rows), (rows, columns))
            parts = (matrix.astype(np.float32), np.zeros(columns, np.float32))
            matrix, biases = (torch.from_numpy(p).requires_grad_() for p in parts)
            return matrix, biases

        self._contract = layer(COUNT, recipe.width, 1.0)
        self._code = layer(recipe.width, recipe.values, 1.0)
        self._expand = layer(recipe.values, recipe.width, math.sqrt(2.0))
        self._network = layer(recipe.width, COUNT, 0.3)
        self._parameters = [*self._contract, *self._code, *self._expand, *self._network]
        group = {"params": self._parameters, "factor": 1.0}
        self._adam = torch.optim.Adam([group], betas=(0.9, 0.99))
        for parameter in self._parameters:
            parameter.register_hook(_bounded)

    def run(self, checkpoint: Path | None, report: Progress) -> float:
        """All steps that are left; gives the last loss."""
        rates = schedule(self._recipe.steps, self._recipe.learning_rate)
        sums = self._networks.double().sum().item(), self._inputs.double().sum().item()
        mark = f"{self._recipe} {tuple(self._networks.shape)} {sums}"
        return descend(self._adam, self._loss, rates, mark, checkpoint, report)

    def _loss(self, step: int) -> Tensor:
        recipe, random = self._recipe, np.random.default_rng((self._recipe.seed, 4, step))
        chosen = random.permutation(len(self._networks))[: recipe.networks]
        networks = self._networks[chosen, random.integers(6, size=len(chosen))]
        pixels = torch.from_numpy(random.integers(len(self._inputs), size=recipe.pixels))
        with torch.no_grad():
            goal = self._pictures(networks, pixels)
        return (self._pictures(self._decoded(self._codes(networks)), pixels) - goal).square().mean()

    def _pictures(self, networks: Tensor, pixels: Tensor) -> Tensor:
        """Values of display of networks at some pixels, shape (networks, n, 3)."""
        weights = networks * torch.from_numpy(self._scale) + torch.from_numpy(self._centre)
        radiance = reflectance(weights, self._inputs[pixels]) * self._cosine[pixels]
        return radiance.clamp(min=_DARKEST).pow(1.0 / _GAMMA)

    def _codes(self, networks: Tensor) -> Tensor:
        bent = torch.nn.functional.silu(networks @ self._contract[0] + self._contract[1])
        return bent @ self._code[0] + self._code[1]

    def _decoded(self, codes: Tensor) -> Tensor:
        bent = torch.nn.functional.silu(codes @ self._expand[0] + self._expand[1])
        return bent @ self._network[0] + self._network[1]

    def autoencoder(self, common: Floats, metadata: dict[str, Any]) -> Autoencoder:
        """The autoencoder, for plain weights and codes of mean 0 and variance 1."""
        with torch.no_grad():
            codes = self._codes(self._networks.reshape(-1, COUNT)).double().numpy()
        mean, deviation = codes.mean(axis=0), np.maximum(codes.std(axis=0), 1e-6)
        contract, code, expand, network = (
            [p.detach().double().numpy() for p in layer]
            for layer in (self._contract, self._code, self._expand, self._network)
        )
        centre, scale = (a.astype(np.float64) for a in (self._centre, self._scale))
        first = contract[0] / scale[:, None]
        return Autoencoder(
            common,
            Layer(first, contract[1] - centre @ first),
            Layer(code[0] / deviation, (code[1] - mean) / deviation),
            Layer(deviation[:, None] * expand[0], expand[1] + mean @ expand[0]),
            Layer(network[0] * scale, network[1] * scale + centre),
            self._recipe.seed,
            metadata,
        )


def permuted(weights: Floats, order: Sequence[int]) -> Floats:
    """Networks whose channels are those of others in some order, shape (n, 675)."""
    rows, columns = SHAPES[-1]
    last = (rows + 1) * columns
    outputs = weights[:, -last:].reshape(len(weights), rows + 1, columns)[:, :, list(order)]
    return np.concatenate([weights[:, :-last], outputs.reshape(len(weights), last)], axis=1)


def _spreads(deviations: Floats) -> Floats:
    """For every weight the root mean square deviation of those of its kind and layer."""
    parts, start = [], 0
    for rows, columns in SHAPES:
        for size in (rows * columns, columns):
            part = deviations[start : start + size]
            parts.append(np.full(size, math.sqrt(np.square(part).mean()) + 1e-6, np.float32))
            start += size
    return np.concatenate(parts)


def _bounded(gradient: Tensor) -> Tensor:
    """A gradient of norm _STEEPEST at most."""
    return gradient * (_STEEPEST / gradient.norm().clamp(min=_STEEPEST))
