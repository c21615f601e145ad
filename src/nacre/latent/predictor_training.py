"""Training of lobe predictors in PyTorch.

By variance: f_r is known for any code, and so is the second moment of f cos(theta_i) / p under
predicted lobes (:mod:`nacre.sampling.moment`); its logarithm is minimized over codes of all kinds.
Or by labels, the NBRDF paper's way (section 3.3): lobes of models that are fitted to the training
materials, with the squared error of their parameters.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import numpy as np

from nacre.array import Floats, Weights
from nacre.brdf import Sampler
from nacre.errors import NacreError
from nacre.latent.descent import Tensor, finished, free_layer, torch
from nacre.latent.lobe_predictor import LobePredictor
from nacre.latent.predicting import BY_LABELS, PredictingBasis
from nacre.latent.recipes import PredictorRecipe
from nacre.neural.training import schedule
from nacre.numerics.mlp import TANH, forward
from nacre.runtime.device import one_thread
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.sampling.mixture_parameters import logistic
from nacre.sampling.moment import Pairs, propose, view_pairs
from nacre.sampling.parametrizations import PARAMETRIZATIONS, Parametrization, find_parametrization

Basis = TypeVar("Basis", bound=PredictingBasis)

_STRETCH = -1.0, 2.0  # where between, or beyond, two materials a mixture of theirs lies
_SCALES = 0.5, 2.5  # standard deviations of random codes
_JITTER = 0.2  # standard deviation that is added to every code
_MIN_MOMENT = 1e-3  # of a code that reflects nothing
_AT_ONCE = 32  # codes that are decoded together


def with_predictors(
    basis: Basis, recipe: PredictorRecipe | None = None, progress: Progress | None = None
) -> Basis:
    """A basis with predictors of lobes, trained by variance on its examples; its predictors with
    other names stay. Raises NacreError if it has no examples.
    """
    codes = _examples(basis).reshape(-1, basis.code_dim)
    found = train_predictors(basis, codes, recipe, progress)
    return basis.replaced(predictors={**basis.predictors, **found})


def with_labels(
    basis: Basis,
    labels: Mapping[str, Sequence[Sampler | None]],
    recipe: PredictorRecipe | None = None,
    progress: Progress | None = None,
) -> Basis:
    """A basis with predictors of lobes that learn from labels; its predictors with other names
    stay.

    `labels` are, by the name of a parametrization, lobes of the basis's examples in their order,
    None for one without a label (see :func:`nacre.analytic.labels.fitted_lobes`). Settings of the
    recipe for variance do not matter.

    Raises NacreError if there are no examples, or no label for a parametrization; ValueError if
    lobes do not fit their parametrization, or there are not as many as examples.
    """
    orders = _examples(basis)
    found = {}
    for name, lobes in labels.items():
        known = [index for index, lobe in enumerate(lobes) if lobe is not None]
        if len(lobes) != len(orders):
            raise ValueError(f"{len(lobes)} labels {name!r} for {len(orders)} examples")
        if not known:
            raise NacreError(f"there are no labels {name!r}")
        family = find_parametrization(name)
        places = np.array([family.places(lobe) for lobe in lobes if lobe is not None])
        training = _LabelTraining(basis.code_dim, family, recipe or PredictorRecipe())
        for done, error in enumerate(training.run(orders[known], places), 1):
            if progress and done % 50 == 0:
                total = training.recipe.steps
                progress("labels", done, total, f"{name}, squared error {error:.4f}")
        found[f"{name}{BY_LABELS}"] = training.predictor(name)
    return basis.replaced(predictors={**basis.predictors, **found})


def _examples(basis: PredictingBasis) -> Floats:
    orders = basis.orders()
    if not len(orders):
        raise NacreError("predictors of lobes need a basis with examples")
    return orders


def train_predictors(
    basis: PredictingBasis,
    codes: Floats,
    recipe: PredictorRecipe | None = None,
    progress: Progress | None = None,
) -> dict[str, LobePredictor]:
    """A predictor for every kind of sampler, by its name; trained on variance.

    `codes` are those of the materials that the basis was trained on, in all orders of the channels,
    shape (n, k). Raises NacreError if they are not finite.
    """
    recipe = recipe or PredictorRecipe()
    report = progress or silent
    with one_thread():
        sets = []
        for index in range(recipe.sets):
            sets.append(_TrainingSet(basis, codes, recipe, index))
            report("decoding", index + 1, recipe.sets, "")
        found, done = {}, 0
        for name, family in PARAMETRIZATIONS.items():
            training = _VarianceTraining(basis.code_dim, family, recipe)
            for moment in training.run(sets):
                done += 1
                if done % 50 == 0:
                    total = len(PARAMETRIZATIONS) * recipe.steps
                    report("predicting", done, total, f"{name}, second moment {moment:.3f}")
            found[name] = training.predictor(name)
    return found


class _TrainingSet:
    """Codes, and what they reflect in some directions."""

    def __init__(
        self, basis: PredictingBasis, known: Floats, recipe: PredictorRecipe, index: int
    ) -> None:
        random = np.random.default_rng((recipe.seed, 5, index))
        codes = draw_codes(known, -(-recipe.codes // recipe.sets), random)
        proposal = propose(int(random.integers(1 << 31)), recipe.lights).single()
        wi, wo = (w.reshape(-1, 3) for w in (proposal.wi, proposal.wo))
        shape = proposal.density.shape
        weights = np.empty((len(codes), *shape), np.float32)
        with one_blas_thread():
            for start in range(0, len(codes), _AT_ONCE):
                part = slice(start, start + _AT_ONCE)
                f_r = basis.reflectances(codes[part], wi, wo).reshape(-1, *shape, 3)
                weights[part] = proposal.weights(f_r)
        self.codes, self.weights = torch.from_numpy(codes), torch.from_numpy(weights)
        half, view, cosine = view_pairs(proposal.wo, proposal.wi)
        parts = (np.broadcast_to(x, shape) for x in (*half, *view, cosine))
        tensors = [torch.from_numpy(np.array(part, np.float32)) for part in parts]
        self.pairs = Pairs((*tensors[:3],), (*tensors[3:6],), tensors[6])


class _Training:
    def __init__(self, code_dim: int, family: Parametrization, recipe: PredictorRecipe) -> None:
        self._family, self.recipe = family, recipe
        self._random = np.random.default_rng((recipe.seed, 6))
        self._layers = [
            free_layer(self._random, code_dim, recipe.hidden, code_dim**-0.5),
            free_layer(self._random, recipe.hidden, family.size, 0.1 * recipe.hidden**-0.5),
        ]
        self._adam = torch.optim.Adam([a for layer in self._layers for a in layer])

    def _step(self, rate: float, loss: Tensor) -> float:
        """Take one step; returns the loss, or raises NacreError if it is not finite."""
        self._adam.param_groups[0]["lr"] = float(rate)
        self._adam.zero_grad()
        loss.backward()
        self._adam.step()
        value = float(loss.item())
        if not math.isfinite(value):
            raise NacreError("training of lobe predictors: the loss is not finite")
        return value

    def predictor(self, name: str) -> LobePredictor:
        return LobePredictor(name, [finished(layer) for layer in self._layers])


class _VarianceTraining(_Training):
    """Training by the second moments of what is sampled."""

    def run(self, sets: list[_TrainingSet]) -> Iterator[float]:
        """Take all steps; each yields the geometric mean of its second moments."""
        for rate in schedule(self.recipe.steps, self.recipe.learning_rate):
            given = sets[self._random.integers(len(sets))]
            drawn = self._random.integers(len(given.codes), size=self.recipe.batch)
            chosen = torch.from_numpy(drawn)
            free = forward(given.codes[chosen], self._layers, TANH)
            density = self._family.density(free, given.pairs)
            moments = (given.weights[chosen] / density).sum((-1, -2))
            yield math.exp(self._step(rate, moments.clamp(min=_MIN_MOMENT).log().mean()))


class _LabelTraining(_Training):
    """Training by the places of parameters between their bounds."""

    def run(self, orders: Floats, places: Floats) -> Iterator[float]:
        """Take all steps; each yields its mean squared error.

        `orders` are codes of materials in all orders of their channels, shape (m, 6, k), `places`
        those of their parameters, (m, size).
        """
        targets = torch.from_numpy(places.astype(np.float32))
        with one_thread():
            for rate in schedule(self.recipe.steps, self.recipe.learning_rate):
                chosen = self._random.integers(len(orders), size=self.recipe.batch)
                order = self._random.integers(orders.shape[1], size=self.recipe.batch)
                codes = orders[chosen, order]
                codes = codes + _JITTER * self._random.normal(size=codes.shape)
                free = forward(torch.from_numpy(codes.astype(np.float32)), self._layers, TANH)
                yield self._step(rate, (logistic(free) - targets[chosen]).square().mean())


def draw_codes(codes: Floats, count: int, random: np.random.Generator) -> Weights:
    """Codes to train on, shape (count, k), from those of materials, shape (n, k).

    Two fifths are of materials, two fifths mix two materials, the rest are normally distributed.
    """
    one, other = (codes[random.integers(len(codes), size=count)] for _ in range(2))
    fraction = random.uniform(*_STRETCH, (count, 1))
    shape = one.shape
    kind = random.choice(3, (count, 1), p=(0.4, 0.4, 0.2))
    normal = random.uniform(*_SCALES, (count, 1)) * random.normal(size=shape)
    mixed = fraction * one + (1.0 - fraction) * other
    chosen = np.select([kind == 0, kind == 1], [one, mixed], normal)
    return (chosen + _JITTER * random.normal(size=shape)).astype(np.float32)
