"""Arrays of pairs of directions, and of directions and random numbers: checked and evaluated.

Formulas on components are evaluated by NumPy, or compiled (:mod:`nacre.compile.vectorized`). The
choice depends on the formula's owner and the type of the numbers, never on how many there are: the
same pair gives the same bits wherever it stands.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, Weights, namespace
from nacre.compile.data import as_data
from nacre.io.memory import available_memory
from nacre.numerics.exchange import numbers
from nacre.objects.frozen import Frozen

if TYPE_CHECKING:
    from nacre.compile.vectorized import VectorFunction

Formula: TypeAlias = Callable[[Any, Components, Components], tuple[Array | Components, ...]]
"""From an object and two vectors to arrays, of a value or a vector each."""

UNIT_TOLERANCE = 1e-3
"""How far the length of a direction may be from 1: float32 leaves 1e-7, sums of many 1e-4."""

_CHUNK = 1 << 14  # pairs evaluated at a time: intermediate arrays stay in the cache
_LOW, _HIGH = (1.0 - UNIT_TOLERANCE) ** 2, (1.0 + UNIT_TOLERANCE) ** 2  # squares of lengths
_BELOW_ONE = float(np.nextafter(np.float32(1.0), np.float32(0.0)))

_MIN_MEMORY = 256 << 20

_known: dict[tuple[int, Formula], VectorFunction | None] = {}


def compiled(owner: Frozen, formula: Formula, **named: npt.ArrayLike) -> list[Weights] | None:
    """A formula of an object on two arrays of shapes (..., 3) that broadcast, by machine code.

    None where a number is float64, where the formula does not compile, and where shapes do not fit:
    what :func:`checked` says then holds. Raises ValueError as that does.
    """
    given = [numbers(array) for array in named.values()]
    if any(array.dtype == np.float64 or array.shape[-1:] != (3,) for array in given):
        return None
    function = _function(owner, formula, tuple(named))
    if function is None:
        return None
    singles = [array.astype(np.float32, copy=False) for array in given]
    try:
        shape = np.broadcast_shapes(*(array.shape for array in singles))
    except ValueError:
        return None
    if 0 in shape:
        return None
    a, b = (np.broadcast_to(array, shape).reshape(-1, 3) for array in singles)
    found, fault = function(np.ascontiguousarray(a), np.ascontiguousarray(b))
    if fault:
        checked(**named)
    return [x.reshape(shape if x.ndim == 2 else shape[:-1]) for x in found]


def _function(owner: Frozen, formula: Formula, names: tuple[str, ...]) -> VectorFunction | None:
    """The compiled formula, made once as long as its owner exists."""
    if not owner.closed:
        return None
    key = id(owner), formula
    if key not in _known:
        _known[key] = _made(owner, formula, names)
        weakref.finalize(owner, _known.pop, key, None).atexit = False
    return _known[key]


def _made(owner: Frozen, formula: Formula, names: tuple[str, ...]) -> VectorFunction | None:
    def with_faults(a: Components, b: Components) -> tuple[Any, Array]:
        good = [_is_good(name, values) for name, values in zip(names, (a, b), strict=True)]
        a, b = (inside(name, values) for name, values in zip(names, (a, b), strict=True))
        return formula(as_data(owner), a, b), ~(good[0] & good[1])

    left = available_memory()
    if left is not None and left < _MIN_MEMORY:  # LLVM would end the process
        return None
    try:
        from nacre.compile.vectorized import VectorFunction

        return VectorFunction(with_faults)
    except Exception:  # what NumPy then says is clearer
        return None


def _is_good(name: str, values: Components) -> Array:
    x, y, z = values
    if name != "u":
        square = x * x + y * y + z * z
        return (square >= _LOW) & (square <= _HIGH)
    return (x >= 0.0) & (x <= 1.0) & (y >= 0.0) & (y <= 1.0) & (z >= 0.0) & (z <= 1.0)


def inside(name: str, values: Components) -> Components:
    """Directions, or random numbers "u", as :func:`checked` returns them."""
    if name != "u":
        return values
    u, v, w = (namespace(x).minimum(x, _BELOW_ONE) for x in values)
    return u, v, w


def checked(**named: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Two arrays of directions, or of directions and numbers `u`, of one shape and type, checked.

    Raises ValueError if a shape is not (..., 3), or for numbers that are not what they should be.
    """
    arrays = {name: numbers(given) for name, given in named.items()}
    double = any(array.dtype == np.float64 for array in arrays.values())
    for name, array in arrays.items():
        if array.shape[-1:] != (3,):
            raise ValueError(f"expected {name} of shape (..., 3), got {array.shape}")
        array = array.astype(np.float64 if double else np.float32, copy=False)
        arrays[name] = (_below_one if name == "u" else check_unit)(name, array)
    a, b = np.broadcast_arrays(*arrays.values())
    return a, b


def check_unit(name: str, w: Floats) -> Floats:
    flat = w.reshape(-1, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, len(flat), _CHUNK):
            squares = _squared_lengths(flat[start : start + _CHUNK])
            if not (squares.min() >= _LOW and squares.max() <= _HIGH):  # also for NaN
                break
        else:
            return w
        lengths = np.sqrt(_squared_lengths(flat.astype(np.float64)))
    # Squares of float32 may be off by their rounding; these are not.
    off = ~((lengths >= 1.0 - UNIT_TOLERANCE) & (lengths <= 1.0 + UNIT_TOLERANCE))
    if not off.any():
        return w
    worst = lengths[off][np.argmax(np.abs(lengths[off] - 1.0))]
    raise ValueError(
        f"{name}: {off.sum()} of {off.size} directions are not of unit length "
        f"(the worst is {worst:.4g} long); divide them by their length"
    )


def _squared_lengths(flat: Floats) -> Floats:
    squares = flat * flat  # of whole memory lines; several times faster than einsum
    total: Floats = squares[:, 0] + squares[:, 1] + squares[:, 2]
    return total


def _below_one(name: str, u: Floats) -> Floats:
    """Numbers, checked; 1, to which random numbers may be rounded, becomes the one below it."""
    off = ~((u >= 0.0) & (u <= 1.0))
    if off.any():
        worst = u[off][np.argmax(np.abs(u[off] - 0.5))]
        count = f"{off.sum()} of {off.size} numbers"
        raise ValueError(f"{name}: {count} are not in [0, 1) (the worst is {worst:g})")
    return np.minimum(u, np.nextafter(u.dtype.type(1.0), u.dtype.type(0.0)))


def in_chunks(
    function: Callable[[Floats, Floats], Array],
    wi: Floats,
    wo: Floats,
    tail: tuple[int, ...],
    dtype: npt.DTypeLike | None = None,
) -> npt.NDArray[Any]:
    """`function` on flattened chunks of direction pairs, reassembled to their shape."""
    shape = wi.shape[:-1]
    wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
    out = np.empty((len(wi), *tail), dtype=dtype or wi.dtype)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for start in range(0, len(wi), _CHUNK):
            part = slice(start, start + _CHUNK)
            out[part] = function(wi[part], wo[part])
    return out.reshape(shape + tail)
