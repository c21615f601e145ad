"""Exponential, logarithm and circular functions in the operations that processors have.

They are exact to a unit in the last place of float32, angles to 4 of them, with polynomials and
reductions from Cephes (Moshier 1989). Values are those of a trace (:mod:`nacre.compile.trace`):
vectors of numbers in compiled code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

_EXP = (1.9875691500e-4, 1.3981999507e-3, 8.3334519073e-3, 4.1665795894e-2, 1.6666665459e-1,
        5.0000001201e-1)  # fmt: skip
_LOG = (7.0376836292e-2, -1.1514610310e-1, 1.1676998740e-1, -1.2420140846e-1, 1.4249322787e-1,
        -1.6668057665e-1, 2.0000714765e-1, -2.4999993993e-1, 3.3333331174e-1)  # fmt: skip
_SIN = -1.9515295891e-4, 8.3321608736e-3, -1.6666654611e-1
_COS = 2.443315711809948e-5, -1.388731625493765e-3, 4.166664568298827e-2
_ATAN = 8.05374449538e-2, -1.38776856032e-1, 1.99777106478e-1, -3.33329491539e-1

_ROUND = 1.5 * 2.0**23  # what is added to it is rounded to a whole number, in the lowest bits
_HALF_PI = 1.5703125, 4.837512969970703125e-4, 7.549789948768648e-8  # parts; their sum is pi / 2
_LN_2 = 0.693359375, -2.12194440e-4
_OVERFLOW, _UNDERFLOW = 89.0, -104.0  # beyond them exp is infinite, or 0
_NORMAL = 2.0**-126
_SQRT_HALF = 0x3F3504F3  # sqrt(1/2) in float32
_SIGN = -(1 << 31)


def exp(x: Any) -> Any:
    """e^x; infinite or 0 where float32 is."""
    x = _float_of("max", x, _literal(x, _UNDERFLOW))
    x = _float_of("min", x, _literal(x, _OVERFLOW))
    n, power = _rounded(x, 1.0 / math.log(2.0))
    r = _fma(n, -_LN_2[1], _fma(n, -_LN_2[0], x))
    p = _fma(_polynomial(_EXP, r), r * r, r) + _literal(x, 1.0)
    half = power >> 1  # either half of the power is a normal number
    return p * _power_of_two(half) * _power_of_two(power - half)


def log(x: Any) -> Any:
    """Natural logarithm; minus infinity at 0, and not a number below."""
    small = x < _literal(x, _NORMAL)
    scaled = _choose(small, x * _literal(x, 2.0**23), x)
    bits = _bits(scaled)
    n = (bits - _whole(x, _SQRT_HALF)) >> 23
    f = _float_of("from_bits", bits - (n << 23)) - _literal(x, 1.0)
    whole = _float_of("to_float", n)
    e = _choose(small, whole - _literal(x, 23.0), whole)
    z = f * f
    tail = _fma(e, _LN_2[1], _polynomial(_LOG, f) * f * z)
    result = _fma(e, _LN_2[0], f + _fma(z, -0.5, tail))
    infinite = x == _literal(x, math.inf)
    outside = _choose(x == _literal(x, 0.0), _literal(x, -math.inf), _literal(x, math.nan))
    return _choose(x > _literal(x, 0.0), _choose(infinite, x, result), outside)


def sin(x: Any) -> Any:
    """Sine, for angles up to some thousands."""
    return _circular(x, 0)


def cos(x: Any) -> Any:
    """Cosine, for angles up to some thousands."""
    return _circular(x, 1)


def _circular(x: Any, quarter: int) -> Any:
    """Sine of x plus quarters of a turn."""
    n, turns = _rounded(x, 2.0 / math.pi)
    r = x
    for part in _HALF_PI:
        r = _fma(n, -part, r)
    z = r * r
    sine = _fma(_polynomial(_SIN, z) * z, r, r)
    cosine = _fma(_polynomial(_COS, z) * z, z, _fma(z, -0.5, _literal(x, 1.0)))
    turns = turns + quarter
    value = _choose((turns & 1) == 0, sine, cosine)
    return _float_of("from_bits", _bits(value) ^ ((turns & 2) << 30))


def arctan2(y: Any, x: Any) -> Any:
    """Angle in [-pi, pi] of the point (x, y); for zeros, by their signs."""
    across, along = _float_of("abs", y), _float_of("abs", x)
    steep = across > along
    low, high = _choose(steep, along, across), _choose(steep, across, along)
    # Above tan(pi / 8), the angle to the diagonal.
    far = low > high * _literal(x, math.tan(math.pi / 8.0))
    above = _choose(far, low - high, low)
    below = _choose(far, low + high, high)
    t = above / _choose(high == _literal(x, 0.0), _literal(x, 1.0), below)
    z = t * t
    angle = _fma(_polynomial(_ATAN, z) * z, t, t)
    angle = _choose(far, angle + _literal(x, math.pi / 4.0), angle)
    angle = _choose(steep, _literal(x, math.pi / 2.0) - angle, angle)
    angle = _choose(_bits(x) < _whole(x, 0), _literal(x, math.pi) - angle, angle)
    return _float_of("from_bits", _bits(angle) ^ (_bits(y) & _SIGN))


def arcsin(x: Any) -> Any:
    """Angle in [-pi / 2, pi / 2] of a sine; not a number beyond 1."""
    one = _literal(x, 1.0)
    return arctan2(x, _float_of("sqrt", (one - x) * (one + x)))


def _rounded(x: Any, factor: float) -> tuple[Any, Any]:
    """`x` times a factor, rounded: as a float and as an index."""
    shifted = _fma(x, factor, _literal(x, _ROUND))
    return shifted - _literal(x, _ROUND), _bits(shifted) - _bits(_literal(x, _ROUND))


def _polynomial(coefficients: Sequence[float], x: Any) -> Any:
    """Horner's rule, from the highest power down."""
    total = _literal(x, coefficients[0])
    for coefficient in coefficients[1:]:
        total = _fma(total, x, _literal(x, coefficient))
    return total


def _power_of_two(n: Any) -> Any:
    return _float_of("from_bits", (n + 127) << 23)


def _literal(like: Any, value: float) -> Any:
    return like.trace.literal(value)


def _whole(like: Any, value: int) -> Any:
    return like.trace.index(value)


def _fma(a: Any, b: Any, c: Any) -> Any:
    """The sum of a b and c, rounded once; b may be a number."""
    return _float_of("fma", a, _literal(a, b) if isinstance(b, float) else b, c)


def _float_of(name: str, x: Any, *others: Any) -> Any:
    return x.trace.add("float", name, x, *others)


def _choose(condition: Any, a: Any, b: Any) -> Any:
    return a.trace.add(a.kind, "where", condition, a, b)


def _bits(x: Any) -> Any:
    return x.trace.add("index", "bits", x)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "exp": exp, "log": log, "sin": sin, "cos": cos, "arcsin": arcsin, "arctan2": arctan2,
}  # fmt: skip
"""By the names of :class:`nacre.array.Namespace`."""
