"""What makes reflectance of a texel at a hit: functions in a table, or the networks of a codec."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeAlias

import numpy as np

from nacre.array import Components, Floats
from nacre.errors import require
from nacre.geometry import stereographic
from nacre.numerics.mlp import SILU, Layer, dense, forward
from nacre.render.network import pack_layers, takes_half
from nacre.render.textures.angle_grid import AngleGrid
from nacre.render.textures.texels import Corners, Records
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.codecs.basis.networks import direction_components, wide_features
from nacre.textures.factors import CHROMAS, LUMAS, Factors

Weighed: TypeAlias = "list[tuple[list[Any], Any]]"
"""Weights of functions, of each texel around a hit, and its weight."""


class HitDecoder(Protocol):
    """Reflectance at hits, on arrays of a JIT variant."""

    def texels(self, corners: Corners) -> Any:
        """What a hit needs of the texels around it, whatever the directions."""
        ...

    def reflectance(self, texels: Any, wi: Components, wo: Components) -> Components:
        """Reflectance factors pi f_r, never negative, linear RGB; directions of the texture."""
        ...


class TableDecoder(HitDecoder):
    """Sums of a texture's own functions, which lie in a table; see :class:`AngleGrid`."""

    def __init__(self, mi: Any, factors: Factors, stochastic: bool) -> None:
        self._weights = Records(mi, factors.weights, half=True)
        self._functions = Records(mi, factors.functions, half=True)
        self._grid = AngleGrid(mi, factors.resolution, stochastic)

    def texels(self, corners: Corners) -> Weighed:
        return [(self._weights[index], weight) for index, weight in corners]

    def reflectance(self, texels: Weighed, wi: Components, wo: Components) -> Components:
        functions = self._grid.interpolated(self._functions, wi, wo)
        return _joined(texels, functions, LUMAS, CHROMAS)


class BasisDecoder(HitDecoder):
    """The default codec's networks, at every hit, for codes of shape (texels, values).

    Expanded, coefficients of all texels are kept rather than found at every hit. In half precision,
    weights, codes and coefficients have 16 bits.
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
    """The decoder that the papers' networks share, at every hit; codes have shape (texels, values).

    These networks see the code with the directions, so that nothing is expanded. In half precision,
    weights and codes have 16 bits. A decoder other than the papers' is a :class:`NacreError`.
    """

    def __init__(self, mi: Any, codec: Any, codes: Floats, expanded: bool, half: bool) -> None:
        del expanded  # these networks see the code with the directions
        layers = codec.hit_layers()
        self._mi, self._whitening = mi, codec.whitening
        self._chain, self._codes = _Chain(mi, layers, half), Records(mi, codes, half)

    def texels(self, corners: Corners) -> list[Any]:
        return self._codes.at(corners)

    def reflectance(self, texels: list[Any], wi: Components, wo: Components) -> Components:
        chain = self._chain
        seen = chain.vector([*texels, *stereographic(wi), *stereographic(wo)])
        values = chain.numbers(forward(seen, chain.layers))
        red, green, blue = (self._whitening.restore(v) for v in values)
        return red, green, blue


HIT_DECODERS: dict[str, Callable[..., HitDecoder]] = {
    "functions": BasisDecoder,
    "network": NetworkDecoder,
}
"""By :attr:`nacre.textures.codecs.TexelCodec.hit_form` of a codec."""


class _Chain:
    """Layers on cooperative vectors, of 16 bits where asked for and on CUDA."""

    def __init__(self, mi: Any, layers: Sequence[Layer], half: bool) -> None:
        half = half or takes_half(mi)
        self._mi, self._kind = mi, mi.Float16 if half else mi.Float
        self.layers = pack_layers(mi, layers, half, "inference")

    def vector(self, values: Sequence[Any]) -> Any:
        """Numbers as a cooperative vector."""
        return require("drjit.nn", "render").CoopVec(*(self._kind(v) for v in values))

    def numbers(self, state: Any) -> list[Any]:
        """A cooperative vector as single numbers."""
        return [self._mi.Float(v) for v in state]


def _joined(
    texels: Weighed, functions: list[Any], luma_count: int, chroma_count: int, mean: Any = 0.0
) -> Components:
    """Reflectance between texels, of functions of luma, then of both values of pairs.

    Functions stand for roots of it, whose means between unlike texels would be too dark.
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
