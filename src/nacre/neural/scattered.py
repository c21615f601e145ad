"""Training samples from a reflectance that is known at scattered directions only.

A network can be trained on any sampling of a reflectance (NBRDF paper, section 3.1). A scan has few
samples, far from each other and none near the horizon, so half of the training samples are its own,
repeated, and half are drawn from their interpolation (:mod:`nacre.neural.augmentation`).

The loss differs from that of tables, |log(1 + f cos) - log(1 + f' cos)|, in its weight: k = 100
takes the place of the cosine. Above 1 / k it is relative error, so dark colors count; and the
horizon counts like any other direction, where a cosine of 0 would leave it free.

Where the noise of samples is known, those with less of it are repeated more often.

Held-out samples are the scan's own; they are neither trained on nor interpolated from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, VectorList
from nacre.errors import NacreError
from nacre.neural.augmentation import augmentation
from nacre.neural.inputs import PAPER
from nacre.neural.samples import Samples, axis_angle, direction_inputs
from nacre.numerics.direction_samples import DirectionSamples, Scattered
from nacre.numerics.mlp import Layer

SCATTERED_SAMPLES = 320_000  # training samples, augmentation included
OWN_FRACTION = 0.5  # fraction of the training samples that are the scan's own, repeated
WEIGHT = 100.0  # k in sr: differences below 1 / k hardly matter
LEAST_DEVIATION = 0.02
"""Deviation of the logarithm in the loss below which less noise makes no sample count more."""
MIN_SAMPLES = 10  # samples that a scan must have
MIN_VALUE = 1e-3  # the least that measured values (1/sr) count as when errors are relative


def scattered_samples(
    scan: Scattered,
    count: int,
    held_out: float,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    inputs: str = PAPER,
) -> tuple[Samples, Samples]:
    """Training samples and held-out samples of a scan; the latter with the loss of tables.

    `count` is how many to train on, augmentation included, `held_out` the fraction of the scan's
    samples to hold out. The seed chooses these (:func:`hold_out`) and the augmentation. Raises
    NacreError if the scan has too few samples.
    """
    check_count(scan)
    kept, held = hold_out(len(scan.samples), held_out, seed)
    part = scan.subset(kept)
    own = repeated(with_mirrored(part.samples, scan.mirrored), OWN_FRACTION * count, seed)
    rest = augmentation(part, max(0, count - len(own)), seed, progress)
    # Blocks of samples train together: they should not be all of one kind.
    order = np.random.default_rng((seed, 4)).permutation(len(own) + len(rest))
    validation = with_mirrored(scan.samples[held], scan.mirrored)
    angle = axis_angle(part.samples, scan.isotropic, inputs)
    values, rest_values, held_values = (
        direction_inputs(of, scan.isotropic, inputs, angle) for of in (own, rest, validation)
    )
    rgb = np.concatenate([own.rgb, rest.rgb])[order]
    return (
        Samples.pack(
            np.concatenate([values, rest_values])[order], rgb, np.full(len(rgb), WEIGHT), angle
        ),
        Samples.pack(held_values, validation.rgb, validation.cosine, angle),
    )


def check_count(scan: Scattered) -> None:
    """Raise NacreError for a scan of too few samples to fit a network to."""
    if len(scan.samples) < MIN_SAMPLES:
        few = f"{len(scan.samples)} samples are too few to fit a network to"
        raise NacreError(f"{scan.name or 'scan'}: {few}; measure at least {MIN_SAMPLES}")


def hold_out(
    count: int, fraction: float, seed: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Indices of the samples of a scan to train on, and to hold out; NacreError if none is left."""
    held = max(1, round(fraction * count))
    if held >= count:
        raise NacreError(f"{held} of {count} samples are held out, which leaves none to train on")
    order = np.random.default_rng((seed, 3)).permutation(count)
    return np.sort(order[held:]), np.sort(order[:held])


def highest(scan: Scattered, held_out: float, seed: int) -> Floats:
    """The highest values (3,) among the samples to train on: no network for a scan exceeds them."""
    kept, _ = hold_out(len(scan.samples), held_out, seed)
    return np.asarray(np.maximum(scan.samples.rgb[kept], 0.0).max(axis=0), np.float64)


def clamped(layers: Sequence[Layer], highest: npt.ArrayLike) -> list[Layer]:
    """Layers of the network min(f_r, highest), in 1/sr and shape (3,), exact at all directions.

    One more ReLU layer, of three units, does it: min(x, c) = c - max(c - x, 0), with x the output
    before exp(x) - 1 and c = log(1 + highest).
    """
    *hidden, last = layers
    cap = np.log1p(np.asarray(highest, np.float32))
    below = Layer(-last.weights, cap - last.biases)
    return [*hidden, below, Layer(-np.eye(len(cap), dtype=np.float32), cap)]


def validation_errors(
    scan: Scattered,
    values: Floats,
    predict: Callable[[VectorList, VectorList], Floats],
    held_out: float,
    seed: int,
) -> dict[str, float]:
    """How well values (n, channels) of held-out samples are predicted: by a fit, as a function of
    directions (m, 3), and by the nearest sample.
    """
    kept, held = hold_out(len(scan.samples), held_out, seed)
    truth, wanted = scan.samples[held], values[held]
    nearest = values[kept][scan.subset(kept).nearest(truth.wi, truth.wo)]
    median, mean = relative_errors(predict(truth.wi, truth.wo), wanted)
    nearest_median, nearest_mean = relative_errors(nearest, wanted)
    return {
        "held_out_samples": len(held),
        "held_out_median_error": median,
        "held_out_mean_error": mean,
        "nearest_sample_median_error": nearest_median,
        "nearest_sample_mean_error": nearest_mean,
    }


def relative_errors(predicted: Floats, measured: Floats) -> tuple[float, float]:
    """Median and mean of |predicted - measured| / measured, over samples and channels.

    Negative values count as 0, and measured ones as at least :data:`MIN_VALUE` in the divisor.
    """
    predicted, measured = np.maximum(predicted, 0.0), np.maximum(measured, 0.0)
    relative = np.abs(predicted - measured) / np.maximum(measured, MIN_VALUE)
    return float(np.median(relative)), float(relative.mean())


def repeated(samples: DirectionSamples, count: float, seed: int) -> DirectionSamples:
    """The samples several times each, about `count` in all.

    With known noise, how often goes by the inverse of the deviation of the logarithm in the loss,
    as its absolute value asks for.
    """
    repeats = max(1, round(count / len(samples)))
    every = np.arange(repeats * len(samples))
    if samples.sigma is None:
        return samples[every % len(samples)]
    level = np.maximum(samples.rgb, 0.0).mean(axis=1)
    deviation = WEIGHT * samples.sigma / (1.0 + WEIGHT * level)
    shares = 1.0 / np.hypot(deviation, LEAST_DEVIATION)
    ends = np.cumsum(shares) / shares.sum() * len(every)
    first = np.random.default_rng((seed, 9)).random()
    return samples[np.minimum(np.searchsorted(ends, first + every), len(samples) - 1)]


def with_mirrored(samples: DirectionSamples, mirrored: bool) -> DirectionSamples:
    """The samples, with their mirror images in a plane with the normal if that changes nothing."""
    if not mirrored:
        return samples
    flip = np.array([1.0, -1.0, 1.0])
    twice = samples[np.tile(np.arange(len(samples)), 2)]
    wi, wo = (np.concatenate([w, w * flip]) for w in (samples.wi, samples.wo))
    return replace(twice, wi=wi, wo=wo)
