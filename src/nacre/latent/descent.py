"""Steps of Adam that can be stopped and go on: what all trainings in PyTorch have in common."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import NacreError, require
from nacre.runtime.checkpoint import load_state, save_state
from nacre.runtime.device import one_thread
from nacre.runtime.progress import Progress

torch: Any = require("torch", "latent")
Tensor: TypeAlias = Any

_SAVE_EVERY = 500
"""Steps between checkpoints."""


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
    step, last = 0, math.inf
    if checkpoint is not None and checkpoint.exists():
        step, last = _resume(adam, fingerprint, checkpoint)
    with one_thread():
        for index in range(step, len(rates)):
            for group in adam.param_groups:
                group["lr"] = group["factor"] * float(rates[index])
            current = loss(index)
            adam.zero_grad()
            current.backward()
            adam.step()
            step, last = index + 1, float(current.item())
            if step % 50 == 0 or step == len(rates):
                report(stage, step, len(rates), f"loss {last:.4f}")
            if checkpoint is not None and step % _SAVE_EVERY == 0:
                _save(adam, fingerprint, step, last, checkpoint)
    if not math.isfinite(last):
        raise NacreError("training of the basis diverged; lower the learning rate")
    return last


def _resume(adam: Any, fingerprint: str, checkpoint: Path) -> tuple[int, float]:
    def restore(state: dict[str, Any]) -> tuple[int, float]:
        adam.load_state_dict(state["adam"])
        for mine, saved in zip(_parameters(adam), state["parameters"], strict=True):
            mine.data.copy_(saved)
        return int(state["step"]), float(state["loss"])

    return load_state(checkpoint, fingerprint, restore)


def _save(adam: Any, fingerprint: str, step: int, loss: float, checkpoint: Path) -> None:
    state = {
        "step": step,
        "loss": loss,
        "adam": adam.state_dict(),
        "parameters": [p.data for p in _parameters(adam)],
    }
    save_state(checkpoint, fingerprint, state)


def _parameters(adam: Any) -> list[Tensor]:
    return [p for group in adam.param_groups for p in group["params"]]
