"""Fully connected layers with ReLUs between them, as named tensors."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import require
from nacre.geometry import split, stereographic

torch: Any = require("torch", "btf")
_Settings = TypeVar("_Settings")
_MAX_LAYERS, _MAX_WIDTH = 16, 1 << 13
Tensor: TypeAlias = Any
Parameters: TypeAlias = Mapping[str, Tensor]
Shapes: TypeAlias = dict[str, tuple[int, ...]]

VARIANCES = {"pytorch": 1.0, "he": math.sqrt(6.0)}
"""Ways to begin, and what multiplies 1 / sqrt(inputs) in the bound of weights; the variance of
uniform numbers is a third of the square of their bound."""


def mlp_shapes(name: str, widths: Sequence[int]) -> Shapes:
    """Names and shapes of the tensors of layers between `widths`."""
    shapes: Shapes = {}
    for index, (rows, columns) in enumerate(itertools.pairwise(widths)):
        shapes[f"{name}.{index}.weight"] = (rows, columns)
        shapes[f"{name}.{index}.bias"] = (columns,)
    return shapes


def mlp_layers(parameters: Parameters, name: str) -> list[tuple[Any, Any]]:
    """The layers whose tensors :func:`mlp_shapes` has named."""
    found: list[tuple[Any, Any]] = []
    while f"{name}.{len(found)}.weight" in parameters:
        start = f"{name}.{len(found)}"
        found.append((parameters[f"{start}.weight"], parameters[f"{start}.bias"]))
    return found


def initial(
    shapes: Shapes, random: np.random.Generator, variance: str = "he"
) -> dict[str, npt.NDArray[np.float32]]:
    """Random weights and biases, for tensors called `x.weight`, (inputs, outputs) or for a
    convolution (outputs, inputs, size), each followed by its `x.bias`.

    Biases lie within 1 / sqrt(inputs of the layer), weights within that times a factor from
    :data:`VARIANCES`: "pytorch" as in layers of PyTorch, a variance of a third of 1 / inputs; "he"
    with 2 / inputs, so that the variance of signals stays through layers with ReLUs (He et al.
    2015).
    """
    arrays, bound = {}, 0.0
    for name, shape in shapes.items():
        factor = 1.0
        if name.endswith(".weight"):
            bound = 1.0 / math.sqrt(math.prod(shape[1:]) if len(shape) == 3 else shape[0])
            factor = VARIANCES[variance]
        arrays[name] = random.uniform(-factor * bound, factor * bound, shape).astype(np.float32)
    return arrays


INPUTS = 4  # stereographic coordinates of the light and of the viewer
HIDDEN = (106, 106, 106, 106)
"""Widths of the hidden layers (Rainer et al. 2020, section 4; as in Rainer et al. 2019)."""
DECODERS = "network", "bilinear"
"""Kinds of decoders. The "network" is the paper's: hidden layers with ReLUs on the code and the
stereographic coordinates of both directions. The "bilinear" one is ours: a network on the
directions alone gives as many features as its last width, a network on the code as many
coefficients for each channel, and a value is their product, so that a code that is met often costs
one dot product for each channel and pair of directions."""


def direction_inputs(wi: Floats, wo: Floats) -> npt.NDArray[np.float32]:
    parts = (*stereographic(split(wi)), *stereographic(split(wo)))
    return np.stack(parts, axis=-1).astype(np.float32)


def check_sizes(settings: Any) -> None:
    """Refuse settings that no network can have, with the name of the setting."""
    if settings.decoder not in DECODERS:
        raise ValueError(f"decoder must be one of {', '.join(DECODERS)}, got {settings.decoder!r}")
    sizes = {name: value for name, value in vars(settings).items() if not isinstance(value, str)}
    for name, value in sizes.items():
        values = value if isinstance(value, tuple) else (value,)
        if not 1 <= len(values) <= _MAX_LAYERS or not all(1 <= v <= _MAX_WIDTH for v in values):
            raise ValueError(f"{name} must be widths of 1 to {_MAX_WIDTH:,}, got {values}")


def settings_from_json(kind: type[_Settings], found: dict[str, Any]) -> _Settings:
    if set(found) != {field.name for field in fields(kind)}:  # type: ignore[arg-type]
        raise ValueError(f"settings are {sorted(found)}, not those that this nacre knows")
    values: dict[str, Any] = {}
    for name, value in found.items():
        default = getattr(kind, name)
        wanted = tuple if isinstance(default, tuple) else type(default)
        value = tuple(value) if isinstance(value, list) else value
        members = value if isinstance(value, tuple) else ()
        if type(value) is not wanted or not all(type(v) is int for v in members):
            raise ValueError(f"setting {name} is {value!r}, expected a {wanted.__name__}")
        values[name] = value
    return kind(**values)
