"""Encoded textures as ONNX models that contain their arrays and the code that reads them.

The model for `eval` takes places `uv`, shape (n, 2), `level`, (n,), `wi` and `wo`, (n, 3); those
for `pdf` and `sample` take no level. The texels around a place, on both levels, are eight rows in a
table of weights, and the nodes around a pair of directions sixteen rows in a table of functions.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from nacre.array import Array, Components, Namespace, Table, namespace
from nacre.btf import Btf
from nacre.targets.onnx_graph import Graph
from nacre.targets.program import Function
from nacre.targets.textures.accuracy import error_lines
from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.shader_texture import Halves
from nacre.targets.textures.source import density, drawn, joined
from nacre.textures.factors import CHROMAS, LUMAS, grid_place
from nacre.textures.mipmap import level_shapes

_TEXELS, _NODES, _LOBES = 8, 16, 4  # rows around a place, around a pair, and of lobes


def texture_models(texture: Btf, atlas: TextureAtlas, name: str) -> Mapping[str, bytes]:
    """Files with the models of a texture."""
    makers = {"eval": _eval, "pdf": _pdf, "sample": _sample}
    return {
        f"{name}_{each}.onnx": make(texture, atlas, f"{name}_{each}")
        for each, make in makers.items()
    }


def _eval(texture: Btf, atlas: TextureAtlas, name: str) -> bytes:
    graph = TextureGraph()
    sizes = {"uv": 2, "level": 1, "wi": 3, "wo": 3}
    inputs = [graph.value(each, count) for each, count in sizes.items()]
    graph.joined("place", ["uv", graph.column("level")])
    graph.function(_texels(atlas))
    graph.function(_nodes(atlas.resolution))
    weights = graph.rows(_table(atlas), "texels")
    functions = graph.rows(atlas.function_rows(), "nodes")
    functions = graph.weighted("node_shares", _NODES, functions)
    luma, *pair = graph.parts(weights, [LUMAS, CHROMAS, CHROMAS], 2)
    luma_functions, chroma_functions = graph.parts(functions, [LUMAS, CHROMAS], 2)
    products = [graph.node("MatMul", [luma, graph.columns(luma_functions)])]
    products += [graph.node("MatMul", [part, graph.columns(chroma_functions)]) for part in pair]
    sums = graph.node("Concat", products, axis=2)
    graph.reshaped(sums, [-1, 3], "sums")
    graph.function(Function.of("joined", joined, {"sums": 3}, ("factors",)))
    each = graph.reshaped("factors", [-1, _TEXELS, 3])
    found = graph.weighted("fractions", _TEXELS, each)
    graph.reshaped(found, [-1, 3], "rgb")
    outputs = [graph.value("rgb", 3)]
    return graph.model(texture, name, inputs, outputs, error_lines(texture, atlas))


def _pdf(texture: Btf, atlas: TextureAtlas, name: str) -> bytes:
    graph = TextureGraph()
    inputs = [graph.value(each, count) for each, count in {"uv": 2, "wi": 3, "wo": 3}.items()]
    _lobe(graph, atlas)
    outputs = graph.function(Function.of("pdf", density, {"lobe": 4, "wi": 3, "wo": 3}, ("pdf",)))
    return graph.model(texture, name, inputs, outputs)


def _sample(texture: Btf, atlas: TextureAtlas, name: str) -> bytes:
    graph = TextureGraph()
    inputs = [graph.value(each, count) for each, count in {"uv": 2, "wo": 3, "u": 3}.items()]
    _lobe(graph, atlas)
    parameters = {"lobe": 4, "wo": 3, "u": 3}
    outputs = graph.function(Function.of("sample", drawn, parameters, ("wi", "pdf")))
    return graph.model(texture, name, inputs, outputs)


def _lobe(graph: TextureGraph, atlas: TextureAtlas) -> None:
    """The lobe at each place `uv`, as `lobe`, shape (n, 4)."""
    rows, columns, _ = atlas.lobes.shape

    def around(uv: Sequence[Array]) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        return _corners(namespace(*uv), uv, rows, columns, 0.0)

    graph.function(Function.of("lobe", around, {"uv": 2}, ("texels", "fractions")))
    found = graph.rows(atlas.lobes.reshape(-1, 4), "texels")
    graph.reshaped(graph.weighted("fractions", _LOBES, found), [-1, 4], "lobe")


class TextureGraph(Graph):
    """Nodes of a model that reads tables."""

    def rows(self, table: Halves, index: str) -> str:
        """Rows of a table, shape (n, k, numbers), at indices (n, k), which are floats."""
        chosen = self.node("Cast", [index], to=self.types.INT32)
        found = self.node("Gather", [self.constant(table), chosen], axis=0)
        return self.node("Cast", [found], to=self.types.FLOAT)

    def weighted(self, fractions: str, count: int, values: str) -> str:
        """Sums (n, 1, numbers) of values (n, count, numbers) times fractions (n, count)."""
        return self.node("MatMul", [self.reshaped(fractions, [-1, 1, count]), values])

    def columns(self, values: str) -> str:
        """From (n, 1, k) to (n, k, 1)."""
        return self.node("Transpose", [values], perm=[0, 2, 1])

    def column(self, values: str) -> str:
        """From (n,) to (n, 1)."""
        return self.reshaped(values, [-1, 1])

    def reshaped(self, values: str, shape: Sequence[int], name: str = "") -> str:
        """The values in another shape, under a name if one is given."""
        operands = [values, self.constant(np.array(shape))]
        if not name:
            return self.node("Reshape", operands)
        self.named("Reshape", operands, name)
        return name

    def joined(self, name: str, parts: Sequence[str]) -> None:
        """Columns side by side."""
        self.named("Concat", parts, name, axis=1)

    def parts(self, values: str, sizes: Sequence[int], axis: int) -> list[str]:
        """Values split along an axis."""
        ends = [0, *itertools.accumulate(sizes)]
        return [
            self.node(
                "Slice", [values, *(self.constant(np.array([at])) for at in (start, stop, axis))]
            )
            for start, stop in itertools.pairwise(ends)
        ]


def _texels(atlas: TextureAtlas) -> Function:
    """Table rows around a place, and their weights divided by pi; 0 for pairs below the horizon."""
    shapes = level_shapes(atlas.height, atlas.width)
    high, wide = (np.array(sizes, np.float32) for sizes in zip(*shapes, strict=True))
    starts = np.cumsum([0, *(rows * columns for rows, columns in shapes[:-1])])
    tables = [Table(values) for values in (high, wide, starts)]
    last = float(len(shapes) - 1)

    def lookup(
        place: Components, wi: Components, wo: Components
    ) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        u, v, level = place
        xp = namespace(u)
        kept = xp.minimum(xp.maximum(level, 0.0), last)
        fine = xp.floor(kept)
        after = kept - fine
        lit = xp.where((wi[2] > 0.0) & (wo[2] > 0.0), 1.0 / math.pi, 0.0 * wi[2])
        texels: list[Array] = []
        fractions: list[Array] = []
        for which, part in ((fine, 1.0 - after), (xp.minimum(fine + 1.0, last), after)):
            rows, columns, start = (xp.take(table, xp.to_index(which)) for table in tables)
            index, fraction = _corners(xp, (u, v), rows, columns, start)
            texels += index
            fractions += [one * part * lit for one in fraction]
        return tuple(texels), tuple(fractions)

    parameters = {"place": 3, "wi": 3, "wo": 3}
    return Function.of("texels", lookup, parameters, ("texels", "fractions"))


def _corners(
    xp: Namespace, uv: Sequence[Array], rows: Array, columns: Array, start: Array
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The four texels around places on a map that repeats, and their weights."""
    axes = []
    for coordinate, size in zip(uv, (columns, rows), strict=True):
        place = (coordinate - xp.floor(coordinate)) * size - 0.5
        low = xp.floor(place)
        after = place - low
        low_index = xp.where(low < 0.0, low + size, low)
        high_index = xp.where(low + 1.0 < size, low + 1.0, 0.0 * low)
        axes.append(((low_index, 1.0 - after), (high_index, after)))
    across, down = axes
    found = [
        (start + row * columns + column, fraction * part)
        for (row, fraction), (column, part) in itertools.product(down, across)
    ]
    return tuple(index for index, _ in found), tuple(fraction for _, fraction in found)


def _nodes(resolution: int) -> Function:
    """Rows of the functions around a pair of directions, and their weights."""

    def lookup(wi: Components, wo: Components) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        xp = namespace(*wi)
        axes = []
        for place in (*grid_place(wi, resolution), *grid_place(wo, resolution)):
            low = xp.minimum(xp.floor(place), resolution - 2.0)
            axes.append(((low, 1.0 - (place - low)), (low + 1.0, place - low)))
        # Axes are the light's x and y, then the view's; the view's x is the least significant.
        light_x, light_y, view_x, view_y = axes
        nodes: list[Array] = []
        fractions: list[Array] = []
        for parts in itertools.product(light_y, light_x, view_y, view_x):
            index, fraction = parts[0]
            for step, part in parts[1:]:
                index, fraction = index * float(resolution) + step, fraction * part
            nodes.append(index)
            fractions.append(fraction)
        return tuple(nodes), tuple(fractions)

    return Function.of("nodes", lookup, {"wi": 3, "wo": 3}, ("nodes", "node_shares"))


def _table(atlas: TextureAtlas) -> Halves:
    """Weights of all levels in sequence, shape (texels, numbers)."""
    return np.concatenate([level.reshape(-1, level.shape[2]) for level in atlas.level_weights()])
