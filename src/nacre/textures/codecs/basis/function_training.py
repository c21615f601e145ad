"""The functions of the default codec: principal components, then a network that gives them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.numerics.mlp import Layer, dense
from nacre.numerics.pca import leading_components
from nacre.textures.codecs.basis.colors import split_reflectance
from nacre.textures.codecs.basis.network_training import Tensor, descend, new_layer, to_layer, torch
from nacre.textures.codecs.basis.networks import (
    INPUTS,
    AngularFunctions,
    direction_inputs,
    wide_features,
)
from nacre.textures.codecs.basis.recipe import Work

_BATCH = 1024
_BLOCK = 64  # texels at a time whose colors are split
_RIDGE = 1e-8
_SMALLEST = 1e-9  # of the mean square of texels: what varies less is rounding


@dataclass(frozen=True, eq=False)
class Components:
    """Principal components of texels at pairs of unit directions, shape (n, 3).

    The table, shape (n, 1 + luma_count + chroma_count), has the mean, then components of luma, then
    those of chroma, each as large as it is in texels.
    """

    wi: Floats
    wo: Floats
    table: Floats
    luma_count: int


def principal_components(
    texels: Floats, wi: Floats, wo: Floats, orders: list[npt.NDArray[Any]], work: Work
) -> Components:
    """Functions whose sums are closest to roots of reflectance of texels.

    Texels are reflectance factors of all materials, shape (t, n, 3), of any type; `orders` are
    rotations, see :func:`nacre.textures.codecs.symmetry.symmetric_rotations`. A :class:`NacreError`
    says that texels vary in fewer ways than codes have values.
    """
    count, recipe = len(texels), work.recipe
    luma = np.empty((count, len(wi)), np.float32)
    chroma = np.empty((2, count, len(wi)), np.float32)
    for start in range(0, count, _BLOCK):
        part = slice(start, start + _BLOCK)
        luma[part], chroma[:, part] = split_reflectance(texels[part], np.zeros_like(luma[0]))
    mean = luma.mean(0)
    mean = np.mean([mean[order] for order in orders], axis=0)
    luma -= mean
    # A function counts by what it adds to a texel: its root mean square there.
    smallest = _SMALLEST * float(np.square(mean).sum())
    parts = []
    pairs = chroma.reshape(2 * count, -1)
    blocks = (luma, recipe.luma_count, 1.0), (pairs, recipe.chroma_count, 2.0)
    for done, (rows, wanted, weight) in enumerate(blocks):
        work.report("components", done, 2, "")
        block, variances = leading_components(rows, orders, wanted, recipe.seed)
        variances = weight * variances
        strong = variances > smallest
        parts.append(block[:, strong] * np.sqrt(variances[strong]))
    work.report("components", 2, 2, "")
    found = [part.shape[1] for part in parts]
    if not found[0] or found[0] + 2 * found[1] < recipe.code_dim:
        raise NacreError(
            f"texels vary in {found[0] + 2 * found[1]} ways, too few for codes of "
            f"{recipe.code_dim} values; take more varied textures, or a smaller latent size"
        )
    table = np.ascontiguousarray(np.concatenate([mean[:, None], *parts], axis=1))
    return Components(wi, wo, table, found[0])


def train_functions(components: Components, work: Work) -> AngularFunctions:
    """A network that gives components; all but the mean become orthonormal at their directions."""
    recipe = work.recipe
    table, inputs = components.table, direction_inputs(components.wi, components.wo)
    generator = torch.Generator().manual_seed(recipe.seed)
    sizes = [INPUTS, *[recipe.width] * recipe.depth, recipe.wide, table.shape[1]]
    layers = [new_layer(a, b, generator) for a, b in itertools.pairwise(sizes)]
    shift, scatter = inputs.mean(0), inputs.std(0) + 1e-6
    scale = np.sqrt(np.square(table).mean(0)) + 1e-12
    seen = torch.from_numpy((inputs - shift) / scatter)
    wanted, scales = torch.from_numpy(table), torch.from_numpy(scale)
    total = float(np.square(table).mean(0).sum())

    *hidden, wide, last = layers

    def loss(_step: int) -> Tensor:
        chosen = torch.randint(len(seen), (_BATCH,), generator=generator)
        found = dense(wide_features(seen[chosen], hidden, wide), last) * scales
        return (found - wanted[chosen]).square().sum(1).mean() / total

    matrices = [weights for weights, _ in layers[1:-2]]
    vectors = [*(biases for _, biases in layers), *(layers[i][0] for i in (0, -2, -1))]
    descend(vectors, matrices, loss, recipe.function_steps, "functions", generator, work)
    with torch.no_grad():
        units = wide_features(seen, hidden, wide).numpy()
    first, *others = [to_layer(pair) for pair in hidden]
    weights = first.weights / scatter[:, None]
    first = Layer(weights, first.biases - (shift / scatter) @ first.weights)
    best = _least_squares(units, table)
    rough = AngularFunctions([first, *others], to_layer(wide), best, components.luma_count)
    return _orthonormal(rough, units @ best.weights + best.biases)


def _least_squares(units: Floats, table: Floats) -> Layer:
    """The last layer that is best for all pairs of directions."""
    columns = np.concatenate([units, np.ones((len(units), 1), np.float32)], axis=1)
    gram = columns.T @ columns
    gram += np.eye(len(gram), dtype=np.float32) * (_RIDGE * np.trace(gram) / len(gram))
    solution = np.linalg.solve(gram.astype(np.float64), (columns.T @ table).astype(np.float64))
    return Layer(solution[:-1].astype(np.float32), solution[-1].astype(np.float32))


def _orthonormal(rough: AngularFunctions, values: Floats) -> AngularFunctions:
    """The same functions, combined so that their mean products over some pairs are 0 and 1."""
    weights, biases = rough.last.weights.copy(), rough.last.biases.copy()
    for block in (slice(1, 1 + rough.luma_count), slice(1 + rough.luma_count, None)):
        upper = np.linalg.qr(values[:, block].astype(np.float64) / np.sqrt(len(values)))[1]
        inverse = np.linalg.inv(upper)
        weights[:, block] = weights[:, block] @ inverse
        biases[block] = biases[block] @ inverse
    return AngularFunctions(rough.hidden, rough.wide, Layer(weights, biases), rough.luma_count)
