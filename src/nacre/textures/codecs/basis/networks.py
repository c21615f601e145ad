"""Smooth functions of a light and a view, whose weighted sums are apparent BRDFs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, aligned_zeros, namespace
from nacre.compile.compilation import Compiled
from nacre.geometry import dot, half_vector, split, stereographic
from nacre.numerics.mlp import SILU, AnyLayer, Layer, dense
from nacre.objects.content import stored
from nacre.runtime.parallel import one_blas_thread, thread_slices
from nacre.textures.codecs.basis.tile_sizes import BLOCK, ROWS, padded, panels

_CHUNK = 1 << 10  # pairs of directions at a time
_SHARPEST = 0.005  # added to the sine of half-vector angles, so that their logarithm is bounded
INPUTS = 12  # values that the network sees

_slopes = Compiled("nacre.textures.codecs.basis.projection_loops:slopes")


class FunctionValues(NamedTuple):
    """The functions at n pairs of directions: the mean that all texels have, shape (n,), and what
    is summed, shapes (n, luma_count) and (n, chroma_count).
    """

    mean: Floats
    luma: Floats
    chroma: Floats

    def at(self, chosen: npt.NDArray[np.intp] | slice) -> FunctionValues:
        return FunctionValues(self.mean[chosen], self.luma[chosen], self.chroma[chosen])

    def products(self, luma: Floats, chroma: Iterable[Floats]) -> Floats:
        """Sums over pairs of the functions times luma (b, n) and chroma, two of (b, n): (b, K)."""
        return np.concatenate([luma @ self.luma, *(c @ self.chroma for c in chroma)], axis=1)


@dataclass(frozen=True, eq=False)
class AngularFunctions:
    """Functions that a network gives for a pair of directions.

    The hidden layers have one width; after them comes a wide one: the more units it has, the better
    the last layer can combine them. The last gives the mean, then `luma_count` functions for luma,
    then those for chroma. All layers but the last are followed by x / (1 + exp(-x)); all hidden
    ones but the first add to what came before them. Roots of reflectance are sums of the functions,
    as luma and chroma, see :mod:`nacre.textures.codecs.basis.colors`.

    A ValueError says that layers do not chain, or that `luma_count` is out of range.
    """

    hidden: Sequence[Layer]
    wide: Layer
    last: Layer
    luma_count: int = field(metadata={"file": "greys"})

    def __post_init__(self) -> None:
        width = _outputs(INPUTS, [*self.hidden, self.wide, self.last])
        if not 0 < self.luma_count < width or len({len(h.biases) for h in self.hidden}) != 1:
            raise ValueError(f"{self.luma_count} of {width - 1} functions are of luma")

    @property
    def chroma_count(self) -> int:
        return len(self.last.biases) - 1 - self.luma_count

    def __call__(self, wi: Floats, wo: Floats) -> FunctionValues:
        """The functions at pairs of unit directions, shapes (n, 3)."""

        def at(part: slice) -> Floats:
            inputs = direction_inputs(wi[part], wo[part])
            return np.asarray(dense(wide_features(inputs, self.hidden, self.wide), self.last))

        with one_blas_thread():
            chunks = thread_slices(at, len(wi), _CHUNK)
        values = np.concatenate(chunks) if chunks else np.empty((0, len(self.last.biases)))
        mean, luma, chroma = np.split(values, [1, 1 + self.luma_count], axis=1)
        return FunctionValues(mean[:, 0].copy(), np.ascontiguousarray(luma), chroma.copy())


def wide_features(values: Any, hidden: Sequence[AnyLayer], wide: AnyLayer) -> Any:
    """The inputs of the last layer of :class:`AngularFunctions`, in any array library."""
    first, *others = hidden
    state = dense(values, first, SILU)
    for layer in others:
        state = state + dense(state, layer, SILU)
    return dense(state, wide, SILU)


def direction_inputs(wi: Floats, wo: Floats) -> Floats:
    """Inputs of the network for pairs of directions: shape (n, :data:`INPUTS`), about within -2..2.

    Stereographic light, view and half vector, which have no pole to be rough at; the cosines; and
    logarithms of the angles between light and view and between half vector and normal, in which
    highlights of any width are smooth.
    """
    a, b = split(wi.astype(np.float64)), split(wo.astype(np.float64))
    return np.stack(direction_components(a, b), axis=-1).astype(np.float32)


def direction_components(wi: Components, wo: Components) -> list[Array]:
    """The same as a list, for components from any array library."""
    xp = namespace(*wi, *wo)
    half = half_vector(wi, wo)
    cosine = xp.minimum(xp.maximum(dot(wi, wo), -1.0), 1.0)
    return [
        *(1.5 * c for w in (wi, wo, half) for c in stereographic(w)),
        *(2.0 * w[2] - 1.0 for w in (wi, wo, half)),
        cosine,
        xp.log(_SHARPEST + 1.0 - half[2]) / 2.0 + 1.5,
        xp.log(_SHARPEST + 1.0 - cosine) / 2.0 + 1.0,
    ]


@dataclass(frozen=True, eq=False)
class SkipNetwork:
    """x @ linear + network(x): what is nearly linear needs only a small network.

    `linear` has shape (inputs, outputs). All layers of the network but the last are followed by x /
    (1 + exp(-x)); it may see more inputs than the linear map, see :meth:`given`. A ValueError says
    that the layers do not chain from the inputs to the outputs.
    """

    linear: Floats
    layers: Sequence[Layer]

    def __post_init__(self) -> None:
        inputs, outputs = self.linear.shape
        seen = max(inputs, len(self.layers[0].weights)) if self.layers else inputs
        width = _outputs(seen, self.layers)
        if len(self.layers) < 2 or width != outputs:
            raise ValueError(f"layers end in {width} values, the linear map in {outputs}")

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: not what is made from it, which must be aligned in memory."""
        return stored(self)

    @classmethod
    def identity(cls, size: int) -> SkipNetwork:
        """The network that changes nothing."""
        none = Layer(np.zeros((size, 1), np.float32), np.zeros(1, np.float32))
        last = Layer(np.zeros((1, size), np.float32), np.zeros(size, np.float32))
        return cls(np.eye(size, dtype=np.float32), [none, last])

    @cached_property
    def is_identity(self) -> bool:
        last = self.layers[-1]
        square = self.linear.shape[0] == self.linear.shape[1]
        plain = square and np.array_equal(self.linear, np.eye(len(self.linear)))
        return plain and not last.weights.any() and not last.biases.any()

    def given(self, further: Floats) -> SkipNetwork:
        """The network with the inputs held fixed that the linear map does not see."""
        first, *others = self.layers
        inputs = len(self.linear)
        biases = np.asarray(first.biases + further @ first.weights[inputs:], np.float32)
        return SkipNetwork(self.linear, [Layer(first.weights[:inputs], biases), *others])

    def __call__(self, x: Floats) -> Floats:
        """Outputs (b, outputs) of inputs (b, inputs)."""
        *hidden, last = self.layers
        state = x
        for layer in hidden:
            state = dense(state, layer, SILU)
        result: Floats = x @ self.linear + state @ last.weights + last.biases
        return result

    @cached_property
    def _tiles(self) -> tuple[Floats, npt.NDArray[np.int64], Floats, Floats]:
        """What derivatives are made of, padded for the compiled loop: weights of the first layer,
        units of every layer, weights of the others, the linear map.
        """
        first, *others = (layer.weights for layer in self.layers)
        rows = padded(len(first), ROWS)
        sizes = [padded(w.shape[1], BLOCK) for w in (first, *others)]
        following = [
            panels(w, columns=size).reshape(-1) for w, size in zip(others, sizes[1:], strict=True)
        ]
        weights = aligned_zeros(sum(part.size for part in following))
        np.concatenate(following, out=weights)
        start, linear = aligned_zeros((rows, sizes[0])), aligned_zeros((rows, sizes[-1]))
        for whole, part in ((start, first), (linear, self.linear)):
            whole[: len(part), : part.shape[1]] = part
        return start.reshape(-1), np.array(sizes, np.int64), weights, linear.reshape(-1)

    def jacobian(self, x: Floats) -> tuple[Floats, Floats]:
        """Outputs (b, outputs), and their derivatives by the inputs (b, inputs, outputs)."""
        *hidden, last = self.layers
        first, sizes, weights, linear = self._tiles
        rows, at = linear.size // sizes[-1], 0
        scales = np.zeros((len(x), sizes[:-1].sum()), np.float32)
        state = x
        for layer, size in zip(hidden, sizes, strict=False):
            state, slope = _silu_and_slope(state @ layer.weights + layer.biases)
            scales[:, at : at + slope.shape[1]] = slope
            at += size
        value = x @ self.linear + state @ last.weights + last.biases
        slopes = np.empty((len(x), rows, sizes[-1]), np.float32)
        scaled, made = (aligned_zeros(rows * sizes.max()) for _ in range(2))
        _slopes(first, sizes, weights, scales, linear, scaled, made, slopes)
        inputs, outputs = self.linear.shape
        return value, np.ascontiguousarray(slopes[:, :inputs, :outputs])


def _outputs(width: int, layers: Sequence[Layer]) -> int:
    """The number of values that layers give; refuses layers that do not chain."""
    for layer in layers:
        if layer.weights.shape != (width, len(layer.biases)):
            raise ValueError(f"a layer of shape {layer.weights.shape} follows {width} values")
        width = len(layer.biases)
    return width


def _silu_and_slope(x: Floats) -> tuple[Floats, Floats]:
    sigmoid = 1.0 / (1.0 + np.exp(-np.clip(x, -60.0, 60.0)))
    value = x * sigmoid
    return value, sigmoid + value * (1.0 - sigmoid)
