"""Training of the set encoder, in PyTorch.

The loss is that of the paper: squared differences of relative values times the cosine, and small
weights for the code and for the generated weights. Ours are: samples as few as they will be, from
:data:`FEWEST` to :data:`MOST`; mixtures of two materials and permutations of the channels, without
which 64 materials are soon known by heart; and the schedule of the learning rate.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.latent.descent import descend, finished, free, torch
from nacre.latent.directions import isotropic_inputs, isotropic_values, shared_directions
from nacre.latent.recipes import BasisRecipe
from nacre.measured.merl import Resolution, tabulate
from nacre.measured.merl_table import MerlBrdf
from nacre.neural.inputs import PAPER
from nacre.numerics.channels import PERMUTATIONS
from nacre.numerics.mlp import flat_weights, forward
from nacre.runtime.progress import Progress
from nacre_lab.reproduce.cache import Cache, cache_key, module_digest
from nacre_lab.sparse.set_encoder import (
    CODE,
    SHIFT,
    SIZES,
    SetEncoder,
    embedded,
    generated,
    shapes,
)

RECIPE = BasisRecipe(
    *(CODE, SIZES[1:-1], 8_000, 1 << 15),
    batch=256,
    learning_rate=5e-4,
    predictors=False,
)
"""The recommended settings: `batch` is the number of directions at which a step compares each of
:data:`MATERIALS`."""
MATERIALS = 8
FEWEST, MOST = 4, 400
MIXED = 0.5
"""Fraction of the materials of a step that are mixtures of two."""
RESOLUTION = Resolution(90, 45, 45)
"""Of the table of the median."""
CODE_WEIGHT = WEIGHTS_WEIGHT = 1e-4

_LAST = 0.01  # of hypernetworks' last weights beside those of other layers


class MedianBrdf(Brdf):
    """The median of isotropic materials, by channel."""

    isotropy_known = True
    traceable = False

    def __init__(self, materials: Sequence[Brdf]) -> None:
        super().__init__(name="median")
        self._materials = materials

    def eval_components(self, wi: Any, wo: Any) -> Any:
        light, view = (np.stack(np.broadcast_arrays(*w), axis=-1) for w in (wi, wo))
        light, view = light.astype(np.float32), view.astype(np.float32)
        found = np.median([brdf.eval(light, view) for brdf in self._materials], axis=0)
        return tuple(np.moveaxis(found, -1, 0))


def train(
    materials: Sequence[Brdf],
    recipe: BasisRecipe,
    checkpoint: Path | None,
    report: Progress,
) -> tuple[Weights, MerlBrdf]:
    """Weights as :meth:`SetEncoder.from_weights` takes them, and the median of the materials.

    A training that was stopped goes on from the checkpoint.

    Raises
    ------
    NacreError
        If there are fewer than two materials, one is anisotropic, or the training diverges.
    """
    if len(materials) < 2:
        raise NacreError("a set encoder needs two materials or more")
    wi, wo = shared_directions(recipe.directions, recipe.seed)
    values = np.stack([isotropic_values(brdf, wi, wo) for brdf in materials])
    reference = tabulate(MedianBrdf(materials), RESOLUTION)
    training = _Training(wi, wo, values, reference, recipe)
    groups = {1.0: training.parameters}
    same = f"{values.sum(dtype=float)!r}"
    descend(groups, training.loss, recipe, same, checkpoint, report)
    return training.weights(), reference


def set_encoder(
    paths: Sequence[Path], recipe: BasisRecipe, cache: Cache, report: Progress
) -> SetEncoder:
    """The set encoder of materials in files, trained if it is not in the cache, which also keeps
    the state of a stopped training.
    """
    facts = [[digest(path) for path in paths], asdict(recipe), module_digest("sparse/set_*.py")]
    key = cache_key("set-encoder", facts)

    def make() -> dict[str, Weights]:
        state = cache.path(key, ".state")
        cache.folder.mkdir(parents=True, exist_ok=True)
        weights, median = train([load_brdf(path) for path in paths], recipe, state, report)
        state.unlink(missing_ok=True)
        return {"weights": weights, "median": median.stored}

    found = cache.arrays(key, ("weights", "median"), make)
    return SetEncoder.from_weights(found["weights"], MerlBrdf(found["median"]))


class _Training:
    def __init__(
        self, wi: Weights, wo: Weights, f_r: Weights, reference: MerlBrdf, recipe: BasisRecipe
    ) -> None:
        self._recipe, self._f_r = recipe, torch.from_numpy(np.maximum(f_r, 0.0))
        self._inputs = torch.from_numpy(isotropic_inputs(wi, wo, PAPER))
        self._cosine = torch.from_numpy(wi[:, 2:])
        self._reference = torch.from_numpy(reference.eval(wi, wo) + np.float32(SHIFT))
        random = np.random.default_rng((recipe.seed, 2))

        def layer(shape: tuple[int, int], scale: float = 1.0) -> tuple[Any, Any]:
            weights = random.normal(0.0, scale * math.sqrt(2.0 / shape[0]), shape)
            return free(weights), free(np.zeros(shape[1]))

        encoder, hyper = shapes()
        self._encoder = [layer(shape) for shape in encoder]
        self._hyper = []
        for shape_of, (n, m) in zip(hyper, itertools.pairwise(SIZES), strict=True):
            layers = [*map(layer, shape_of[:-1]), layer(shape_of[-1], _LAST)]
            start = random.normal(0.0, math.sqrt(2.0 / n), n * m).astype(np.float32)
            layers[-1][1].data[: n * m] = torch.from_numpy(start)
            self._hyper.append(layers)

    @property
    def _layers(self) -> list[tuple[Any, Any]]:
        return [*self._encoder, *itertools.chain(*self._hyper)]

    @property
    def parameters(self) -> list[Any]:
        return list(itertools.chain(*self._layers))

    def weights(self) -> Weights:
        return flat_weights([finished(layer) for layer in self._layers])

    def _drawn(self, random: np.random.Generator, pairs: Any) -> Any:
        """Relative values of some materials at some pairs, shape (MATERIALS, pairs, 3)."""
        count = len(self._f_r)
        one, other = torch.from_numpy(random.integers(count, size=(2, MATERIALS)))
        part = random.uniform(size=MATERIALS) * (random.uniform(size=MATERIALS) < MIXED)
        part = torch.from_numpy(part.astype(np.float32))[:, None, None]
        f_r = torch.lerp(self._f_r[one[:, None], pairs], self._f_r[other[:, None], pairs], part)
        order = torch.from_numpy(PERMUTATIONS[random.integers(len(PERMUTATIONS), size=MATERIALS)])
        f_r = torch.gather(f_r, 2, order[:, None].expand(f_r.shape))
        return torch.log1p((f_r + SHIFT) / self._reference[pairs])

    def loss(self, step: int) -> Any:
        random = np.random.default_rng((self._recipe.seed, 4, step))
        few = round(math.exp(random.uniform(math.log(FEWEST), math.log(MOST))))
        pairs = random.integers(len(self._inputs), size=few + self._recipe.batch)
        pairs = torch.from_numpy(pairs)
        truth, inputs = self._drawn(random, pairs), self._inputs[pairs].expand(MATERIALS, -1, -1)
        known = torch.cat([inputs, truth], dim=2)[:, :few]
        codes = embedded(known.reshape(-1, known.shape[2]), self._encoder)
        codes = codes.reshape(MATERIALS, few, -1).mean(dim=1)
        layers = generated(codes, self._hyper)
        missed = forward(inputs[:, few:].contiguous(), layers) - truth[:, few:]
        error = (self._cosine[pairs[few:]] * missed).square().mean()
        squares = sum(part.square().sum() for layer in layers for part in layer)
        count = sum(part.numel() for layer in layers for part in layer)
        return error + CODE_WEIGHT * codes.square().mean() + WEIGHTS_WEIGHT * squares / count
