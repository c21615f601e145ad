"""The compiled loops of Gauss-Newton steps of codes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from nacre.compile.emitter import Emitter, generated
from nacre.compile.numba_code import compiled, inner_fast
from nacre.compile.vector_code import LANES
from nacre.textures.codecs.basis.product_tiles import wide_tile
from nacre.textures.codecs.basis.tile_sizes import BLOCK, PANEL, ROWS


@compiled
def slopes(
    first: Any, sizes: Any, weights: Any, scales: Any, linear: Any, scaled: Any, made: Any,
    found: Any,
) -> None:  # fmt: skip
    """Derivatives of layers by inputs, plus those of a linear map, (b, rows, outputs).

    ((first scales) weights scales) weights ... + linear, texel by texel: `first` (rows, units) are
    the weights of the first layer; `sizes` (layers,) its units, then those of the others, whose
    weights lie as panels behind each other; `scales` (b, all units) derivatives of activations.
    """
    texels, rows, outputs = found.shape
    for texel in range(texels):
        for k in range(first.size):
            made[k] = first[k]
        scales_at = weights_at = 0
        for layer in range(sizes.size - 1):
            inputs, units = sizes[layer], sizes[layer + 1]
            for block in range(inputs // BLOCK):
                scale = scales[texel, scales_at + block * BLOCK :]
                for row in range(rows):
                    source = made[row * inputs + block * BLOCK :]
                    target = scaled[(block * rows + row) * BLOCK :]
                    for k in range(BLOCK):
                        target[k] = source[k] * scale[k]
            if layer == sizes.size - 2:
                for k in range(rows * units):
                    made[k] = linear[k]
            else:
                for k in range(rows * units):
                    made[k] = np.float32(0.0)
            for block in range(inputs // BLOCK):
                for panel in range(units // PANEL):
                    b_at = weights_at + (block * units + panel * PANEL) * BLOCK
                    for row in range(0, rows, ROWS):
                        x_at, c_at = (block * rows + row) * BLOCK, row * units + panel * PANEL
                        wide_tile(scaled, x_at, weights, b_at, made, c_at, units)
            scales_at += inputs
            weights_at += inputs * units
        for row in range(rows):
            for k in range(outputs):
                found[texel, row, k] = made[row * outputs + k]


@inner_fast  # type: ignore[untyped-decorator]
def _dot(a: Any, b: Any, count: Any) -> Any:
    total = np.float32(0.0)
    for k in range(count):
        total += a[k] * b[k]
    return total


@intrinsic  # type: ignore[untyped-decorator]
def _multiply(_context: Any, x: Any, a: Any, b: Any) -> Any:
    """x[a] *= x[b], for vectors of x."""

    def emit_product(emit: Emitter, arguments: Any) -> None:
        _, a, b = arguments
        emit.store(emit.builder.fmul(emit.load(0, a), emit.load(0, b)), 0, a)

    return types.void(x, a, b), generated(emit_product)


@intrinsic  # type: ignore[untyped-decorator]
def _subtract(_context: Any, x: Any, a: Any, b: Any, c: Any) -> Any:
    """x[a] -= x[b] x[c], for vectors of x."""

    def emit_difference(emit: Emitter, arguments: Any) -> None:
        _, a, b, c = arguments
        b = emit.builder.fneg(emit.load(0, b))
        emit.store(emit.call("fma", b, emit.load(0, c), emit.load(0, a)), 0, a)

    return types.void(x, a, b, c), generated(emit_difference)


@compiled
def step(slopes: Any, missing: Any, damping: Any, floor: Any, factor: Any, codes: Any) -> None:
    """Add the solutions of (S + damping diag S + floor) x = J missing, S = J J', to codes.

    J are the slopes, shape (b, values, outputs), codes have shape (b, values) and what is missing
    (b, outputs). By Cholesky's factors, of as many texels as a vector has lanes at a time; where S
    is not positive, codes are no numbers afterwards.
    """
    texels, count = codes.shape
    outputs = slopes.shape[2]
    row = count * LANES
    for first in range(0, texels, LANES):
        for lane in range(LANES):
            texel = min(first + lane, texels - 1)
            for i in range(count):
                place = i * row + lane
                for j in range(i + 1):
                    factor[place + j * LANES] = _dot(slopes[texel, i], slopes[texel, j], outputs)
                place += i * LANES
                factor[place] = factor[place] * damping + floor
                below = _dot(slopes[texel, i], missing[texel], outputs)
                factor[count * row + i * LANES + lane] = below
        for j in range(count):
            pivot = j * row + j * LANES
            for k in range(pivot, pivot + LANES):
                factor[k] = np.float32(1.0) / np.sqrt(max(factor[k], np.float32(0.0)))
            for i in range(j + 1, count + 1):  # the last row is the right-hand side
                _multiply(factor, i * row + j * LANES, pivot)
            for i in range(j + 1, count + 1):
                left = i * row + j * LANES
                for k in range(j + 1, min(i + 1, count)):
                    _subtract(factor, i * row + k * LANES, left, k * row + j * LANES)
        for i in range(count - 1, -1, -1):
            found = count * row + i * LANES
            _multiply(factor, found, i * row + i * LANES)
            for j in range(i):
                _subtract(factor, count * row + j * LANES, i * row + j * LANES, found)
        for lane in range(min(LANES, texels - first)):
            for i in range(count):
                codes[first + lane, i] += factor[count * row + i * LANES + lane]
