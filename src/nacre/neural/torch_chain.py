"""PyTorch modules as chains of layers, where that is what they compute."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.errors import NacreError, require
from nacre.numerics.mlp import Layer

_MODULES = {
    "ReLU": "relu",
    "ReLU6": "relu6",
    "Tanh": "tanh",
    "Sigmoid": "sigmoid",
    "SiLU": "silu",
}
_FUNCTIONS = {
    **dict.fromkeys(("relu", "relu_", "clamp_min_0"), "relu"),
    **{name: name for name in ("relu6", "tanh", "sigmoid", "silu", "exp", "sin", "square", "abs")},
}
_NOTHING = {"Identity", "Dropout", "Flatten", "contiguous", "dropout", "float"}


def chain_of(module: Any) -> tuple[list[Layer], list[str]]:
    """Layers and the activation after each ("" for none) of a module.

    The module takes one tensor, or two that it joins at first; then each step takes what the one
    before it returns: `nn.Linear`, and activations as modules or functions.

    Raises NacreError, with the first step that is something else.
    """
    fx = require("torch.fx", "torch")
    try:
        traced = fx.symbolic_trace(module)
    except Exception as error:  # whatever the module does to what stands for its input
        raise NacreError(f"{type(module).__name__}: cannot be traced: {error}") from error
    layers: list[Layer] = []
    activations: list[str] = []
    given = [node for node in traced.graph.nodes if node.op == "placeholder"]
    before: Any = given[0] if len(given) == 1 else None
    for node in traced.graph.nodes:
        if node.op == "placeholder":
            continue
        if node.op == "output":
            if node.args[0] is not before:
                raise NacreError(f"{type(module).__name__}: returns more than its last step")
            break
        if before is None and _joins(node, given):
            before = node
            continue
        if [n for n in node.all_input_nodes if n is not before] or before is None:
            raise NacreError(
                f"{type(module).__name__}: step {node.name} takes another one's values"
            )
        step = traced.get_submodule(node.target) if node.op == "call_module" else None
        if type(step).__name__ == "Linear":
            layers.append(_layer(step))
            activations.append("")
        elif activation := _activation(node, step):
            if not layers or activations[-1]:
                layers.append(_same(layers, step, node))
                activations.append("")
            activations[-1] = activation
        elif _name(node, step) not in _NOTHING:
            raise NacreError(f"{type(module).__name__}: step {node.name} is no layer of a chain")
        before = node
    if not layers:
        raise NacreError(f"{type(module).__name__}: has no linear layer")
    return layers, activations


def _joins(node: Any, given: list[Any]) -> bool:
    """Whether a step joins the inputs, in their order, along the last axis."""
    if _name(node, None) not in ("cat", "concat", "concatenate", "hstack"):
        return False
    joined = node.args[0] if node.args else node.kwargs.get("tensors")
    axis = node.args[1] if len(node.args) > 1 else node.kwargs.get("dim", 0)
    return list(joined) == given and axis in (-1, 1)


def _name(node: Any, step: Any) -> str:
    if step is not None:
        return type(step).__name__
    return str(node.target if node.op == "call_method" else getattr(node.target, "__name__", ""))


def _layer(linear: Any) -> Layer:
    weights = linear.weight.detach().cpu().numpy().T
    biases = linear.bias
    return Layer(weights, np.zeros(weights.shape[1]) if biases is None else
                 biases.detach().cpu().numpy())  # fmt: skip


def _same(layers: list[Layer], step: Any, node: Any) -> Layer:
    """A layer that changes nothing, between two activations."""
    if not layers:
        raise NacreError(f"step {node.name}: an activation before the first linear layer")
    width = len(layers[-1].biases)
    return Layer(np.eye(width, dtype=np.float32), np.zeros(width, np.float32))


def _activation(node: Any, step: Any) -> str:
    """Name of an activation of :mod:`nacre.numerics.activations`; empty for anything else."""
    name = _name(node, step)
    if step is not None and name in _MODULES:
        return _MODULES[name]
    if step is None and name in _FUNCTIONS:
        return _FUNCTIONS[name]
    given = [argument for argument in node.args[1:] if isinstance(argument, float | int)]
    options = node.kwargs

    def number(attribute: str, key: str, default: float) -> float:
        if step is not None:
            return float(getattr(step, attribute))
        return float(options.get(key, given[0] if given else default))

    match name:
        case "LeakyReLU" | "leaky_relu" | "leaky_relu_":
            return f"leaky relu {number('negative_slope', 'negative_slope', 0.01)!r}"
        case "ELU" | "elu" | "elu_":
            return f"elu {number('alpha', 'alpha', 1.0)!r}"
        case "Softplus" | "softplus":
            return f"softplus {number('beta', 'beta', 1.0)!r}"
        case "GELU" | "gelu":
            exact = step.approximate if step is not None else options.get("approximate", "none")
            return "gelu" if exact == "none" else ""
    return ""
