"""Training of lobe predictors in PyTorch, on the variance that their lobes would have.

No labels are needed: f_r is known for any code, so the second moment of f cos(theta_i) / p under
predicted lobes is (:mod:`nacre.sampling.moment`), and its logarithm is brought to a minimum over
codes of all kinds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.latent.descent import finished, free_layer, torch
from nacre.latent.directions import isotropic_inputs
from nacre.latent.lobe_predictor import LobePredictor
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.latent.recipes import PredictorRecipe
from nacre.neural.inputs import ENHANCED
from nacre.neural.training import schedule
from nacre.numerics.channels import PERMUTATIONS
from nacre.numerics.mlp import TANH, forward
from nacre.runtime.device import one_thread
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.progress import Progress, silent
from nacre.sampling.moment import Pairs, propose, view_pairs
from nacre.sampling.parametrizations import PARAMETRIZATIONS, Parametrization

_STRETCH = -1.0, 2.0  # where between, or beyond, two materials a mixture of theirs lies
_SCALES = 0.5, 2.5  # standard deviations of random codes
_JITTER = 0.2  # standard deviation that is added to every code
_MIN_MOMENT = 1e-3  # of a code that reflects nothing
_AT_ONCE = 32  # codes that are decoded together


def with_predictors(
    basis: NeuralBasis, recipe: PredictorRecipe | None = None, progress: Progress | None = None
) -> NeuralBasis:
    """A basis together with predictors of lobes, trained on its examples.

    Parameters
    ----------
    basis
        Without predictors, or with others.
    recipe
        Settings.
    progress
        Called as it goes on.

    Raises
    ------
    NacreError
        If there are no examples.
    """
    if not len(basis.examples):
        raise NacreError("predictors of lobes need a basis with examples")
    return basis.replaced(predictors=train_predictors(basis, basis.examples, recipe, progress))


def train_predictors(
    basis: NeuralBasis,
    codes: Floats,
    recipe: PredictorRecipe | None = None,
    progress: Progress | None = None,
) -> dict[str, LobePredictor]:
    """A predictor for every kind of sampler, by its name.

    Parameters
    ----------
    basis
        What the codes are for.
    codes
        Of the materials that the basis was trained on, shape (n, k).
    recipe
        Settings.
    progress
        Called as it goes on.

    Raises
    ------
    NacreError
        If codes are not finite.
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
            training = _Training(basis.code_dim, family, recipe)
            for moment in training.run(sets):
                done += 1
                if done % 50 == 0:
                    total = len(PARAMETRIZATIONS) * recipe.steps
                    report("predicting", done, total, f"{name}, second moment {moment:.3f}")
            found[name] = training.predictor(name)
    return found


class _TrainingSet:
    """Floats, and what they reflect in some directions."""

    def __init__(
        self, basis: NeuralBasis, known: Floats, recipe: PredictorRecipe, index: int
    ) -> None:
        random = np.random.default_rng((recipe.seed, 5, index))
        codes = draw_codes(basis, known, -(-recipe.codes // recipe.sets), random)
        proposal = propose(int(random.integers(1 << 31)), recipe.lights).single()
        wi, wo = (w.reshape(-1, 3) for w in (proposal.wi, proposal.wo))
        shape = proposal.density.shape
        weights = np.empty((len(codes), *shape), np.float32)
        with one_blas_thread():
            values = basis.values(isotropic_inputs(wi, wo, ENHANCED))
            for start in range(0, len(codes), _AT_ONCE):
                part = slice(start, start + _AT_ONCE)
                weighted = np.stack([basis.channel_weights(code).T for code in codes[part]])
                logs = np.minimum(weighted.astype(np.float32) @ values.T, BRIGHTEST)
                f_r = np.exp(logs).transpose(0, 2, 1).reshape(-1, *shape, 3)
                weights[part] = proposal.weights(f_r)
        self.codes, self.weights = torch.from_numpy(codes), torch.from_numpy(weights)
        half, view, cosine = view_pairs(proposal.wo, proposal.wi)
        parts = (np.broadcast_to(x, shape) for x in (*half, *view, cosine))
        tensors = [torch.from_numpy(np.array(part, np.float32)) for part in parts]
        self.pairs = Pairs((*tensors[:3],), (*tensors[3:6],), tensors[6])


class _Training:
    """Weights and optimizer state of one predictor."""

    def __init__(self, code_dim: int, family: Parametrization, recipe: PredictorRecipe) -> None:
        self._family, self._recipe = family, recipe
        self._random = np.random.default_rng((recipe.seed, 6))
        self._layers = [
            free_layer(self._random, code_dim, recipe.hidden, code_dim**-0.5),
            free_layer(self._random, recipe.hidden, family.size, 0.1 * recipe.hidden**-0.5),
        ]
        self._adam = torch.optim.Adam([a for layer in self._layers for a in layer])

    def run(self, sets: list[_TrainingSet]) -> Iterator[float]:
        """All steps; each gives the geometric mean of its second moments.

        Raises
        ------
        NacreError
            If one is not finite.
        """
        recipe = self._recipe
        for rate in schedule(recipe.steps, recipe.learning_rate):
            self._adam.param_groups[0]["lr"] = float(rate)
            given = sets[self._random.integers(len(sets))]
            chosen = torch.from_numpy(self._random.integers(len(given.codes), size=recipe.batch))
            free = forward(given.codes[chosen], self._layers, TANH)
            density = self._family.density(free, given.pairs)
            moments = (given.weights[chosen] / density).sum((-1, -2))
            loss = moments.clamp(min=_MIN_MOMENT).log().mean()
            self._adam.zero_grad()
            loss.backward()
            self._adam.step()
            moment = math.exp(loss.item())
            if not math.isfinite(moment):
                raise NacreError("training of lobe predictors: the variance is not finite")
            yield moment

    def predictor(self, name: str) -> LobePredictor:
        """What came of it."""
        return LobePredictor(name, [finished(layer) for layer in self._layers])


def draw_codes(
    basis: NeuralBasis, codes: Floats, count: int, random: np.random.Generator
) -> npt.NDArray[np.float32]:
    """Floats to train on, shape (count, k).

    Two fifths are those of materials, two fifths are mixtures of two, the others are normally
    distributed. Channels of materials change places.
    """

    def materials() -> Floats:
        chosen = codes[random.integers(len(codes), size=count)]
        return basis.permuted(chosen, random.integers(len(PERMUTATIONS), size=count))

    one, other = materials(), materials()
    fraction = random.uniform(*_STRETCH, (count, 1))
    shape = one.shape
    kind = random.choice(3, (count, 1), p=(0.4, 0.4, 0.2))
    normal = random.uniform(*_SCALES, (count, 1)) * random.normal(size=shape)
    mixed = fraction * one + (1.0 - fraction) * other
    chosen = np.select([kind == 0, kind == 1], [one, mixed], normal)
    return (chosen + _JITTER * random.normal(size=shape)).astype(np.float32)
