"""nacre's networks, trained with one more term in the loss."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from nacre.errors import require
from nacre.neural.fit_data import FitData
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.torch import SampleStack, TorchTrainer
from nacre.neural.training import train
from nacre.runtime.device import one_thread

torch: Any = require("torch", "torch")
Tensor: TypeAlias = Any

Term: TypeAlias = Callable[[Tensor, Callable[[Tensor], Tensor]], Tensor]
"""A term of the loss, from a batch and from the network as it is.

The batch has shape (samples, rows), laid out as :class:`nacre.neural.samples.Samples` says. The
network is a function from its inputs (n, k) to f_r (n, 3), which may be negative."""


class PenalizedTrainer(TorchTrainer):
    """:class:`nacre.neural.torch.TorchTrainer` of one network, with terms added to its loss."""

    def __init__(self, material: FitData, terms: Sequence[Term]) -> None:
        recipe = material.recipe
        self._terms, self._constant = tuple(terms), recipe.offset
        form = recipe.hidden_activation, recipe.offset
        super().__init__(material.initial_layers(), recipe.batch, "cpu", 1, *form)

    def _gradient(self, rows: Tensor) -> tuple[list[Tensor], list[Tensor]]:
        weights, biases = super()._gradient(rows)
        if not self._terms:
            return weights, biases
        parameters = [p.detach().requires_grad_() for p in (*self._weights, *self._biases)]
        own = parameters[: len(weights)], parameters[len(weights) :]

        def f_r(inputs: Tensor) -> Tensor:
            outputs = self._forward(inputs[None], *own)[-1][0]
            return outputs.clamp(max=20.0).exp() - self._constant

        total = sum(term(rows[0], f_r) for term in self._terms)
        added = torch.autograd.grad(total, parameters)
        return (
            [w + a for w, a in zip(weights, added, strict=False)],
            [b + a for b, a in zip(biases, added[len(weights) :], strict=True)],
        )


def fit_with(material: FitData, terms: Sequence[Term]) -> NeuralBrdf:
    """The network of a material whose samples are drawn, trained in PyTorch on one thread.

    It takes the recipe of the samples, from one start and without replicas.

    Raises
    ------
    NacreError
        If training diverges.
    """
    with one_thread():
        trainer = PenalizedTrainer(material, terms)
        training = SampleStack([material.training], "cpu")
        held_out = SampleStack([material.held_out], "cpu")
        losses = train(trainer, training, held_out, replace(material.recipe, starts=1))
        (layers,) = trainer.layers()
    return material.finish(layers, {name: float(value[0]) for name, value in losses.items()})
