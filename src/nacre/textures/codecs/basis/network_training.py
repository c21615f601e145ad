"""Networks of the default codec in PyTorch, while they are trained."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from nacre.errors import NacreError, require
from nacre.numerics.mlp import SILU, Layer, forward
from nacre.numerics.muon import Muon
from nacre.runtime.device import one_thread
from nacre.runtime.store import restore_optimizer
from nacre.textures.codecs.basis.networks import SkipNetwork
from nacre.textures.codecs.basis.recipe import Work

torch: Any = require("torch", "btf")
Tensor: TypeAlias = Any

_RATE, _MATRIX_RATE = 3e-3, 0.02


def descend(
    vectors: list[Tensor],
    matrices: list[Tensor],
    loss: Callable[[int], Tensor],
    steps: int,
    stage: str,
    generator: Any,
    work: Work,
) -> None:
    """Take steps with a rate that rises for the first 2 % and then falls to nothing.

    Adam moves the vectors: biases, and matrices at the ends of a network. Muon (Jordan et al. 2024)
    moves the matrices between hidden layers, where it gets much further. The loss, a function of
    the step, draws from the generator. A :class:`NacreError` says that numbers are not finite in
    the end.
    """
    optimizers = [(torch.optim.Adam(vectors), _RATE)]
    if matrices:
        optimizers.append((Muon(matrices, _MATRIX_RATE), _MATRIX_RATE))
    changed = [*vectors, *matrices]

    def state() -> dict[str, Any]:
        states = [optimizer.state_dict() for optimizer, _ in optimizers]
        return {"tensors": changed, "optimizers": states, "generator": generator.get_state()}

    def restore(state: dict[str, Any]) -> None:
        for tensor, saved in zip(changed, state["tensors"], strict=True):
            tensor.data.copy_(saved)
        for (optimizer, _), saved in zip(optimizers, state["optimizers"], strict=True):
            restore_optimizer(optimizer, saved)
        generator.set_state(state["generator"])

    with one_thread():
        for step in work.store.steps(steps, state, restore, f"{stage}-steps"):
            fraction = min(1.0, (step + 1) / (0.02 * steps + 1.0))
            fraction *= 0.5 * (1.0 + math.cos(math.pi * step / steps))
            current = loss(step)
            for optimizer, _ in optimizers:
                optimizer.zero_grad()
            current.backward()
            for optimizer, rate in optimizers:
                optimizer.param_groups[0]["lr"] = rate * fraction
                optimizer.step()
            if (step + 1) % 50 == 0 or step + 1 == steps:
                work.report(stage, step + 1, steps, f"loss {float(current.item()):.4g}")
    if not all(bool(torch.isfinite(tensor).all()) for tensor in changed):
        raise NacreError(f"{stage} diverged; take another seed")


def new_layer(
    inputs: int, outputs: int, generator: Any, gain: float = 1.0
) -> tuple[Tensor, Tensor]:
    """Weights and biases of a layer at its start (He et al. 2015)."""
    weights = torch.randn(inputs, outputs, generator=generator) * (gain * math.sqrt(2.0 / inputs))
    return weights.requires_grad_(), torch.zeros(outputs, requires_grad=True)


def to_layer(pair: tuple[Tensor, Tensor]) -> Layer:
    weights, biases = (np.ascontiguousarray(p.detach().numpy()) for p in pair)
    return Layer(weights, biases)


class SkipTraining:
    """A :class:`SkipNetwork` that begins as its linear map."""

    def __init__(self, linear: Any, hidden: int, generator: Any, inputs: int = 0) -> None:
        seen, outputs = linear.shape
        self.linear = torch.from_numpy(np.ascontiguousarray(linear)).requires_grad_()
        self.layers = [
            new_layer(inputs or seen, hidden, generator),
            new_layer(hidden, hidden, generator),
            new_layer(hidden, outputs, generator, gain=0.0),
        ]

    @property
    def matrices(self) -> list[Tensor]:
        """Weights between hidden layers."""
        return [weights for weights, _ in self.layers[1:-1]]

    @property
    def vectors(self) -> list[Tensor]:
        """All else that is trained."""
        ends = [self.layers[0][0], self.layers[-1][0]]
        return [self.linear, *ends, *(biases for _, biases in self.layers)]

    def __call__(self, x: Tensor) -> Tensor:
        return x[:, : len(self.linear)] @ self.linear + forward(x, self.layers, SILU)

    def trained(self, input_scale: Any = 1.0, output_scale: Any = 1.0) -> SkipNetwork:
        """The network for inputs and outputs in other units: divided and multiplied by scales."""
        first, middle, last = (to_layer(pair) for pair in self.layers)
        scale_in = np.broadcast_to(np.float32(input_scale), len(first.weights))[:, None]
        first = Layer(first.weights / scale_in, first.biases)
        last = Layer(last.weights * output_scale, last.biases * output_scale)
        linear = self.linear.detach().numpy()
        linear = linear / scale_in[: len(linear)] * output_scale
        return SkipNetwork(np.ascontiguousarray(linear, np.float32), [first, middle, last])
