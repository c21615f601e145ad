"""Sine and cosine from sums and products, for languages whose own are inaccurate.

Vulkan, WGSL and Metal allow errors of 2^-11, which then appear in the length of directions made
from them. SwiftShader makes use of that.
"""

from __future__ import annotations

import math
from functools import reduce

from nacre.array import namespace
from nacre.compile.trace import Formulas, Traced

# Minimax over a half turn around 0, with errors of 5e-9 and 1e-9, below float32's own. From the
# highest power of the squared angle down.
_SIN = 2.600054714e-6, -1.980661517e-4, 8.333017291e-3, -1.66666571e-1
_COS = -2.619381473e-7, 2.476930421e-5, -1.388856916e-3, 4.166665577e-2
_PI = 3.140625, 9.67653589793e-4  # parts; the first has few bits


def _sin(x: Traced) -> Traced:
    r, sign = _half_turn(x)
    z = r * r
    total: Traced = sign * (r + r * z * reduce(lambda total, c: total * z + c, _SIN))
    return total


def _cos(x: Traced) -> Traced:
    r, sign = _half_turn(x)
    z = r * r
    total: Traced = sign * (1.0 - 0.5 * z + z * z * reduce(lambda total, c: total * z + c, _COS))
    return total


def _half_turn(x: Traced) -> tuple[Traced, Traced]:
    """An angle reduced to a half turn around 0, and the sign of its sine and cosine there."""
    floor = namespace(x).floor
    n = floor(x * (1.0 / math.pi) + 0.5)
    return x - n * _PI[0] - n * _PI[1], 1.0 + 4.0 * floor(0.5 * n) - 2.0 * n


CIRCULAR: Formulas = {"sin": _sin, "cos": _cos}
"""Formulas by name, for angles up to some hundreds."""
