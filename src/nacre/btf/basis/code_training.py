"""Codes of the default codec: an autoencoder over coefficients, and what it errs by."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.btf.basis.coefficients import TrainingTexels
from nacre.btf.basis.functions import FunctionValues
from nacre.btf.basis.network_training import SkipTraining, Tensor, descend, torch
from nacre.btf.basis.posterior import Observation, Prior
from nacre.btf.basis.recipe import BasisRecipe
from nacre.btf.basis.skip_network import SkipNetwork
from nacre.channels import TURNS
from nacre.progress import Progress

_BATCH = 256
"""Texels of each subset of directions in a step."""
_SUBSETS = 3
"""In a step, beside all directions."""
_WHOLE = 3.0
"""Weight of errors of codes from all directions; 1 of those from a subset."""
_MIXED = 0.5
"""Share of texels that are mixed with another."""
_CAUTION = 20.0
"""Times that noise counts where coefficients override a guess: unlike noise, what the functions
cannot express is alike at neighbouring directions."""


def train_codes(
    data: TrainingTexels, functions: FunctionValues, recipe: BasisRecipe, report: Progress
) -> tuple[SkipNetwork, SkipNetwork, Prior]:
    """The networks from coefficients to codes and back, and the prior.

    Parameters
    ----------
    data
        Coefficients of texels, from all directions and from subsets.
    functions
        At all directions, over which they are orthonormal.
    recipe
        Sizes and efforts.
    report
        Called as it goes on.
    """
    values, residuals = torch.from_numpy(data.values), torch.from_numpy(data.residuals)
    prior = _first_prior(data)
    estimates, known = _estimates(data, functions, prior)
    seen = torch.from_numpy(estimates / prior.deviations)
    shares = torch.from_numpy(known)
    orders = torch.from_numpy(_orders_of_channels(functions))
    scale = torch.from_numpy(prior.deviations)
    generator = torch.Generator().manual_seed(recipe.seed)
    forward, back = _linear_start(data, prior.deviations, recipe.values)
    count = values.shape[1]
    encode = SkipTraining(forward, recipe.hidden, generator, inputs=2 * count)
    decode = SkipTraining(back, recipe.hidden, generator)

    def draw(limit: int, shape: tuple[int, ...]) -> Tensor:
        return torch.randint(limit, shape, generator=generator)

    def loss(_step: int) -> Tensor:
        """Mean over texels of root mean square errors of reflectance factors."""
        total = 0.0
        subsets = [0, *draw(len(seen), (_SUBSETS,)).tolist()]
        for subset, order in zip(subsets, orders[draw(len(orders), (4,))], strict=True):
            one, other = draw(len(values), (2, _BATCH))
            share = torch.rand(_BATCH, 1, generator=generator)
            share *= torch.rand(_BATCH, 1, generator=generator) < _MIXED
            wanted = torch.lerp(values[one], values[other], share) @ order
            given = torch.lerp(seen[subset, one], seen[subset, other], share) * scale @ order
            # What the functions leave of two texels is taken to be independent.
            left = residuals[one] * (1 - share[:, 0]) ** 2 + residuals[other] * share[:, 0] ** 2
            inputs = torch.cat([given / scale, shares[subset].expand(_BATCH, -1)], 1)
            found = decode(encode(inputs)) * scale
            error = ((found - wanted).square().sum(1) / 3.0 + left + 1e-7).sqrt().mean()
            total = total + (error if subset else _WHOLE * error)
        return total / (_WHOLE + _SUBSETS)

    parameters = [*encode.parameters, *decode.parameters]
    descend(parameters, [], loss, recipe.code_steps, "codes", report)
    ones = np.ones(count, np.float32)
    encoder = encode.trained(input_scale=np.concatenate([prior.deviations, ones]))
    decoder = decode.trained(output_scale=prior.deviations)
    return encoder, decoder, _prior(data, estimates, known, encoder, decoder, prior)


def _first_prior(data: TrainingTexels) -> Prior:
    """Variances of coefficients, alike for both values of a pair, and of noise."""
    deviations = np.sqrt(np.square(data.values).mean(0)) + 1e-6
    noise = float(np.exp(np.log(data.residuals + 1e-7).mean()))
    return Prior(deviations.astype(np.float32), noise, np.zeros((0, 0), np.float32), 0.0)


def _estimates(
    data: TrainingTexels, functions: FunctionValues, prior: Prior
) -> tuple[Floats, Floats]:
    """Of every subset: ridge estimates of coefficients (s, t, K), and what is known (s, K)."""
    estimates = np.empty_like(data.moments)
    known = np.empty((len(estimates), estimates.shape[2]), np.float32)
    for index, subset in enumerate(data.subsets):
        observation = Observation(functions.at(subset), prior)
        estimates[index] = observation.ridge(data.moments[index])
        known[index] = observation.known
    return estimates, known


def _prior(
    data: TrainingTexels,
    estimates: Floats,
    known: Floats,
    encode: SkipNetwork,
    decode: SkipNetwork,
    first: Prior,
) -> Prior:
    """With the covariance of errors of first guesses, a mean over the subsets."""
    energy = np.square(data.values).sum(1) / 3.0 + data.residuals + 1e-7
    covariance = np.zeros((data.values.shape[1],) * 2)
    for estimate, share in zip(estimates, known, strict=True):
        error = data.values - decode(encode.given(share)(estimate))
        error /= np.sqrt(energy)[:, None]
        covariance += error.T @ error
    covariance /= len(estimates) * len(data.values)
    relative = np.exp(np.log((data.residuals + 1e-7) / energy).mean())
    noise = _CAUTION * 3.0 * float(relative)
    return Prior(first.deviations, first.noise, covariance.astype(np.float32), noise)


def _orders_of_channels(functions: FunctionValues) -> Floats:
    """What orders of the channels do to coefficients: (6, K, K), to multiply from the right."""
    greys, chromas = functions.grey.shape[1], functions.chroma.shape[1]
    changes = np.tile(np.eye(greys + 2 * chromas, dtype=np.float32), (len(TURNS), 1, 1))
    for change, turn in zip(changes, TURNS, strict=True):
        change[greys:, greys:] = np.kron(turn, np.eye(chromas))
    return changes


def _linear_start(data: TrainingTexels, deviations: Floats, count: int) -> tuple[Floats, Floats]:
    """Principal components: from coefficients over their deviations to codes, and back."""
    energy = np.square(data.values).sum(1) / 3.0 + data.residuals
    weighted = data.values / (energy[:, None] ** 0.25 + 1e-6)
    vectors = np.linalg.eigh((weighted.T @ weighted).astype(np.float64))[1][:, ::-1][:, :count]
    spread = np.sqrt(np.square(data.values @ vectors).mean(0)) + 1e-9
    forward = vectors / spread * deviations[:, None]
    back = (vectors * spread / deviations[:, None]).T
    return forward.astype(np.float32), back.astype(np.float32)
