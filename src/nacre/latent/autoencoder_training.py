"""Training of the autoencoder of the NBRDF paper, in PyTorch.

The loss compares pictures: spheres under directional lights, of the networks that come out and of
those that go in, after a gamma curve. Networks are those of the materials, all fitted from one, and
those of mixtures, without which the encoder knows the few materials by heart; all of them with
permuted channels, and mixed once more as networks. The encoder sees changes of weights by how far
they move f_r, not by their size.

At the end, a shallow network predicts parameters of a Blinn-Phong or GGX lobe from a code (NBRDF
paper, section 3.3 and Figure 4).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from nacre.analytic import labels
from nacre.array import Doubles, Weights
from nacre.brdf import Brdf, Sampler
from nacre.color import GAMMA
from nacre.errors import NacreError
from nacre.latent.autoencoder import Autoencoder
from nacre.latent.descent import Tensor, descend, free_layer, torch
from nacre.latent.directions import isotropic_inputs, sampled
from nacre.latent.distillation import Distillation
from nacre.latent.predictor_training import with_labels, with_predictors
from nacre.latent.recipes import AutoencoderRecipe, PredictorRecipe
from nacre.latent.weights import (
    COUNT,
    SHAPES,
    network_layers,
    permuted,
    sensitivity,
    tensor_reflectance,
)
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import OUTPUTS, NeuralBrdf
from nacre.numerics.mlp import SILU, Layer, forward
from nacre.runtime.parallel import thread_map
from nacre.runtime.progress import Progress

_DARKEST = 1e-12  # value below which pictures are clamped
_EDGE, _ANGLES = 64, (10.0, 30.0, 45.0, 60.0, 80.0, 100.0, 120.0)
"""Pixels along an edge of a picture, and degrees off the view of the lights (NBRDF paper, 3.2): one
light alone would show one angle theta_d only."""
_WEIGHED, _DIRECTIONS = 32, 512  # networks and pairs of directions that weigh changes of weights
_MAX_NORM = 0.3  # bound of the norm of a gradient: the curve is all but vertical where it is dark


def train_autoencoder(
    materials: Sequence[Callable[[], Brdf]],
    recipe: AutoencoderRecipe,
    checkpoint: Path | None,
    report: Progress,
) -> Autoencoder:
    """An autoencoder of materials; see :meth:`nacre.latent.basis.LatentBasis.train`."""
    if len(materials) < 2:
        raise NacreError("an autoencoder needs two materials or more")
    distillation = Distillation(recipe.seed)
    values, names = sampled(materials, distillation.wi, distillation.wo, report)
    common = distillation.common(values)
    networks = distillation.networks(common, values, recipe.mixtures, report)
    metric = sensitivity(
        networks[: len(values)][:_WEIGHED],
        distillation.wi[:_DIRECTIONS],
        distillation.wo[:_DIRECTIONS],
    )
    training = _Training(networks, metric, lit_pixels(), recipe)
    loss = training.run(checkpoint, report)
    metadata = {"materials": names, "loss": loss, "training": asdict(recipe)}
    autoencoder = training.autoencoder(common, metadata)
    orders = [
        permuted(networks[: len(values)], order) for order in itertools.permutations(range(OUTPUTS))
    ]
    return _predicting(autoencoder, np.stack(orders, axis=1), recipe, report)


def _predicting(
    autoencoder: Autoencoder, orders: Weights, recipe: AutoencoderRecipe, report: Progress
) -> Autoencoder:
    """An autoencoder that knows codes of its training materials and, unless the recipe says
    otherwise, predicts lobes from codes, by variance and by labels
    (:mod:`nacre.latent.predictor_training`).

    `orders` are networks of the training materials with their channels in all orders, the
    material's own first, shape (m, 6, 675). Labels are fitted to the first.
    """
    codes = autoencoder.codes(orders.reshape(-1, COUNT)).reshape(*orders.shape[:2], -1)
    known = autoencoder.replaced(examples=codes.astype(np.float32))
    if not recipe.predictors:
        return known
    settings = PredictorRecipe(steps=min(recipe.steps, PredictorRecipe.steps), seed=recipe.seed)
    found = with_predictors(known, settings, report)
    return with_labels(found, _labels(orders[:, 0], recipe.seed, report), settings, report)


def _labels(networks: Weights, seed: int, report: Progress) -> dict[str, list[Sampler]]:
    """Lobes of models fitted to networks (m, 675), by family."""
    found: dict[str, list[Sampler]] = {family: [] for family in labels.MODELS}
    total = len(found) * len(networks)

    def fitted(pair: tuple[str, Weights]) -> Sampler:
        family, weights = pair
        return labels.fitted_lobes(NeuralBrdf(network_layers(weights)), family, seed)

    pairs = [(family, weights) for family in found for weights in networks]
    for done, ((family, _), lobes) in enumerate(
        zip(pairs, thread_map(fitted, pairs), strict=True), 1
    ):
        found[family].append(lobes)
        report("models", done, total, family)
    return found


class _Training:
    def __init__(
        self,
        weights: Weights,
        metric: Doubles,
        pixels: tuple[Weights, Weights],
        recipe: AutoencoderRecipe,
    ) -> None:
        self._recipe = recipe
        permutations = list(itertools.permutations(range(OUTPUTS)))
        networks = np.stack([permuted(weights, p) for p in permutations], axis=1)
        self._center = networks.mean(axis=(0, 1))
        self._scale = _deviations(networks.reshape(-1, COUNT).std(axis=0))
        self._root = _root(metric)
        seen = (networks - self._center) @ self._root
        size = math.sqrt(np.square(seen).mean()) + 1e-12
        self._root /= size
        self._networks = torch.from_numpy(networks)
        self._seen = torch.from_numpy(seen / size)
        wi, wo = pixels
        self._inputs = torch.from_numpy(isotropic_inputs(wi, wo, PAPER))
        self._cosine = torch.from_numpy(math.pi * wi[:, 2:])
        random = np.random.default_rng((recipe.seed, 2))
        sizes = itertools.pairwise((COUNT, recipe.width, recipe.code_dim, recipe.width, COUNT))
        scales = 1.0, 1.0, math.sqrt(2.0), 0.3
        self._layers = [
            free_layer(random, rows, columns, scale / math.sqrt(rows))
            for (rows, columns), scale in zip(sizes, scales, strict=True)
        ]
        self._parameters = [parameter for layer in self._layers for parameter in layer]
        for parameter in self._parameters:
            parameter.register_hook(_bounded)

    def run(self, checkpoint: Path | None, report: Progress) -> float:
        """Take all steps that are left; returns the last loss."""
        sums = self._networks.double().sum().item(), self._inputs.double().sum().item()
        same = f"{tuple(self._networks.shape)} {sums}"
        groups = {1.0: self._parameters}
        return descend(groups, self._loss, self._recipe, same, checkpoint, report)

    def _loss(self, step: int) -> Tensor:
        """The loss on networks anywhere between two: all keep the common one's neurons, so these
        too are networks of materials, and there is no end of them.
        """
        recipe, random = self._recipe, np.random.default_rng((self._recipe.seed, 4, step))
        chosen = random.permutation(len(self._networks))[: recipe.networks]
        picked = chosen, random.integers(6, size=len(chosen))
        others, fractions = random.permutation(len(chosen)), random.random((len(chosen), 1))
        networks, seen = (
            torch.lerp(both[picked], both[picked][others], torch.from_numpy(np.float32(fractions)))
            for both in (self._networks, self._seen)
        )
        pixels = torch.from_numpy(random.integers(len(self._inputs), size=recipe.pixels))
        with torch.no_grad():
            goal = self._pictures(networks, pixels)
        decoded = self._decoded(self._codes(seen))
        return (self._pictures(decoded, pixels) - goal).square().mean()

    def _pictures(self, networks: Tensor, pixels: Tensor) -> Tensor:
        """Values of display of networks at some pixels, shape (networks, n, 3)."""
        radiance = tensor_reflectance(networks, self._inputs[pixels]) * self._cosine[pixels]
        return radiance.clamp(min=_DARKEST).pow(1.0 / GAMMA)

    def _codes(self, seen: Tensor) -> Tensor:
        return forward(seen, self._layers[:2], SILU)

    def _decoded(self, codes: Tensor) -> Tensor:
        values = forward(codes, self._layers[2:], SILU)
        return values * torch.from_numpy(self._scale) + torch.from_numpy(self._center)

    def autoencoder(self, common: Weights, metadata: dict[str, Any]) -> Autoencoder:
        """The autoencoder, for plain weights and codes of mean 0 and variance 1."""
        with torch.no_grad():
            codes = self._codes(self._seen.reshape(-1, COUNT)).double().numpy()
        mean, deviation = codes.mean(axis=0), np.maximum(codes.std(axis=0), 1e-6)
        contract, code, expand, network = (
            [p.detach().double().numpy() for p in layer] for layer in self._layers
        )
        center, root, scale = (
            a.astype(np.float64) for a in (self._center, self._root, self._scale)
        )
        first = root @ contract[0]
        return Autoencoder(
            common,
            Layer(first, contract[1] - center @ first),
            Layer(code[0] / deviation, (code[1] - mean) / deviation),
            Layer(deviation[:, None] * expand[0], expand[1] + mean @ expand[0]),
            Layer(network[0] * scale, network[1] * scale + center),
            self._recipe.seed,
            metadata,
        )


def lit_pixels() -> tuple[Weights, Weights]:
    """Directions to the light and to the viewer at the pixels of spheres, shapes (n, 3), each lit
    by one light from the upper left.
    """
    axis = (np.arange(_EDGE) + 0.5) * 2.0 / _EDGE - 1.0
    x, y = (part.ravel() for part in np.meshgrid(axis, -axis))
    inside = x * x + y * y < 1.0
    x, y = x[inside], y[inside]
    z = np.sqrt(1.0 - x * x - y * y)
    # Rows are tangent, bitangent and normal; the materials do not mind how these two are rotated.
    tangent = np.stack([z, np.zeros_like(x), -x], axis=-1) / np.hypot(x, z)[:, None]
    normal = np.stack([x, y, z], axis=-1)
    frames = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)
    aside = [math.sqrt(0.5) * math.sin(angle) for angle in np.deg2rad(_ANGLES)]
    lights = [(-a, a, math.cos(angle)) for a, angle in zip(aside, np.deg2rad(_ANGLES), strict=True)]
    wi = np.concatenate([frames @ light for light in lights]).astype(np.float32)
    wo = np.tile(frames[:, :, 2], (len(lights), 1)).astype(np.float32)
    lit = wi[:, 2] > 0.0
    return wi[lit], wo[lit]


def _root(metric: Doubles) -> Weights:
    """R, shape (675, 675), float32, with R R^T = M: the squared length of d R is d M d."""
    values, vectors = np.linalg.eigh(metric)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), np.float32)


def _deviations(deviations: Weights) -> Weights:
    """Root mean square deviations of the weights of the same kind and layer, for every weight."""
    parts, start = [], 0
    for rows, columns in SHAPES:
        for size in (rows * columns, columns):
            part = deviations[start : start + size]
            parts.append(np.full(size, math.sqrt(np.square(part).mean()) + 1e-6, np.float32))
            start += size
    return np.concatenate(parts)


def _bounded(gradient: Tensor) -> Tensor:
    return gradient * (_MAX_NORM / gradient.norm().clamp(min=_MAX_NORM))
