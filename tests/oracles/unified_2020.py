"""The unified network of Rainer et al. 2020 in the paper's words, one texel at a time."""

from __future__ import annotations

from typing import Any

import torch


def dense(values: Any, parameters: Any, name: str, last: bool) -> Any:
    """Layers called `name`, each followed by a ReLU, or not where it is the last."""
    names = sorted({key.split(".")[1] for key in parameters if key.startswith(f"{name}.")})
    for index in names:
        weight, bias = (parameters[f"{name}.{index}.{part}"] for part in ("weight", "bias"))
        values = torch.einsum("...i,ij->...j", values, weight) + bias
        if index != names[-1] or not last:
            values = torch.where(values > 0, values, torch.zeros_like(values))
    return values


def literal_weights(directions: Any, parameters: Any) -> Any:
    """Weights of every entry and channel, shape (n, 3, m)."""
    return dense(directions, parameters, "angular", last=True).reshape(len(directions), 3, -1)


def literal_codes(values: Any, weights: Any, parameters: Any, pooling: str = "mean") -> Any:
    """The unified encoder in the words of Rainer et al. 2020, for one texel of shape (n, 3)."""
    products = weights * values[:, :, None]
    pooled = products.mean(0) if pooling == "mean" else products.max(0).values
    unrolled = pooled.reshape(-1) + parameters["pooled.bias"]
    activated = torch.where(unrolled > 0, unrolled, parameters["pooled.slope"] * unrolled)
    return dense(activated, parameters, "encoder", last=True)


def literal_values(code: Any, directions: Any, parameters: Any) -> Any:
    """The decoder in the words of Rainer et al. 2020, for one code; shape (n, 3)."""
    inputs = torch.cat([code.expand(len(directions), -1), directions], dim=1)
    return dense(inputs, parameters, "decoder", last=True)
