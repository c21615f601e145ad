"""Steps of Adam that can be stopped and continued: what all trainings in PyTorch have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, require
from nacre.latent.recipes import AutoencoderRecipe, BasisRecipe, HypernetworkRecipe
from nacre.neural.training import schedule
from nacre.numerics.mlp import Layer
from nacre.runtime.device import one_thread
from nacre.runtime.progress import Progress
from nacre.runtime.store import SAVE_EVERY, Store, restore_optimizer

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any


def descend(
    groups: Mapping[float, Sequence[Tensor]],
    loss: Callable[[int], Tensor],
    recipe: BasisRecipe | HypernetworkRecipe | AutoencoderRecipe,
    same: str,
    checkpoint: Path | None,
    report: Progress,
    stage: str = "training",
) -> float:
    """Take all steps that are left; returns the last loss.

    The learning rate of a group of parameters is its key times that of the schedule. `loss` returns
    the loss of a step and must depend only on the parameters and the number of the step, so that
    training goes on as if it had never stopped. The state is kept in the file `checkpoint`, for
    trainings with the same recipe and the same text `same`. Raises NacreError if training diverges,
    or the checkpoint is from another training or damaged.
    """
    last = math.inf
    options = [{"params": group, "factor": factor} for factor, group in groups.items()]
    adam = torch.optim.Adam(options, betas=(0.9, 0.99))
    parameters = [p for group in groups.values() for p in group]
    rates = schedule(recipe.steps, recipe.learning_rate)

    def state() -> dict[str, Any]:
        values = [p.data for p in parameters]
        return {"loss": last, "adam": adam.state_dict(), "parameters": values}

    def restore(state: dict[str, Any]) -> None:
        nonlocal last
        restore_optimizer(adam, state["adam"])
        for mine, saved in zip(parameters, state["parameters"], strict=True):
            mine.data.copy_(saved)
        last = float(state["loss"])

    store = Store(checkpoint, f"{recipe} {same}")
    steps = store.steps(len(rates), state, restore, seconds=SAVE_EVERY)
    with one_thread():
        for index in steps:
            for group in adam.param_groups:
                group["lr"] = group["factor"] * float(rates[index])
            current = loss(index)
            adam.zero_grad()
            current.backward()
            adam.step()
            last = float(current.item())
            if (index + 1) % 50 == 0 or index + 1 == len(rates):
                report(stage, index + 1, len(rates), f"loss {last:.4f}")
    if not math.isfinite(last):
        raise NacreError("training of the basis diverged; lower the learning rate")
    return last


def free(values: npt.ArrayLike) -> Tensor:
    return torch.from_numpy(np.array(values, np.float32)).requires_grad_()


def free_layer(
    random: np.random.Generator, rows: int, columns: int, deviation: float
) -> tuple[Tensor, Tensor]:
    return free(random.normal(0.0, deviation, (rows, columns))), free(np.zeros(columns))


def finished(layer: Sequence[Tensor]) -> Layer:
    return Layer(*(part.detach().numpy() for part in layer))
