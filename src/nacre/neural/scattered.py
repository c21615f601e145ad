"""Training samples from a reflectance that is known at scattered directions only.

A network can be trained on any sampling of a reflectance (NBRDF paper, section 3.1). A scan has few
samples, far from each other and none near the horizon, so they train together with *filling*:
samples uniform in the Rusinkiewicz angles, over the whole hemisphere, of the reflectance that the
training part of the scan gives by interpolation. The filling says how to go on between samples and
towards the horizon; the scan's own samples say what was measured. Held-out samples are the scan's
own, and neither trained on nor interpolated from.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from nacre.brdf import DirectionSamples, Floats, Scattered
from nacre.files import NacreError
from nacre.geometry import split
from nacre.neural.inputs import network_inputs
from nacre.neural.samples import BLOCK, Rows, Samples, draw_rows

SCATTERED_SAMPLES = 128_000
"""Training samples, filling included: 100 epochs take as many steps as a draft of a table."""
OWN_SHARE = 0.5
"""Share of the training samples that are the scan's own, repeated."""
LEAST = 2 * BLOCK
"""Samples that a scan must have."""


def scattered_samples(
    brdf: Scattered,
    count: int,
    held_out: float,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Samples, Samples]:
    """Training samples and held-out samples of a scan.

    Parameters
    ----------
    brdf
        The scan.
    count
        Number of training samples, filling included.
    held_out
        Share of the scan's samples to hold out.
    seed
        Chooses the held-out samples (see :func:`hold_out`) and the filling.
    progress
        Called with the number of samples drawn and how many there will be.

    Raises
    ------
    NacreError
        If the scan has too few samples.
    """
    kept, held = hold_out(len(brdf.samples), held_out, seed)
    part = brdf.subset(kept)
    own = _rows(brdf, brdf.samples[kept])
    repeats = max(1, round(OWN_SHARE * count / len(own[0])))
    filling = draw_rows(part, count - repeats * len(own[0]), seed, progress, everywhere=True)
    # Blocks of samples train together: they should not be all of one kind.
    order = np.random.default_rng((seed, 4)).permutation(len(filling[0]) + repeats * len(own[0]))
    training = (
        np.concatenate([np.tile(a, (repeats, 1)), b])[order]
        for a, b in zip(own, filling, strict=True)
    )
    return _pack(*training), _pack(*_rows(brdf, brdf.samples[held]))


def hold_out(
    count: int, share: float, seed: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Indices of the samples of a scan to train on, and of those held out.

    Raises
    ------
    NacreError
        If there are fewer than :data:`LEAST`.
    """
    held = max(1, round(share * count))
    if count < LEAST or held >= count:
        raise NacreError(f"{count} samples are too few to fit a network to, at least {LEAST}")
    order = np.random.default_rng((seed, 3)).permutation(count)
    return np.sort(order[held:]), np.sort(order[:held])


def _rows(brdf: Scattered, samples: DirectionSamples) -> Rows:
    """Samples as network inputs, colours and cosines; also mirrored, where that is allowed."""
    signs = (1.0, -1.0) if brdf.mirrored else (1.0,)
    wi, wo = (
        np.concatenate([w * np.array([1.0, sign, 1.0]) for sign in signs])
        for w in (samples.wi, samples.wo)
    )
    inputs = network_inputs(split(wi), split(wo), brdf.isotropic)
    x = np.stack(np.broadcast_arrays(*inputs), axis=-1)
    return x, np.tile(samples.rgb, (len(signs), 1)), wi[:, 2:]


def _pack(inputs: Floats, rgb: Floats, cosine: Floats) -> Samples:
    return Samples.pack(inputs, rgb, cosine[:, 0])
