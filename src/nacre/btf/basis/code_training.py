"""Codes of the default codec: an autoencoder over coefficients, and what codes are like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf.basis.functions import FunctionValues
from nacre.btf.basis.network_training import SkipTraining, Tensor, descend, torch
from nacre.btf.basis.posterior import Prior
from nacre.btf.basis.recipe import BasisRecipe
from nacre.btf.basis.skip_network import SkipNetwork
from nacre.channels import TURNS
from nacre.progress import Progress

_BATCH = 512
_SYMMETRIES = 8
"""Symmetries in a batch."""
_MIXED = 0.5
"""Share of texels that are mixed with another."""


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Training texels in the functions.

    Parameters
    ----------
    values
        Shape (t, K): of grey values, then the first of the pairs, then the second.
    residuals
        Mean square of what the functions leave of reflectance factors, shape (t,).
    """

    values: Floats
    residuals: Floats


def train_codes(
    data: Coefficients, turns: Floats, recipe: BasisRecipe, report: Progress
) -> tuple[SkipNetwork, SkipNetwork, Prior]:
    """The networks from coefficients to codes and back, and the prior.

    Parameters
    ----------
    data
        Of the functions, which are orthonormal over the pairs of directions.
    turns
        What turns about the normal do to coefficients, shape (k, K, K).
    recipe
        Sizes and efforts.
    report
        Called as it goes on.
    """
    values = torch.from_numpy(data.values)
    residuals = torch.from_numpy(data.residuals)
    symmetries = torch.from_numpy(_symmetries(turns, recipe))
    generator = torch.Generator().manual_seed(recipe.seed)
    deviations = np.sqrt(np.square(data.values).mean(0)) + 1e-6
    scale = torch.from_numpy(deviations)
    to_codes, to_coefficients = _linear_start(data, symmetries.numpy(), deviations, recipe.values)
    encode = SkipTraining(to_codes, recipe.hidden, generator)
    decode = SkipTraining(to_coefficients, recipe.hidden, generator)

    def loss(_step: int) -> Tensor:
        """Mean over texels of root mean square errors of reflectance factors."""
        chosen, mates = torch.randint(len(values), (2, _BATCH), generator=generator)
        share = torch.rand(_BATCH, 1, generator=generator)
        share *= torch.rand(_BATCH, 1, generator=generator) < _MIXED
        mixed = torch.lerp(values[chosen], values[mates], share)
        # What the functions leave of two texels is taken to be independent.
        left = residuals[chosen] * (1 - share[:, 0]) ** 2 + residuals[mates] * share[:, 0] ** 2
        picked = torch.randint(len(symmetries), (_SYMMETRIES,), generator=generator)
        parts = zip(mixed.chunk(_SYMMETRIES), symmetries[picked], strict=True)
        seen = torch.cat([part @ symmetry for part, symmetry in parts])
        found = decode(encode(seen / scale)) * scale
        return ((found - seen).square().sum(1) / 3.0 + left + 1e-7).sqrt().mean()

    descend([*encode.parameters, *decode.parameters], [], loss, recipe.code_steps, "codes", report)
    encoder = encode.trained(input_scale=deviations)
    decoder = decode.trained(output_scale=deviations)
    codes = encoder(data.values).astype(np.float64)
    spread = np.cov(codes.T) + 1e-4 * np.eye(recipe.values)
    _, shared = _split(deviations, recipe)
    prior = Prior(
        np.concatenate([deviations[: recipe.greys], shared]).astype(np.float32),
        float(np.exp(np.log(data.residuals + 1e-7).mean())),
        codes.mean(0).astype(np.float32),
        np.linalg.inv(spread).astype(np.float32),
    )
    return encoder, decoder, prior


def turn_coefficients(functions: FunctionValues, orders: list[npt.NDArray[Any]]) -> Floats:
    """What turns about the normal do to coefficients: shape (k, K, K), to be multiplied from the
    right.
    """
    count, greys, chromas = len(functions.mean), functions.grey.shape[1], functions.chroma.shape[1]
    turns = np.zeros((len(orders), *[greys + 2 * chromas] * 2), np.float32)
    for turned, order in zip(turns, orders, strict=True):
        turned[:greys, :greys] = functions.grey[order].T @ functions.grey / count
        chroma = functions.chroma[order].T @ functions.chroma / count
        for start in (greys, greys + chromas):
            turned[start : start + chromas, start : start + chromas] = chroma
    return turns


def _symmetries(turns: Floats, recipe: BasisRecipe) -> Floats:
    """Every turn with every order of the channels."""
    orders = []
    for turn in TURNS:
        change = np.eye(turns.shape[1], dtype=np.float32)
        change[recipe.greys :, recipe.greys :] = np.kron(turn, np.eye(recipe.chromas))
        orders.append(change)
    return np.concatenate([turns @ order for order in orders])


def _linear_start(
    data: Coefficients, symmetries: Floats, deviations: Floats, count: int
) -> tuple[Floats, Floats]:
    """Principal components of coefficients: codes of scaled coefficients, and the way back."""
    energy = np.square(data.values).sum(1) / 3.0 + data.residuals
    weighted = data.values / (energy[:, None] ** 0.25 + 1e-6)
    covariance = weighted.T @ weighted
    covariance = np.mean([s.T @ covariance @ s for s in symmetries], axis=0)
    vectors = np.linalg.eigh(covariance.astype(np.float64))[1][:, ::-1][:, :count]
    spread = np.sqrt(np.square(data.values @ vectors).mean(0)) + 1e-9
    forward = vectors / spread * deviations[:, None]
    back = (vectors * spread / deviations[:, None]).T
    return forward.astype(np.float32), back.astype(np.float32)


def _split(deviations: Floats, recipe: BasisRecipe) -> tuple[Floats, Floats]:
    pairs = deviations[recipe.greys :].reshape(2, recipe.chromas)
    return deviations[: recipe.greys], np.sqrt(np.square(pairs).mean(0))
