"""What instruments would read of a material known in part, and which reading to take next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.instruments.quantities import Quantity
from nacre.instruments.readings import Reading
from nacre.latent.intervals import interval
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import UNEXPLAINED, Posterior
from nacre.measuring.design import displayed
from nacre.measuring.from_readings import Expected
from nacre.runtime.progress import Progress, silent

_DRAWS = 256  # codes drawn from the posterior to propose readings


@dataclass(frozen=True)
class Prediction:
    """What an instrument would read.

    Parameters
    ----------
    quantity
        What it reads.
    expected, low, high
        Values on the scale of the instrument, and their 90 % interval, for each component.
    factor
        How far what is seen may be from what is expected: 1 where it is known exactly.
    """

    quantity: Quantity
    expected: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    factor: float


@dataclass(frozen=True)
class Proposal:
    """A reading to take, what to expect of it, and the expected error of pictures after it."""

    prediction: Prediction
    error: float


def predict(
    basis: NeuralBasis, code: Doubles, plausible: npt.ArrayLike, quantity: Quantity
) -> Prediction:
    """What an instrument would read of the material of a code, (k,), and of codes as plausible,
    (m, k).
    """
    expected = Expected.known(basis, quantity)
    logs = np.array([expected.of(each) for each in np.asarray(plausible, np.float64)])
    return _prediction(expected, expected.of(code), logs)


def _prediction(expected: Expected, middle: Doubles, logs: Doubles) -> Prediction:
    """From logarithms of what is expected, (c,), and of what is plausible, (m, c)."""
    quantity = expected.quantity
    ends = interval(quantity.shown(expected.seen(logs)))
    likely, low, high = (
        tuple(values.tolist()) for values in (quantity.shown(expected.seen(middle)), *ends)
    )
    darkest, brightest = interval(logs)
    factor = float(np.exp(0.5 * (brightest - darkest).max()))
    return Prediction(quantity, likely, low, high, factor)


def propose_readings(
    basis: NeuralBasis,
    posterior: Posterior,
    quantities: Sequence[Quantity],
    count: int,
    *,
    until: float = 0.0,
    seed: int = 0,
    progress: Progress = silent,
) -> tuple[float, list[Proposal]]:
    """The expected error of pictures now, and the readings that lower it most, in order.

    The error is the mean absolute one of displayed values. Over codes that are still possible,
    readings and pictures vary together; what a reading tells about pictures is what a linear
    regression on it explains.

    Parameters
    ----------
    posterior
        Of the code, given what is measured.
    quantities
        What may be read next.
    count
        At most this many readings.
    until
        Expected error at which to stop.
    seed
        For drawing codes.
    progress
        Called with the quantities looked at.
    """
    codes = posterior.draw(_DRAWS, seed).astype(np.float64)
    shown = displayed(basis, np.concatenate([posterior.code[None], codes]))
    error = float(np.abs(shown[1:] - shown[0]).mean())
    pictures = shown[1:] - shown[1:].mean(axis=0)
    before = float(np.square(pictures).mean())
    random = np.random.default_rng((seed, 16))
    left: dict[Quantity, tuple[Prediction, Doubles]] = {}
    for index, quantity in enumerate(quantities):
        progress("predicting", index, len(quantities), quantity.name)
        expected = Expected.known(basis, quantity)
        logs = np.array([expected.of(code) for code in codes])
        prediction = _prediction(expected, expected.of(posterior.code), logs)
        values = prediction.expected
        noise = expected.noise(Reading(quantity, values, quantity.uncertainty(values)))
        deviation = np.hypot(noise, UNEXPLAINED / expected.precision)
        read = logs + deviation * random.normal(size=logs.shape)
        left[quantity] = prediction, read - read.mean(axis=0)
    progress("predicting", len(quantities), len(quantities), "")
    found: list[Proposal] = []
    now = error
    while left and len(found) < count and now > until:
        told = {quantity: _explained(pictures, read) for quantity, (_, read) in left.items()}
        best = max(told, key=lambda quantity: float(np.square(told[quantity]).mean()))
        prediction, chosen = left.pop(best)
        pictures = pictures - told[best]
        left = {key: (each, read - _explained(read, chosen)) for key, (each, read) in left.items()}
        now = error * math.sqrt(float(np.square(pictures).mean()) / before)
        found.append(Proposal(prediction, now))
    return error, found


def _explained(values: Doubles, read: Doubles) -> Doubles:
    """The part of values (m, n) that a linear regression on readings (m, c) explains."""
    return np.asarray(read @ np.linalg.lstsq(read, values, rcond=None)[0])
