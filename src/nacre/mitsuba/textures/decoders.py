"""Reflectance of texels at hits: from functions in a table, or from the networks of a codec."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeAlias

import numpy as np

from nacre.array import Components, Floats
from nacre.errors import require
from nacre.geometry import stereographic
from nacre.mitsuba.network import pack_layers, takes_half
from nacre.mitsuba.textures.hit_network import HitNetwork
from nacre.mitsuba.textures.texels import Corners, Records, jitters
from nacre.numerics.mlp import SILU, Layer, dense, forward
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.codecs.basis.networks import direction_components, wide_features
from nacre.textures.factors import CHROMAS, LUMAS, Factors, grid_place

Weighed: TypeAlias = "list[tuple[list[Any], Any]]"
"""For each texel around a hit, weights of functions, and the weight of the texel."""


class HitDecoder(Protocol):
    """Reflectance at hits, on arrays of a JIT variant."""

    def texels(self, corners: Corners) -> Any:
        """What a hit needs from the texels around it, for all directions."""
        ...

    def reflectance(self, texels: Any, wi: Components, wo: Components) -> Components:
        """Reflectance factors pi f_r, never negative, linear RGB; directions in the texture's
        frame.
        """
        ...


class _AngleGrid:
    """A grid over pairs of directions, linear between its nodes, `resolution` along each of four
    axes.

    The pair of light p and view q has index p * resolution^2 + q. In stochastic mode one of the
    sixteen nodes around a pair is chosen with its weight as probability; the same pair always has
    the same node.
    """

    def __init__(self, mi: Any, resolution: int, stochastic: bool) -> None:
        self._mi, self._resolution, self._stochastic = mi, resolution, stochastic

    def interpolated(self, records: Records, wi: Components, wo: Components) -> list[Any]:
        mi, dr = self._mi, require("drjit", "render")
        size = self._resolution
        # The least significant axis is the view's x.
        places = [*grid_place(wo, size), *grid_place(wi, size)]
        strides = [size**k for k in range(4)]
        if self._stochastic:
            shifts = jitters(mi, (wi[0], wi[1], wo[0], wo[1]), 4)
            index = mi.UInt32(0)
            for place, shift, stride in zip(places, shifts, strides, strict=True):
                index += mi.UInt32(dr.minimum(place + shift, size - 0.5)) * stride
            return records.at([(index, mi.Float(1.0))])
        first = [dr.minimum(mi.UInt32(place), size - 2) for place in places]
        after = [place - mi.Float(low) for place, low in zip(places, first, strict=True)]

        def add(corner: Any, total: list[Any]) -> tuple[Any, list[Any]]:
            index, weight = mi.UInt32(0), mi.Float(1.0)
            for axis, (low, part, stride) in enumerate(zip(first, after, strides, strict=True)):
                step = (corner >> axis) & 1
                index += (low + step) * stride
                weight *= dr.select(step == 1, part, 1.0 - part)
            values = records.at([(index, mi.Float(1.0))])
            return corner + 1, [dr.fma(v, weight, t) for v, t in zip(values, total, strict=True)]

        # As a loop it compiles sixteen times as fast.
        zeros = [mi.Float(0.0)] * records.numbers
        _, total = dr.while_loop((mi.UInt32(0), zeros), lambda corner, _: corner < 16, add)
        return list(total)


class TableDecoder(HitDecoder):
    """Sums of a texture's own functions, which lie in a table."""

    def __init__(self, mi: Any, factors: Factors, stochastic: bool) -> None:
        self._weights = Records(mi, factors.weights, half=True)
        self._functions = Records(mi, factors.functions, half=True)
        self._grid = _AngleGrid(mi, factors.resolution, stochastic)

    def texels(self, corners: Corners) -> Weighed:
        return [(self._weights[index], weight) for index, weight in corners]

    def reflectance(self, texels: Weighed, wi: Components, wo: Components) -> Components:
        functions = self._grid.interpolated(self._functions, wi, wo)
        return _joined(texels, functions, LUMAS, CHROMAS)


class BasisDecoder(HitDecoder):
    """The default codec's networks at every hit, for codes of shape (texels, values).

    If `expanded`, coefficients of all texels are kept in memory, not computed at every hit. With
    half precision, weights, codes and coefficients have 16 bits.
    """

    def __init__(
        self, mi: Any, codec: BasisCodec, codes: Floats, expanded: bool, half: bool
    ) -> None:
        self._mi, functions = mi, codec.functions
        self._counts = functions.luma_count, functions.chroma_count
        layers = [*functions.hidden, functions.wide, functions.last]
        self._functions = _Chain(mi, layers, half)
        self._expansion = None
        if not expanded:
            network = codec.decode
            skip = Layer(network.linear, np.zeros(network.linear.shape[1], np.float32))
            self._expansion = _Chain(mi, [skip, *network.layers], half)
        self._records = Records(mi, codec.decode(codes) if expanded else codes, half)

    def texels(self, corners: Corners) -> Weighed:
        expansion = self._expansion
        if expansion is None:
            return [(self._records[index], weight) for index, weight in corners]
        code = expansion.vector(self._records.at(corners))
        skip, *layers = expansion.layers
        found = forward(code, layers, SILU) + dense(code, skip)
        return [(expansion.numbers(found), self._mi.Float(1.0))]

    def reflectance(self, texels: Weighed, wi: Components, wo: Components) -> Components:
        chain = self._functions
        *hidden, wide, last = chain.layers
        features = wide_features(chain.vector(direction_components(wi, wo)), hidden, wide)
        mean, *functions = chain.numbers(dense(features, last))
        return _joined(texels, functions, *self._counts, mean)


class NetworkDecoder(HitDecoder):
    """The decoder of the papers' networks at every hit; codes have shape (texels, values).

    With half precision, weights and codes have 16 bits. Any other decoder raises a
    :class:`NacreError`.
    """

    def __init__(self, mi: Any, codec: Any, codes: Floats, expanded: bool, half: bool) -> None:
        del expanded  # these networks see the code with the directions
        layers = codec.hit_layers()
        self._mi, self._whitening = mi, codec.whitening
        self._chain, self._codes = _Chain(mi, layers, half), Records(mi, codes, half)
        self._in_memory = None if half else HitNetwork(mi, layers, codes)

    def texels(self, corners: Corners) -> Corners:
        return corners

    def reflectance(self, texels: Corners, wi: Components, wo: Components) -> Components:
        directions = [*stereographic(wi), *stereographic(wo)]
        network = self._in_memory
        if network is not None and network.takes([*directions, *(part for _, part in texels)]):
            values = network(texels, directions, (wi[2] > 0.0) & (wo[2] > 0.0))
        else:
            chain = self._chain
            seen = chain.vector([*self._codes.at(texels), *directions])
            values = chain.numbers(forward(seen, chain.layers))
        red, green, blue = (self._whitening.restore(v) for v in values)
        return red, green, blue


HIT_DECODERS: dict[str, Callable[..., HitDecoder]] = {
    "functions": BasisDecoder,
    "network": NetworkDecoder,
}
"""By :attr:`nacre.textures.codecs.TexelCodec.hit_form` of a codec."""


class _Chain:
    """Layers on cooperative vectors, with 16 bits if asked for, and always on CUDA."""

    def __init__(self, mi: Any, layers: Sequence[Layer], half: bool) -> None:
        half = half or takes_half(mi)
        self._mi, self._kind = mi, mi.Float16 if half else mi.Float
        self.layers = pack_layers(mi, layers, half, "inference")

    def vector(self, values: Sequence[Any]) -> Any:
        return require("drjit.nn", "render").CoopVec(*(self._kind(v) for v in values))

    def numbers(self, state: Any) -> list[Any]:
        return [self._mi.Float(v) for v in state]


def _joined(
    texels: Weighed, functions: list[Any], luma_count: int, chroma_count: int, mean: Any = 0.0
) -> Components:
    """Reflectance between texels, from functions for luma, then for both values of chroma pairs.

    The functions give its roots; averaging those between unlike texels would be too dark.
    """
    dr = require("drjit", "render")

    def product(weights: list[Any], functions: list[Any], start: Any) -> Any:
        for weight, value in zip(weights, functions, strict=True):
            start = dr.fma(weight, value, start)
        return start

    total: list[Any] = [0.0] * 3
    for weights, texel_weight in texels:
        luma = product(weights[:luma_count], functions[:luma_count], mean)
        starts = luma_count, luma_count + chroma_count
        pairs = (weights[start : start + chroma_count] for start in starts)
        rgb = join_components(luma, *(product(w, functions[luma_count:], 0.0) for w in pairs))
        total = [dr.fma(value, texel_weight, sum_) for value, sum_ in zip(rgb, total, strict=True)]
    return total[0], total[1], total[2]
