"""Activations of networks that others made, on components of any library and in Dr.Jit's vectors.

Names are PyTorch's; some take a number: "leaky relu 0.2".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from nacre.array import Array, Namespace, namespace

_LOG2E = math.log2(math.e)
_CLIP = 60.0  # bound of exponents: nothing overflows in float32
_LARGEST = 1e6  # number of an activation
_ERF = (0.254829592, -0.284496736, 1.421413741, -1.453152027, 1.061405429)
"""Abramowitz and Stegun, "Handbook of Mathematical Functions", 7.1.26: to 1.5e-7."""


def _sigmoid(xp: Namespace, x: Array) -> Array:
    return 1.0 / (1.0 + xp.exp(xp.minimum(xp.maximum(-x, -_CLIP), _CLIP)))


def _tanh(xp: Namespace, x: Array) -> Array:
    return 2.0 * _sigmoid(xp, 2.0 * x) - 1.0


def _softplus(xp: Namespace, x: Array, beta: float) -> Array:
    # 1 + e^-|x| is at most 2, so that nothing overflows.
    return xp.maximum(x, 0.0) + xp.log(1.0 + xp.exp(-xp.minimum(xp.abs(beta * x), _CLIP))) / beta


def _erf(xp: Namespace, x: Array) -> Array:
    size = xp.abs(x)
    t = 1.0 / (1.0 + 0.3275911 * size)
    series = 0.0 * t
    for coefficient in reversed(_ERF):
        series = t * (series + coefficient)
    value = 1.0 - series * xp.exp(-xp.minimum(size * size, _CLIP))
    return xp.where(x < 0.0, -value, value)


_FUNCTIONS: dict[str, tuple[float | None, Callable[[Namespace, Array, float], Array]]] = {
    "relu": (None, lambda xp, x, _: xp.maximum(x, 0.0)),
    "relu6": (None, lambda xp, x, _: xp.minimum(xp.maximum(x, 0.0), 6.0)),
    "leaky relu": (0.01, lambda xp, x, slope: xp.maximum(x, 0.0) + slope * xp.minimum(x, 0.0)),
    "elu": (1.0, lambda xp, x, a: xp.maximum(x, 0.0) + a * (xp.exp(xp.minimum(x, 0.0)) - 1.0)),
    "tanh": (None, lambda xp, x, _: _tanh(xp, x)),
    "sigmoid": (None, lambda xp, x, _: _sigmoid(xp, x)),
    "silu": (None, lambda xp, x, _: x * _sigmoid(xp, x)),
    "softplus": (1.0, _softplus),
    "gelu": (None, lambda xp, x, _: 0.5 * x * (1.0 + _erf(xp, x * math.sqrt(0.5)))),
    "exp": (None, lambda xp, x, _: xp.exp(xp.minimum(x, 80.0))),
    "sin": (1.0, lambda xp, x, frequency: xp.sin(frequency * x)),
    "squared relu": (None, lambda xp, x, _: xp.maximum(x, 0.0) * xp.maximum(x, 0.0)),
    "square": (None, lambda xp, x, _: x * x),
    "abs": (None, lambda xp, x, _: xp.abs(x)),
}
"""The number that an activation has unless one is given, and the function of value and number."""


def _cooperative(name: str, x: Any, number: float) -> Any:
    """An activation in the functions that cooperative vectors have."""
    import drjit as dr

    match name:
        case "relu":
            return dr.maximum(x, 0.0)
        case "relu6":
            return dr.minimum(dr.maximum(x, 0.0), 6.0)
        case "leaky relu":
            return dr.maximum(x, 0.0) + dr.minimum(x, 0.0) * number
        case "elu":
            return dr.maximum(x, 0.0) + (dr.exp2(dr.minimum(x, 0.0) * _LOG2E) - 1.0) * number
        case "tanh":
            return dr.tanh(x)
        case "sigmoid":
            return dr.tanh(x * 0.5) * 0.5 + 0.5
        case "silu":
            return x * (dr.tanh(x * 0.5) * 0.5 + 0.5)
        case "softplus":
            size = dr.minimum(dr.maximum(x, 0.0 - x) * (number * _LOG2E), _CLIP * _LOG2E)
            tail = dr.log2(dr.exp2(0.0 - size) + 1.0) * (1.0 / (number * _LOG2E))
            return dr.maximum(x, 0.0) + tail
        case "exp":
            return dr.exp2(dr.minimum(x, 80.0) * _LOG2E)
        case "squared relu":
            return dr.maximum(x, 0.0) * dr.maximum(x, 0.0)
        case "square":
            return x * x
        case _:
            return dr.maximum(x, 0.0 - x)


WITHOUT_VECTORS = "gelu", "sin"
"""Activations that Dr.Jit's cooperative vectors cannot compute."""


def parsed(activation: str) -> tuple[str, float]:
    """Name and number of an activation; ValueError where it is not known."""
    name, _, last = activation.rpartition(" ")
    if name in _FUNCTIONS and _FUNCTIONS[name][0] is not None:
        number = float(last)
        if not abs(number) <= _LARGEST or (name == "softplus" and number < 1.0 / _LARGEST):
            raise ValueError(f"activation {activation[:40]!r}: {last[:20]} is out of range")
        return name, number
    if activation not in _FUNCTIONS:
        known = ", ".join(_FUNCTIONS)
        raise ValueError(f"activation {activation[:40]!r} is none of {known}")
    return activation, _FUNCTIONS[activation][0] or 0.0


def applied(activation: str, values: Any) -> Any:
    """An activation of a sequence of components, or of a cooperative vector; "" changes nothing."""
    if not activation:
        return values
    name, number = parsed(activation)
    if not isinstance(values, list | tuple):
        return _cooperative(name, values, number)
    xp, function = namespace(*values), _FUNCTIONS[name][1]
    found: Sequence[Array] = [function(xp, value, number) for value in values]
    return found
