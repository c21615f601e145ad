"""What takes the steps of a training."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nacre.textures.codecs.networks.mlp import Tensor, torch
from nacre.textures.codecs.networks.recipe import TrainingRecipe

_SMALLEST_MATRIX = 32
"""Smaller ones are left to Adam where Muon is asked for: it makes all singular values alike."""


def optimisers(parameters: Sequence[Tensor], recipe: TrainingRecipe) -> list[Any]:
    """What takes a step together; learning rates are set at every one."""
    rate = recipe.learning_rate
    if recipe.optimiser == "sgd":
        return [torch.optim.SGD(parameters, lr=rate)]

    def adam(some: Sequence[Tensor]) -> Any:
        return torch.optim.Adam(some, lr=rate, betas=(0.9, 0.99), fused=True)

    matrices = [p for p in parameters if p.ndim == 2 and min(p.shape) >= _SMALLEST_MATRIX]
    if recipe.optimiser == "adam" or not matrices:
        return [adam(parameters)]
    rest = [p for p in parameters if not any(p is m for m in matrices)]
    muon = torch.optim.Muon(
        matrices, lr=rate, weight_decay=0.0, momentum=0.95, adjust_lr_fn="match_rms_adamw"
    )
    return [muon, adam(rest)]
