"""The codes of the default codec: an autoencoder for coefficients, and its errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from nacre.array import Floats
from nacre.numerics.channels import CHROMA_PERMUTATIONS
from nacre.numerics.pca import largest_first
from nacre.textures.codecs.basis.coefficients import TrainingTexels
from nacre.textures.codecs.basis.fields import kept
from nacre.textures.codecs.basis.network_training import SkipTraining, Tensor, descend, torch
from nacre.textures.codecs.basis.networks import FunctionValues, SkipNetwork
from nacre.textures.codecs.basis.posterior import Observation, Prior
from nacre.textures.codecs.basis.recipe import Work

_BATCH = 512  # texels in a step
_PARTS = 4  # of a batch: each with its own order of the channels, and subset of directions
_MIXED = 0.5  # share of texels that are mixed with another
_CAUTION = 20.0
"""Times that noise counts where measurements override what is completed: unlike noise, what the
functions cannot express is alike at neighboring directions."""


def train_codes(
    data: TrainingTexels, functions: FunctionValues, work: Work
) -> tuple[SkipNetwork, SkipNetwork, SkipNetwork, Prior]:
    """The networks that complete, encode and decode coefficients, and the prior.

    The functions are those at all directions, over which they are orthonormal.
    """
    training = _Training(data, functions, work)
    coder = kept(work.store, "coder", _Coder, training.autoencoder)
    complete = training.completion()
    return complete, coder.encode, coder.decode, training.prior(complete)


@dataclass(frozen=True, eq=False)
class _Coder:
    encode: SkipNetwork
    decode: SkipNetwork


class _Training:
    def __init__(self, data: TrainingTexels, functions: FunctionValues, work: Work) -> None:
        self._data, self._work, self._recipe = data, work, work.recipe
        self._first = _first_prior(data)
        self._estimates, self._known = _estimates(data, functions, self._first)
        self._generator = torch.Generator().manual_seed(self._recipe.seed)
        self._orders = torch.from_numpy(_orders_of_channels(functions))
        self._scale = torch.from_numpy(self._first.deviations)
        self._values = torch.from_numpy(data.values)
        self._residuals = torch.from_numpy(data.residuals)

    def autoencoder(self) -> _Coder:
        deviations, hidden = self._first.deviations, self._recipe.hidden
        forward, back = _linear_start(self._data, deviations, self._recipe.code_dim)
        encode = SkipTraining(forward, hidden, self._generator)
        decode = SkipTraining(back, hidden, self._generator)

        def loss(_step: int) -> Tensor:
            parts = self._parts()
            seen = torch.cat([part.of(self._values) for part in parts])
            found = decode(encode(seen / self._scale)) * self._scale
            return self._error(found - seen, parts)

        self._descend([encode, decode], loss, "codes")
        trained = encode.trained(input_scale=deviations), decode.trained(output_scale=deviations)
        return _Coder(*trained)

    def completion(self) -> SkipNetwork:
        """From estimates of coefficients at some directions to those at all."""
        self._generator.manual_seed(self._recipe.seed)  # whatever has been drawn before
        deviations, count = self._first.deviations, self._values.shape[1]
        identity = np.eye(count, dtype=np.float32)
        complete = SkipTraining(identity, self._recipe.completing, self._generator, 2 * count)
        estimates, known = torch.from_numpy(self._estimates), torch.from_numpy(self._known)

        def loss(_step: int) -> Tensor:
            parts = self._parts()
            subsets = self._draw(len(estimates), _PARTS).tolist()
            wanted = torch.cat([part.of(self._values) for part in parts])
            pairs = list(zip(parts, subsets, strict=True))
            seen = torch.cat([part.of(estimates[subset]) for part, subset in pairs])
            fractions = torch.cat([known[k].expand(len(part.one), -1) for part, k in pairs])
            found = complete(torch.cat([seen / self._scale, fractions], 1)) * self._scale
            return self._error(found - wanted, parts)

        self._descend([complete], loss, "completion")
        scale = np.concatenate([deviations, np.ones(count, np.float32)])
        return complete.trained(input_scale=scale, output_scale=deviations)

    def prior(self, complete: SkipNetwork) -> Prior:
        """With the covariance of errors of completed coefficients, averaged over the subsets."""
        values, residuals = self._data.values, self._data.residuals + 1e-7
        energy = np.square(values).sum(1) / 3.0 + residuals
        covariance = np.zeros((values.shape[1],) * 2)
        for estimate, fraction in zip(self._estimates, self._known, strict=True):
            error = values - complete.given(fraction)(estimate)
            error /= np.sqrt(energy)[:, None]
            covariance += error.T @ error
        covariance /= len(self._estimates) * len(values)
        noise = _CAUTION * 3.0 * float(np.exp(np.log(residuals / energy).mean()))
        return replace(self._first, covariance=covariance.astype(np.float32), relative_noise=noise)

    def _descend(
        self, networks: list[SkipTraining], loss: Callable[[int], Tensor], stage: str
    ) -> None:
        vectors = [vector for network in networks for vector in network.vectors]
        matrices = [matrix for network in networks for matrix in network.matrices]
        steps, generator = self._recipe.code_steps, self._generator
        descend(vectors, matrices, loss, steps, stage, generator, self._work)

    def _draw(self, limit: int, count: int) -> Tensor:
        return torch.randint(limit, (count,), generator=self._generator)

    def _parts(self) -> list[_Part]:
        count = _BATCH // _PARTS
        parts = []
        for order in self._orders[self._draw(len(self._orders), _PARTS)]:
            one, other = self._draw(len(self._values), 2 * count).chunk(2)
            fraction = torch.rand(count, 1, generator=self._generator)
            fraction *= torch.rand(count, 1, generator=self._generator) < _MIXED
            parts.append(_Part(one, other, fraction, order))
        return parts

    def _error(self, difference: Tensor, parts: list[_Part]) -> Tensor:
        """Mean over texels of root mean square errors of roots of reflectance factors."""
        left = torch.cat([part.left(self._residuals) for part in parts])
        return (difference.square().sum(1) / 3.0 + left + 1e-7).sqrt().mean()


class _Part(NamedTuple):
    """Pairs of texels, fractions of the second ones in mixtures, and an order of the channels."""

    one: Tensor
    other: Tensor
    fraction: Tensor
    order: Tensor

    def of(self, table: Tensor) -> Tensor:
        """Coefficients of the mixtures, from a table of those of all texels."""
        return torch.lerp(table[self.one], table[self.other], self.fraction) @ self.order

    def left(self, residuals: Tensor) -> Tensor:
        """What the functions leave out of mixtures, as if that of two texels were independent."""
        fraction = self.fraction[:, 0]
        return residuals[self.one] * (1.0 - fraction) ** 2 + residuals[self.other] * fraction**2


def _first_prior(data: TrainingTexels) -> Prior:
    """Variances of coefficients, the same for both values of a pair, and of noise."""
    deviations = np.sqrt(np.square(data.values).mean(0)) + 1e-6
    noise = float(np.exp(np.log(data.residuals + 1e-7).mean()))
    return Prior(deviations.astype(np.float32), noise, np.zeros((0, 0), np.float32), 0.0)


def _estimates(
    data: TrainingTexels, functions: FunctionValues, prior: Prior
) -> tuple[Floats, Floats]:
    """For every subset: ridge estimates of coefficients (s, t, K), and what is known (s, K)."""
    estimates = np.empty_like(data.moments)
    known = np.empty((len(estimates), estimates.shape[2]), np.float32)
    for index, subset in enumerate(data.subsets):
        observation = Observation(functions.at(subset), prior)
        estimates[index] = observation.ridge(data.moments[index])
        known[index] = observation.known
    return estimates, known


def _orders_of_channels(functions: FunctionValues) -> Floats:
    """Matrices (6, K, K) that permute the channels: coefficients (b, K) @ matrix."""
    luma, chroma = np.eye(functions.luma.shape[1]), np.eye(functions.chroma.shape[1])
    changes = [block_diag(luma, np.kron(order, chroma)) for order in CHROMA_PERMUTATIONS]
    return np.array(changes, np.float32)


def _linear_start(data: TrainingTexels, deviations: Floats, count: int) -> tuple[Floats, Floats]:
    """Principal components: from coefficients over their deviations to codes, and back."""
    energy = np.square(data.values).sum(1) / 3.0 + data.residuals
    weighted = data.values / (energy[:, None] ** 0.25 + 1e-6)
    vectors = largest_first(weighted.T @ weighted, count)[1]
    deviation = np.sqrt(np.square(data.values @ vectors).mean(0)) + 1e-9
    forward = vectors / deviation * deviations[:, None]
    back = (vectors * deviation / deviations[:, None]).T
    return forward.astype(np.float32), back.astype(np.float32)
