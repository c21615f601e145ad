"""Steps of Adam that can be stopped and go on: what all trainings in PyTorch have in common."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, require
from nacre.runtime.device import one_thread
from nacre.runtime.progress import Progress
from nacre.runtime.store import Store

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any

_SAVE_SECONDS = 45.0
"""Between states that are kept."""


def descend(
    adam: Any,
    loss: Callable[[int], Tensor],
    rates: npt.NDArray[np.float32],
    fingerprint: str,
    checkpoint: Path | None,
    report: Progress,
    stage: str = "training",
) -> float:
    """Take all steps that are left; gives the last loss.

    Parameters
    ----------
    adam
        The optimizer. The learning rate of a group of parameters is its "factor" times the rate.
    loss
        Gives the loss of a step. It must depend on the parameters and the number of the step only,
        so that training goes on as if it never stopped.
    rates
        Learning rate of every step.
    fingerprint
        What must be the same for a training to go on.
    checkpoint
        File for the state; begins there if it exists.
    report
        Called as it goes on.
    stage
        What that says.

    Raises
    ------
    NacreError
        If training diverges, or the checkpoint is of another training or damaged.
    """
    last = math.inf

    def state() -> dict[str, Any]:
        parameters = [p.data for p in _parameters(adam)]
        return {"loss": last, "adam": adam.state_dict(), "parameters": parameters}

    def restore(state: dict[str, Any]) -> None:
        nonlocal last
        adam.load_state_dict(state["adam"])
        for mine, saved in zip(_parameters(adam), state["parameters"], strict=True):
            mine.data.copy_(saved)
        last = float(state["loss"])

    steps = Store(checkpoint, fingerprint).steps(len(rates), state, restore, seconds=_SAVE_SECONDS)
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


def _parameters(adam: Any) -> list[Tensor]:
    return [p for group in adam.param_groups for p in group["params"]]
