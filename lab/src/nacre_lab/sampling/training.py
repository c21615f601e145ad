"""Training of reparameterized samplers, by PyTorch."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from nacre.array import namespace
from nacre.brdf import Brdf, above_horizon
from nacre.errors import require
from nacre.runtime.progress import Progress
from nacre.sampling import check_isotropic
from nacre_lab.sampling.reparameterized import (
    INPUTS,
    Reparameterized,
    encoded,
    normal_numbers,
    onto_hemisphere,
)

WIDTHS = INPUTS, 16, 16, 16, 3
DEFENSIVE = 1e-3
"""Share of a plain map in the blend whose logarithm is the loss, as published."""
_DARK = 1e-14


def train(
    brdf: Brdf,
    *,
    steps: int = 3000,
    views: int = 32,
    samples: int = 64,
    learning_rate: float = 5e-3,
    seed: int = 0,
    progress: Progress | None = None,
) -> Reparameterized:
    """A sampler of an isotropic reflectance.

    The loss is the published one: minus the mean logarithm of f_r times the projected area that
    normal numbers are spread over, which is least where their density is that of f_r cos(theta_i).
    Folds count as no area, and a little of a plain map is blended in. Adam's learning rate falls
    to 0 along a cosine, which suits fewer steps than the published 50 times 1,024 of a million
    samples each.

    Parameters
    ----------
    brdf
        The reflectance; its channels are averaged.
    steps, views, samples
        Steps of training, views in each (uniform in the projected disk), and samples of each view,
        a square number.
    learning_rate
        Of the first step.
    seed
        Of everything random.
    progress
        Told about steps.

    Raises
    ------
    MissingExtraError
        If PyTorch is not installed.
    """
    torch: Any = require("torch", "torch")
    check_isotropic(brdf)
    random = torch.Generator().manual_seed(seed)
    layers = []
    for rows, columns in itertools.pairwise(WIDTHS):
        bound = 1.0 / math.sqrt(rows)
        shapes = (rows, columns), (columns,)
        draws = (bound * (2.0 * torch.rand(shape, generator=random) - 1.0) for shape in shapes)
        layers.append(tuple(draw.requires_grad_() for draw in draws))
    parameters = [array for layer in layers for array in layer]
    optimizer = torch.optim.Adam(parameters, lr=learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    side = math.isqrt(samples)
    strata = torch.cartesian_prod(torch.arange(side), torch.arange(side))

    def brightness(wi: Any, wo: Any) -> Any:
        return sum(above_horizon(brdf.eval_components(wi, wo), wi, wo)) / 3.0 + _DARK

    for step in range(steps):
        sine = torch.rand(views, generator=random).sqrt() * 0.999
        sine = sine.repeat_interleave(side * side)
        u = (strata.repeat(views, 1) + torch.rand(len(sine), 2, generator=random)) / side
        z = normal_numbers((None, u[:, 0], u[:, 1]))
        wo = sine, torch.zeros_like(sine), (1.0 - sine * sine).sqrt()
        wi, area = onto_hemisphere(*network(layers, [*encoded(sine), *z]))
        found = brightness(wi, wo) * area.clamp(min=0.0)
        square = 1.0 + z[0] * z[0] + z[1] * z[1]
        plain = z[0] / square.sqrt(), z[1] / square.sqrt(), 1.0 / square.sqrt()
        blend = (1.0 - DEFENSIVE) * found + DEFENSIVE * brightness(plain, wo) / square**2
        loss = -blend.log().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if progress:
            progress("training", step + 1, steps, f"loss {loss.item():.3f}")
    return Reparameterized(
        [tuple(array.detach().numpy().astype(np.float32) for array in layer) for layer in layers]
    )


def network(layers: Any, inputs: list[Any]) -> tuple[Any, Any, Any]:
    """Outputs and their derivatives by the last two inputs, as rows of tensors."""
    xp = namespace(*inputs)
    weights, biases = layers[0]
    values = xp.join(inputs) @ weights + biases
    tangents = [weights[-2], weights[-1]]
    for weights, biases in layers[1:]:
        gates = values.sigmoid()
        slopes = gates * (1.0 + values * (1.0 - gates))
        tangents = [(slopes * tangent) @ weights for tangent in tangents]
        values = (gates * values) @ weights + biases
    return values.unbind(-1), tangents[0].unbind(-1), tangents[1].unbind(-1)
