"""Networks at hits that lie in memory, by nacre's own compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, aligned_zeros
from nacre.compile.compilation import Compiled
from nacre.errors import require
from nacre.mitsuba.textures.network_tiles import HITS, ROWS
from nacre.mitsuba.textures.texels import Corners
from nacre.numerics.mlp import Layer
from nacre.runtime.parallel import thread_slices

_network = Compiled("nacre.mitsuba.textures.network_loops:network")
_PART = 1 << 13  # hits that a core takes at a time


class HitNetwork:
    """Layers with ReLUs between them, of codes (texels, values) and of numbers of each hit.

    Twice as fast as Dr.Jit's cooperative vectors, which read a number from the cache for every
    multiplication, and for hits that count only. It needs arrays in memory: in kernels that are
    being recorded, on graphics cards and with gradients it does not work, see :meth:`takes`.
    """

    def __init__(self, mi: Any, layers: Sequence[Layer], codes: Floats) -> None:
        self._mi, self._codes = mi, np.ascontiguousarray(codes, np.float32)
        inputs = [len(layer.weights) for layer in layers]
        self._outputs = len(layers[-1].biases)
        self._sizes = np.array([*inputs, self._outputs], np.int64)
        parts = []
        for weights, biases in layers:
            whole = np.zeros((len(weights) + 1, -(-len(biases) // ROWS) * ROWS), np.float32)
            whole[0, : len(biases)], whole[1:, : len(biases)] = biases, weights
            parts.append(whole.reshape(len(whole), -1, ROWS).swapaxes(0, 1).reshape(-1))
        self._weights = aligned_zeros(sum(part.size for part in parts))
        np.concatenate(parts, out=self._weights)

    def takes(self, values: Sequence[Any]) -> bool:
        """Whether numbers of hits, and what depends on them, may be read now."""
        dr = require("drjit", "render")
        recorded = dr.flag(dr.JitFlag.SymbolicScope)
        on_processor = dr.backend_v(self._mi.Float) == dr.JitBackend.LLVM
        return on_processor and not recorded and not dr.grad_enabled(*values)

    def __call__(self, corners: Corners, numbers: Sequence[Any], counts: Any) -> list[Any]:
        """Outputs at hits; 0 where these do not count."""
        dr = require("drjit", "render")
        indices, parts = zip(*corners, strict=True)
        dr.eval(indices, parts, numbers, counts)
        width = dr.width(indices, parts, numbers, counts)

        def rows(values: Sequence[Any], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
            result = np.empty((len(values), width), dtype)
            for row, value in zip(result, values, strict=True):
                row[:] = value.numpy()
            return result

        chosen = np.flatnonzero(np.broadcast_to(counts.numpy(), width))
        where, weights = rows(indices, np.uint32), rows(parts, np.float32)
        directions = rows(numbers, np.float32)
        found = np.zeros((self._outputs, width), np.float32)
        widest = -(-int(self._sizes.max()) // ROWS) * ROWS

        def run(part: slice) -> None:
            state, other = aligned_zeros(widest * HITS), aligned_zeros(widest * HITS)
            _network(
                chosen[part], where, weights, self._codes, directions, self._sizes, self._weights,
                state, other, found,
            )  # fmt: skip

        thread_slices(run, len(chosen), _PART)
        return [self._mi.Float(row) for row in found]
