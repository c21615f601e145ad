"""Optimizes a network's weights to match photographs, beyond what a code can express."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.errors import require
from nacre.geometry import uniform_rusinkiewicz
from nacre.latent.posterior import UNEXPLAINED
from nacre.neural import NeuralBrdf
from nacre.photographs.search import BLACK, Photograph
from nacre.runtime.progress import Progress, silent
from nacre.sampling import fit_lobes

STEPS = 200
_RATE = 4e-3
_PIXELS = 96  # per step
_PAIRS = 4096  # at which the network is held to plausible materials
_PIXEL_ERROR = 0.03  # of the logarithm, which no network explains
_HOLD = 0.02  # weight of a pair of directions relative to a pixel
_DARK = 1e-3  # added to f_r cos theta_i before logarithms


def refine(
    network: NeuralBrdf,
    plausible: Sequence[Brdf],
    photographs: Sequence[Photograph],
    factors: npt.NDArray[np.float64],
    *,
    seed: int = 0,
    progress: Progress = silent,
) -> NeuralBrdf:
    """A network whose pictures match photographs.

    It starts from the network of the expected material. Where the photographs do not tell, f_r is
    held to equally plausible materials, more strongly where these agree. Camera factors have shape
    (photographs, 3). Raises MissingExtraError if PyTorch is not installed.
    """
    torch: Any = require("torch", "torch")
    from nacre.neural.torch import module

    wi, wo, expected, deviation = map(torch.from_numpy, _held(plausible, seed))
    cosine = wi[:, 2:]
    made = module(network)
    parts = [_tensors(torch, photograph) for photograph in photographs]
    logs = torch.from_numpy(np.log(factors).astype(np.float32))
    optimizer = torch.optim.Adam(made.parameters(), lr=_RATE)
    rates = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS)
    random = np.random.default_rng((seed, 15))
    for step in range(STEPS):
        index = step % len(parts)
        lights, views, weights, seen, black = parts[index]
        chosen = torch.from_numpy(random.integers(0, len(seen), _PIXELS))
        optimizer.zero_grad()
        shown = (made(lights[chosen], views[chosen]) * weights[chosen]).sum(1)
        missed = torch.log(shown * logs[index].exp() + black) - seen[chosen]
        loss = torch.log1p(0.5 * (missed / _PIXEL_ERROR).square()).mean()
        held = torch.log(made(wi, wo) * cosine + _DARK) - expected
        loss = loss + _HOLD * (held / deviation).square().mean()
        loss.backward()
        optimizer.step()
        rates.step()
        if step % 20 == 0:
            progress("refining", step, STEPS, "")
    progress("refining", STEPS, STEPS, "")
    found: NeuralBrdf = made.brdf()
    return found.replaced(sampler=fit_lobes(found))


def _tensors(torch: Any, photograph: Photograph) -> tuple[Any, ...]:
    """Directions, weights, logarithms of the pixels, and the offset inside these."""
    recording, values = photograph.recording, photograph.values
    black = BLACK * float(values.mean())
    seen = np.log(np.maximum(values, 0.0) + black).astype(np.float32)
    arrays = recording.wi, recording.wo, recording.weights, seen
    return (*map(torch.from_numpy, arrays), black)


def _held(plausible: Sequence[Brdf], seed: int) -> tuple[npt.NDArray[np.float32], ...]:
    """Pairs of directions, means and deviations of the logarithm of f cos theta_i there."""
    u = np.random.default_rng((seed, 14)).random((4, 4 * _PAIRS), dtype=np.float32)
    u[1] = 0.0
    wi, wo = (np.stack(np.broadcast_arrays(*w), axis=-1) for w in uniform_rusinkiewicz(u))
    above = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    wi, wo = wi[above][:_PAIRS], wo[above][:_PAIRS]
    values = np.stack([brdf.eval(wi, wo) for brdf in plausible]) * wi[:, 2:]
    logs = np.log(values + _DARK)
    deviation = np.hypot(logs.std(axis=0), UNEXPLAINED)
    return tuple(a.astype(np.float32) for a in (wi, wo, logs.mean(axis=0), deviation))
