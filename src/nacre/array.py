"""One formula, four array libraries.

Reflectance formulas in this package are written on *components*: plain tuples of arrays, one array
per coordinate or color channel. The functions of a :class:`Namespace` do the arithmetic that
operators cannot, so the same formula runs on NumPy arrays, PyTorch tensors, JAX arrays and Dr.Jit
arrays (where it is traced into a renderer's kernel).

Types of NumPy arrays say their shapes, for type checkers and readers (see jaxtyping); nothing is
checked when the code runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = Any
"""A float, a NumPy array, a PyTorch tensor, a JAX array or a Dr.Jit array."""

Components: TypeAlias = tuple[Array, Array, Array]
"""Three arrays of one shape: the coordinates of a vector or the channels of a color."""

Floats: TypeAlias = npt.NDArray[np.floating]
"""NumPy array of float32 or float64, of any shape."""

Weights: TypeAlias = npt.NDArray[np.float32]
"""NumPy array of float32, of any shape."""

Doubles: TypeAlias = npt.NDArray[np.float64]
"""NumPy array of float64, of any shape."""

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    Vectors: TypeAlias = Float[Floats, "*batch 3"]
    Colors: TypeAlias = Float[Floats, "*batch 3"]
    Spectra: TypeAlias = Float[Floats, "*batch bands"]
    Scalars: TypeAlias = Float[Floats, "*batch"]
    Mask: TypeAlias = Bool[npt.NDArray[np.bool_], "*batch"]
    VectorList: TypeAlias = Float[Floats, "n 3"]
    ColorList: TypeAlias = Float[Floats, "n 3"]
    SpectrumList: TypeAlias = Float[Floats, "n bands"]
else:
    Vectors = Colors = Spectra = Scalars = VectorList = ColorList = SpectrumList = Floats
    Mask = npt.NDArray[np.bool_]
Image: TypeAlias = npt.NDArray[np.float32]
"""A picture, shape (height, width, 3): linear Rec. 709 RGB."""

_TINY = 2.0**-126  # the smallest normal number of single precision

_ALIGNMENT = 64  # bytes; of a line of the cache, and of the widest vectors


def aligned_zeros(
    shape: int | tuple[int, ...], dtype: npt.DTypeLike = np.float32
) -> npt.NDArray[Any]:
    """Zeros that begin at a cache line, as vector code expects.

    NumPy's own arrays are placed by chance: Dr.Jit, which takes their memory as it is, reads
    numbers one by one where several may straddle lines, and kernels over them take up to twice as
    long in some processes as in others.
    """
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + _ALIGNMENT, np.uint8)
    start = -raw.ctypes.data % _ALIGNMENT
    return raw[start : start + size].view(dtype).reshape(shape)


class Table:
    """A constant float32 array that any array library can gather from.

    `values`, of any shape, are gathered by flat (C order) index.
    """

    def __init__(self, values: npt.ArrayLike) -> None:
        self.values = np.ascontiguousarray(values, dtype=np.float32)
        self._copies: dict[Any, Any] = {}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and np.array_equal(
            self.values, other.values, equal_nan=True
        )

    def __hash__(self) -> int:
        return hash(self.values.shape)

    def flat(self, key: Any, make: Callable[[npt.NDArray[np.float32]], Any]) -> Any:
        """The flattened values as another library's array, made once per `key`."""
        if key not in self._copies:
            self._copies[key] = make(self.values.reshape(-1))
        return self._copies[key]


class Namespace:
    """Elementwise functions of one array library, under NumPy's names."""

    library: str = "numpy"  # its name
    differentiable: bool = False
    """Whether arrays may carry gradients, which :meth:`matched` and the methods after
    it are for."""
    sqrt: Callable[[Array], Array]
    exp: Callable[[Array], Array]
    log: Callable[[Array], Array]
    sin: Callable[[Array], Array]
    cos: Callable[[Array], Array]
    arcsin: Callable[[Array], Array]
    arctan2: Callable[[Array, Array], Array]
    floor: Callable[[Array], Array]
    abs: Callable[[Array], Array]
    minimum: Callable[[Array, Array], Array]
    maximum: Callable[[Array, Array], Array]
    where: Callable[[Array, Array, Array], Array]
    to_index: Callable[[Array], Array]
    """Truncate non-negative floats to integers usable in :attr:`take`."""
    to_float: Callable[[Array, Array], Array]
    """`to_float(index, like)`: integers as floats of the type of `like`."""
    take: Callable[[Table, Array], Array]
    """`take(table, index)`: gather by flat index."""

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        """`values @ weights + biases` for a small layer with constant weights.

        `values` are one array or number per input; weights and biases have shapes (inputs, outputs)
        and (outputs,).
        """
        raise NotImplementedError

    def join(self, components: Sequence[Array]) -> Array:
        """One array of shape (..., components) from arrays or numbers that broadcast."""
        return np.stack(np.broadcast_arrays(*components), axis=-1)

    def matched(self, *arrays: Any) -> tuple[Array, ...]:
        """Arrays of this library, whatever they come as: on one device, with one floating type,
        which is double if one of theirs is, else single.
        """
        raise NotImplementedError

    def peek(self, array: Array) -> Floats | None:
        """The numbers, to be read only; None in a trace or where a device would have to finish."""
        raise NotImplementedError

    def follows(self, *arrays: Array) -> bool:
        """Whether what is computed from arrays has to carry gradients or a trace."""
        raise NotImplementedError


class _NumPy(Namespace):
    def __init__(self) -> None:
        self.sqrt, self.exp, self.log = np.sqrt, np.exp, np.log
        self.sin, self.cos, self.arcsin, self.arctan2 = np.sin, np.cos, np.arcsin, np.arctan2
        self.floor, self.abs, self.where = np.floor, np.abs, np.where
        self.minimum, self.maximum = np.minimum, np.maximum
        self.to_index = lambda x: np.asarray(x).astype(np.int64)
        self.to_float = lambda i, like: np.asarray(i).astype(np.asarray(like).dtype)
        self.take = lambda table, i: table.values.reshape(-1)[i]

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        # One matrix product: a sum over components would make a temporary array a weight.
        # A plain number must not decide the precision.
        dtype = np.result_type(*(v for v in values if type(v) is not float))
        stacked = np.stack(np.broadcast_arrays(*values), dtype=dtype)
        product = np.tensordot(weights.T.astype(stacked.dtype, copy=False), stacked, axes=1)
        return list(product + biases.reshape(-1, *[1] * (stacked.ndim - 1)))


class _Torch(Namespace):
    library, differentiable = "torch", True

    def __init__(self) -> None:
        import torch

        def take(table: Table, index: Array) -> Array:
            device = index.device
            return table.flat(device, lambda v: torch.from_numpy(v.copy()).to(device))[index]

        def binary(function: Callable[[Array, Array], Array]) -> Callable[[Array, Array], Array]:
            def call(a: Array, b: Array) -> Array:
                like = a if isinstance(a, torch.Tensor) else b
                options = {"dtype": like.dtype, "device": like.device}
                return function(torch.as_tensor(a, **options), torch.as_tensor(b, **options))

            return call

        def bound(side: str, function: Callable[[Array, Array], Array]) -> Any:
            either = binary(function)

            def call(a: Array, b: Array) -> Array:
                # Numbers need not become tensors, which takes longer than the bound.
                return a.clamp(**{side: b}) if isinstance(b, float | int) else either(a, b)

            return call

        def arctan2(y: Array, x: Array) -> Array:
            return torch.arctan2(y, torch.where(x * x + y * y < _TINY, 1.0, x))

        # The root at 0 and the angle at the origin have no derivative; here it is 0.
        self.sqrt, self.arctan2 = lambda x: x.clamp(min=_TINY).sqrt(), binary(arctan2)
        self.exp, self.log = torch.exp, torch.log
        self.sin, self.cos, self.arcsin = torch.sin, torch.cos, torch.arcsin
        self.floor, self.abs, self.where = torch.floor, torch.abs, torch.where
        self.minimum, self.maximum = bound("max", torch.minimum), bound("min", torch.maximum)
        self.to_index = lambda x: x.long()
        self._torch = torch
        self.to_float = lambda i, like: i.to(like.dtype)
        self.take = take

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        stacked = self.join(values)
        options = {"dtype": stacked.dtype, "device": stacked.device}
        rows, columns = (self._torch.tensor(w, **options) for w in (weights, biases))
        return list((stacked @ rows + columns).unbind(-1))

    def join(self, components: Sequence[Array]) -> Array:
        like = next(c for c in components if isinstance(c, self._torch.Tensor))
        options = {"dtype": like.dtype, "device": like.device}
        tensors = (self._torch.as_tensor(c, **options) for c in components)
        return self._torch.stack(self._torch.broadcast_tensors(*tensors), -1)

    def matched(self, *arrays: Any) -> tuple[Array, ...]:
        torch = self._torch
        device = next(a.device for a in arrays if isinstance(a, torch.Tensor))
        tensors = [
            a if isinstance(a, torch.Tensor) else torch.tensor(a, device=device) for a in arrays
        ]
        dtype = torch.float64 if any(t.dtype == torch.float64 for t in tensors) else torch.float32
        return tuple(tensor.to(dtype) for tensor in tensors)

    def peek(self, array: Array) -> Floats | None:
        if self._torch.compiler.is_compiling() or array.device.type != "cpu":
            return None
        try:
            numbers: Floats = array.detach().numpy()
        except RuntimeError:  # of tensors that stand for many, as in torch.func.vmap
            return None
        return numbers

    def follows(self, *arrays: Array) -> bool:
        return self._torch.is_grad_enabled() and any(array.requires_grad for array in arrays)


class _Jax(Namespace):
    library, differentiable = "jax", True

    def __init__(self) -> None:
        import jax
        import jax.numpy as jnp

        def take(table: Table, index: Array) -> Array:
            with jax.ensure_compile_time_eval():  # what a trace makes cannot be kept
                return table.flat("jax", jnp.asarray)[index]

        def arctan2(y: Array, x: Array) -> Array:
            return jnp.arctan2(y, jnp.where(x * x + y * y < _TINY, 1.0, x))

        self.sqrt, self.arctan2 = lambda x: jnp.sqrt(jnp.maximum(x, _TINY)), arctan2  # as above
        self.exp, self.log = jnp.exp, jnp.log
        self.sin, self.cos, self.arcsin = jnp.sin, jnp.cos, jnp.arcsin
        self.floor, self.abs, self.where = jnp.floor, jnp.abs, jnp.where
        self.minimum, self.maximum = jnp.minimum, jnp.maximum
        self.to_index = lambda x: x.astype(int)
        self.to_float = lambda i, like: i.astype(like.dtype)
        self.take = take
        self._jax, self._numpy = jax, jnp

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        stacked = self.join(values)
        rows, columns = (self._numpy.asarray(w, stacked.dtype) for w in (weights, biases))
        # What is fastest on a GPU or TPU has 8 or 11 bits.
        return list(
            self._numpy.unstack(
                self._numpy.matmul(stacked, rows, precision="highest") + columns, axis=-1
            )
        )

    def join(self, components: Sequence[Array]) -> Array:
        return self._numpy.stack(self._numpy.broadcast_arrays(*components), -1)

    def matched(self, *arrays: Any) -> tuple[Array, ...]:
        found = [self._numpy.asarray(a) for a in arrays]
        double = any(a.dtype == np.float64 for a in found)
        return tuple(a.astype(np.float64 if double else np.float32) for a in found)

    def peek(self, array: Array) -> Floats | None:
        if self.follows(array) or any(device.platform != "cpu" for device in array.devices()):
            return None
        return np.asarray(array)

    def follows(self, *arrays: Array) -> bool:
        return any(isinstance(array, self._jax.core.Tracer) for array in arrays)


class _DrJit(Namespace):
    library = "drjit"

    def __init__(self) -> None:
        import drjit as dr

        def take(table: Table, index: Array) -> Array:
            kind: Any = dr.float32_array_t(type(index))
            return dr.gather(kind, table.flat(kind, kind), index)

        self.sqrt, self.exp, self.log = dr.sqrt, dr.exp, dr.log
        self.sin, self.cos, self.arcsin, self.arctan2 = dr.sin, dr.cos, dr.asin, dr.atan2
        self.floor, self.abs, self.where = dr.floor, dr.abs, dr.select
        self.minimum, self.maximum = dr.minimum, dr.maximum
        self.to_index = lambda x: dr.uint32_array_t(type(x))(x)
        self.to_float = lambda i, like: type(like)(i)
        self.take = take
        self._fma = dr.fma

    def dense(self, values: Sequence[Array], weights: Weights, biases: Weights) -> list[Array]:
        # Numbers become literals of the kernel, which does not fuse sums and products by itself.
        totals: list[Array] = biases.tolist()
        for value, row in zip(values, weights.tolist(), strict=True):
            if isinstance(value, float) and value == 0.0:
                continue
            totals = [self._fma(w, value, total) for w, total in zip(row, totals, strict=True)]
        return totals


LIBRARIES: dict[str, Callable[[], Namespace]] = {
    **{"torch": _Torch, "jax": _Jax, "jaxlib": _Jax, "drjit": _DrJit, "mitsuba": _DrJit}
}
"""Functions on the arrays of a library, by the first part of the names of its modules."""
_made: dict[Callable[[], Namespace], Namespace] = {}


def namespace(*arrays: Array) -> Namespace:
    """The namespace of the library that `arrays` belong to; NumPy where all are plain numbers.

    Examples
    --------
    >>> float(namespace(2.0).sqrt(4.0))
    2.0
    """
    kinds = (LIBRARIES.get(type(array).__module__.partition(".")[0]) for array in arrays)
    kind = next((kind for kind in kinds if kind), _NumPy)
    if kind not in _made:  # no functools.cache, which torch.compile warns of
        _made[kind] = kind()
    return _made[kind]
