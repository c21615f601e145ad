"""What MaterialX's nodes for arithmetic give for constants.

MaterialX 1.39, "Standard Nodes": names of inputs and their defaults are those of stdlib_defs.mtlx.
Python has `in` for itself; that input is `x` here.
"""

from __future__ import annotations

import colorsys
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from nacre.array import Doubles

SIZES = {
    **dict.fromkeys(("float", "integer", "boolean"), 1),
    **dict.fromkeys(("color3", "vector3"), 3),
    **dict.fromkeys(("color4", "vector4"), 4),
    "vector2": 2,
}
"""How many numbers a value has, by its type."""

_ACES = (0.2722287, 0.6740818, 0.0536895)  # luminance in AP1, the nodes' default
_LETTERS = {"rgba"[i]: i for i in range(4)} | {"xyzw"[i]: i for i in range(4)}


def _mix(fg: Any = 0.0, bg: Any = 0.0, mix: Any = 0.0) -> Any:
    return bg * (1.0 - mix) + fg * mix


def _remap(
    x: Any = 0.0, inlow: Any = 0.0, inhigh: Any = 1.0, outlow: Any = 0.0, outhigh: Any = 1.0
) -> Any:
    return outlow + (x - inlow) / (inhigh - inlow) * (outhigh - outlow)


def _range(
    x: Any = 0.0,
    inlow: Any = 0.0,
    inhigh: Any = 1.0,
    gamma: Any = 1.0,
    outlow: Any = 0.0,
    outhigh: Any = 1.0,
    doclamp: Any = 0.0,
) -> Any:
    part = _remap(x, inlow, inhigh)
    found = _remap(np.sign(part) * np.abs(part) ** (1.0 / gamma), 0.0, 1.0, outlow, outhigh)
    return np.clip(found, outlow, outhigh) if np.any(doclamp) else found


def _smoothstep(x: Any = 0.0, low: Any = 0.0, high: Any = 1.0) -> Any:
    part = np.clip((x - low) / (high - low), 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)


def _combine(in1: Any = 0.0, in2: Any = 0.0, in3: Any = (), in4: Any = ()) -> Any:
    return np.concatenate([np.atleast_1d(each) for each in (in1, in2, in3, in4)])


def _pick(*values: Any, which: Any) -> Any:
    place = int(np.clip(np.floor(np.ravel(which)[0]), 0, len(values) - 1))
    return values[place]


def _switch(
    in1: Any = 0.0,
    in2: Any = 0.0,
    in3: Any = 0.0,
    in4: Any = 0.0,
    in5: Any = 0.0,
    in6: Any = 0.0,
    in7: Any = 0.0,
    in8: Any = 0.0,
    in9: Any = 0.0,
    in10: Any = 0.0,
    which: Any = 0.0,
) -> Any:
    return _pick(in1, in2, in3, in4, in5, in6, in7, in8, in9, in10, which=which)


def _luminance(x: Any = 0.0, lumacoeffs: Any = _ACES) -> Any:
    gray = np.sum(np.ravel(x)[:3] * np.asarray(lumacoeffs))
    return np.concatenate([np.full(3, gray), np.ravel(x)[3:]])


def _saturate(x: Any = 0.0, amount: Any = 1.0, lumacoeffs: Any = _ACES) -> Any:
    return _mix(x, _luminance(x, lumacoeffs), amount)


def _hsv(convert: Callable[[float, float, float], tuple[float, ...]], x: Any) -> Any:
    return np.concatenate([convert(*np.ravel(x)[:3].tolist()), np.ravel(x)[3:]])


def _hsvadjust(x: Any = (0.0, 0.0, 0.0), amount: Any = (0.0, 1.0, 1.0)) -> Any:
    hue, *others = _hsv(colorsys.rgb_to_hsv, x)
    turned = [hue + amount[0], others[0] * amount[1], others[1] * amount[2], *others[2:]]
    return _hsv(colorsys.hsv_to_rgb, turned)


NODES: Mapping[str, Callable[..., Any]] = {
    "constant": lambda value=0.0: value,
    "dot": lambda x=0.0, note="": x,
    "convert": lambda x=0.0: x,
    "add": lambda in1=0.0, in2=0.0: in1 + in2,
    "subtract": lambda in1=0.0, in2=0.0: in1 - in2,
    "multiply": lambda in1=0.0, in2=1.0: in1 * in2,
    "divide": lambda in1=0.0, in2=1.0: in1 / in2,
    "modulo": lambda in1=0.0, in2=1.0: in1 - in2 * np.floor(in1 / in2),
    "power": lambda in1=0.0, in2=1.0: in1**in2,
    "safepower": lambda in1=0.0, in2=1.0: np.sign(in1) * np.abs(in1) ** in2,
    "min": lambda in1=0.0, in2=0.0: np.minimum(in1, in2),
    "max": lambda in1=0.0, in2=0.0: np.maximum(in1, in2),
    "invert": lambda x=0.0, amount=1.0: amount - x,
    "absval": lambda x=0.0: np.abs(x),
    "sign": lambda x=0.0: np.sign(x),
    "floor": lambda x=0.0: np.floor(x),
    "ceil": lambda x=0.0: np.ceil(x),
    "round": lambda x=0.0: np.floor(x + 0.5),
    "fract": lambda x=0.0: x - np.floor(x),
    "sqrt": lambda x=0.0: np.sqrt(x),
    "ln": lambda x=1.0: np.log(x),
    "exp": lambda x=0.0: np.exp(x),
    "sin": lambda x=0.0: np.sin(x),
    "cos": lambda x=0.0: np.cos(x),
    "tan": lambda x=0.0: np.tan(x),
    "asin": lambda x=0.0: np.arcsin(x),
    "acos": lambda x=0.0: np.arccos(x),
    "atan2": lambda iny=0.0, inx=1.0: np.arctan2(iny, inx),
    "clamp": lambda x=0.0, low=0.0, high=1.0: np.minimum(np.maximum(x, low), high),
    "mix": _mix,
    "remap": _remap,
    "range": _range,
    "smoothstep": _smoothstep,
    "contrast": lambda x=0.0, amount=1.0, pivot=0.5: (x - pivot) * amount + pivot,
    "ifgreater": lambda value1=1.0, value2=0.0, in1=0.0, in2=0.0: _pick(
        in2, in1, which=value1 > value2
    ),
    "ifgreatereq": lambda value1=1.0, value2=0.0, in1=0.0, in2=0.0: _pick(
        in2, in1, which=value1 >= value2
    ),
    "ifequal": lambda value1=0.0, value2=0.0, in1=0.0, in2=0.0: _pick(
        in2, in1, which=value1 == value2
    ),
    "switch": _switch,
    "and": lambda in1=0.0, in2=0.0: in1 * in2,
    "or": lambda in1=0.0, in2=0.0: np.maximum(in1, in2),
    "xor": lambda in1=0.0, in2=0.0: np.abs(in1 - in2),
    "not": lambda x=0.0: 1.0 - x,
    "dotproduct": lambda in1=0.0, in2=0.0: np.sum(in1 * in2),
    "magnitude": lambda x=0.0: np.linalg.norm(x),
    "normalize": lambda x=0.0: x / np.linalg.norm(x),
    "combine2": _combine,
    "combine3": _combine,
    "combine4": _combine,
    "separate2": lambda x=0.0: x,
    "separate3": lambda x=0.0: x,
    "separate4": lambda x=0.0: x,
    "extract": lambda x=(0.0,), index=0.0: _pick(*np.ravel(x), which=index),
    "luminance": _luminance,
    "saturate": _saturate,
    "rgbtohsv": lambda x=(0.0, 0.0, 0.0): _hsv(colorsys.rgb_to_hsv, x),
    "hsvtorgb": lambda x=(0.0, 0.0, 0.0): _hsv(colorsys.hsv_to_rgb, x),
    "hsvadjust": _hsvadjust,
}
"""Functions of numbers and arrays by the categories of nodes; where there are several outputs, they
are the numbers of the result."""


def inputs_of(category: str) -> frozenset[str]:
    """The inputs that a node of :data:`NODES` takes, by MaterialX's names."""
    names = inspect.signature(NODES[category]).parameters
    return frozenset("in" if name == "x" else name for name in names)


def result(category: str, inputs: Mapping[str, Doubles], kind: str) -> Doubles:
    """What a node of a type gives for values of its inputs, each of shape (size,).

    Raises ValueError if it is not finite, or the sizes do not fit each other.
    """
    given = {"x" if name == "in" else name: value for name, value in inputs.items()}
    try:
        with np.errstate(all="ignore"):
            found = np.atleast_1d(np.asarray(NODES[category](**given), np.float64))
    except (IndexError, TypeError, OverflowError, ZeroDivisionError) as error:
        raise ValueError(f"its inputs do not fit each other: {error}") from error
    if not np.isfinite(found).all():
        raise ValueError("the result is not finite")
    return found if category.startswith("separate") else resized(found, SIZES.get(kind, found.size))


def resized(value: Doubles, size: int) -> Doubles:
    """One number repeated, or numbers cut off or added, as `convert` does: an added fourth is 1."""
    if value.size == 1:
        return np.repeat(value, size)
    added = [1.0 if place == 3 else 0.0 for place in range(value.size, size)]
    return np.concatenate([value[:size], added])


def swizzled(value: Doubles, channels: str) -> Doubles:
    """Numbers picked by letters, such as "rrr" or "x"; digits stand for themselves.

    Raises ValueError for a letter without a number.
    """
    picked = []
    for letter in channels:
        if letter in "01":
            picked.append(float(letter))
        elif _LETTERS.get(letter, 9) < value.size:
            picked.append(float(value[_LETTERS[letter]]))
        else:
            raise ValueError(f"there is no channel {letter!r}")
    return np.array(picked)
