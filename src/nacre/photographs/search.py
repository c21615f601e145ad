"""Finds the code of a material in recorded photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles as Vector
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import LOOSE, Linearized, Posterior
from nacre.latent.sums import Sums
from nacre.photographs.recording import Recording

PRECISION = 6.0
"""A pixel, being a mean, is this much more precise than f_r at one pair of directions."""
BLACK = 0.01
"""Added to a picture before logarithms, relative to its mean."""
CAMERAS = "known", "exposure", "white-balance"
"""The camera is fully known; its exposure is unknown; its factor in each channel is unknown."""


@dataclass(frozen=True)
class Photograph:
    """The pixels of a picture that show one material.

    Parameters
    ----------
    values
        Linear RGB of the recorded pixels, shape (n, 3).
    recording
        The sums behind them.
    noise
        Standard deviation of the values, shape (n, 3).
    """

    values: npt.NDArray[np.float64]
    recording: Recording
    noise: npt.NDArray[np.float64]


def posterior_of_photographs(
    basis: NeuralBasis, photographs: Sequence[Photograph], camera: str = "known"
) -> Posterior:
    """The posterior of a material's code, given one or more photographs.

    Pixels are observations like samples of f_r in :func:`nacre.latent.posterior.search`, with
    the same prior; pixels that no code explains get little weight. `camera` is one of
    :data:`CAMERAS`: unknown factors are estimated as well, and are expected to be right within 30
    percent.
    """
    found = [_Pixels(basis, photograph) for photograph in photographs]
    factors = _factors([len(item.missing) for item in found], camera)

    missing, black, noise = (
        np.concatenate([getattr(item, name) for item in found])
        for name in ("missing", "black", "noise")
    )

    def linearized(mean: Vector) -> Linearized:
        code, free = np.split(mean, [basis.code_dim])
        values, rates = zip(*(item.sums.at(code) for item in found), strict=True)
        scale = np.exp(LOOSE * np.einsum("e,enc->nc", free, factors))
        shown = scale * np.concatenate(values)
        lit = shown + black
        slopes = [scale * np.concatenate(rates, axis=1), LOOSE * factors * shown]
        missed = missing - np.log(lit)
        slope = np.concatenate(slopes) / lit
        return Linearized(PRECISION * missed, PRECISION * slope, PRECISION * noise / lit)

    return basis.inferred(linearized, extra=len(factors))


def camera_factors(found: Posterior, count: int, camera: str) -> Vector:
    """Factors for each photograph and channel, shape (count, 3): 1 if known."""
    factors = _factors([1] * count, camera)
    logarithms = np.einsum("e,enc->nc", np.log(found.factors), factors)
    return np.asarray(np.exp(logarithms))


def unexplained(
    basis: NeuralBasis, code: Vector, photographs: Sequence[Photograph], factors: Vector
) -> float:
    """Median absolute difference between logarithms of pixels and of a code's prediction."""
    missed = []
    for photograph, factor in zip(photographs, factors, strict=True):
        item = _Pixels(basis, photograph)
        missed.append(item.missing - np.log(factor * item.sums.values(code) + item.black))
    return float(np.median(np.abs(np.concatenate(missed))))


def _factors(counts: Sequence[int], camera: str) -> Vector:
    """1 at the pixels and channels that each free factor belongs to, shape (extra, n, 3)."""
    channels = {"known": np.zeros((0, 3)), "exposure": np.ones((1, 3)), "white-balance": np.eye(3)}
    picture = np.repeat(np.eye(len(counts)), counts, axis=1)
    factors = np.einsum("pn,fc->pfnc", picture, channels[camera])
    return np.asarray(factors.reshape(-1, sum(counts), 3))


class _Pixels:
    """A photograph as a function of the code."""

    def __init__(self, basis: NeuralBasis, photograph: Photograph) -> None:
        recording = photograph.recording
        self.sums = Sums(basis, recording.wi, recording.wo, recording.weights)
        self.black = np.full((len(recording.wi), 1), BLACK * float(photograph.values.mean()))
        self.missing = np.log(np.maximum(photograph.values, 0.0) + self.black)
        self.noise = photograph.noise
