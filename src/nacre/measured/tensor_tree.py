"""Functions on the unit cube as trees of cubes, piecewise constant: Radiance's tensor trees.

A branch halves its cube along each axis; bit i of a child's number is the half along axis i. A leaf
is a grid of cubes, the first axis slowest. As text a node is its children, or the values of its
grid, in braces (Ward, Kurt and Bonneel 2012, "A Practical Framework for Sharing and Rendering
Real-World Bidirectional Scattering Distribution Functions"; Radiance's bsdf_t.c).
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Sequence
from itertools import product

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Floats, Table, namespace
from nacre.errors import CUT_SHORT
from nacre.measured.axis import zero_index

DEPTH_LIMIT = 12  # max branches within each other
_COUNT_LIMIT = 1 << 23  # of values and of branches: float32 holds their numbers exactly
_LARGEST = float(np.finfo(np.float32).max)
_TOKEN = re.compile(r"[{}]|[^\s,{}]+")


class TensorTree:
    """A function on the unit cube of 3 or 4 axes, their number being the rank.

    `leaves`, shape (leaves, 2), has where the values of each leaf start, and their number along an
    axis. `links`, shape (branches 2^rank,), are the children of all branches: the place of the
    first child of a branch, or -1 - the number of a leaf. The root is like an entry of `links`, and
    at most `depth` branches lie within each other.
    """

    def __init__(
        self,
        rank: int,
        values: npt.ArrayLike,
        leaves: npt.ArrayLike,
        links: npt.ArrayLike,
        root: int,
        depth: int,
    ) -> None:
        self.rank, self.depth = rank, depth
        self._values, self._leaves = Table(values), Table(leaves)
        # Some libraries have indices that are never negative: leaves are numbered after branches.
        children = np.asarray(links, np.int64)
        self._branches = len(children)
        numbered = np.where(children < 0, self._branches - 1 - children, children)
        self._links = Table(numbered if self._branches else np.zeros(1))
        self._root = root if root >= 0 else self._branches - 1 - root

    @property
    def values(self) -> npt.NDArray[np.float32]:
        return self._values.values

    @property
    def nbytes(self) -> int:
        return self.values.nbytes

    def text(self) -> str:
        """The tree as text, to float32 precision: what this wrote is written again."""
        leaves, links = (table.values.astype(np.int64) for table in (self._leaves, self._links))
        parts: list[str] = []

        def emit(link: int) -> None:
            parts.append("{")
            if link >= self._branches:
                start, side = leaves.reshape(-1, 2)[link - self._branches]
                values = self.values[start : start + side**self.rank]
                parts.append(" ".join(f"{value:.9g}" for value in values.tolist()))
            else:
                for child in links[link : link + (1 << self.rank)].tolist():
                    emit(child)
            parts.append("}\n")

        emit(self._root)
        return "".join(parts)

    def at(self, point: Sequence[Array]) -> Array:
        """Value at a point, with coordinates from 0 up to 1; runs on any array library."""
        xp = namespace(*point)
        zero = zero_index(sum(point))
        place = [xp.minimum(xp.maximum(p, 0.0), 1.0 - 1e-6) for p in point]
        link = zero + self._root
        for _ in range(self.depth):
            inner = link < self._branches
            upper = [xp.where(p >= 0.5, 1.0, 0.0) for p in place]
            child = sum((xp.to_index(bit) << axis for axis, bit in enumerate(upper)), link)
            found = xp.to_index(xp.take(self._links, xp.where(inner, child, zero)))
            link = xp.where(inner, found, link)
            place = [xp.where(inner, 2.0 * p - bit, p) for p, bit in zip(place, upper, strict=True)]
        leaf = 2 * xp.maximum(link, self._branches) - 2 * self._branches
        start, side = xp.take(self._leaves, leaf), xp.take(self._leaves, leaf + 1)
        index = zero
        for p in place:
            step = xp.to_index(xp.minimum(p * side, side - 0.5))
            index = index * xp.to_index(side) + step
        # There is no slope, which is not the same as no gradient.
        return xp.take(self._values, xp.to_index(start) + index) + 0.0 * sum(point)


def parse(text: str, rank: int) -> TensorTree:
    """The tree that a text holds; a ValueError says what is wrong with it."""
    values, leaves, links = array("f"), array("q"), array("q")
    frames: list[tuple[list[int], int]] = []  # children, and where values start
    deepest, root = 0, None
    for match in _TOKEN.finditer(text):
        token = match[0]
        if root is not None:
            raise ValueError("goes on after its end")
        if token == "{":
            if frames and not frames[-1][0] and len(values) > frames[-1][1]:
                raise ValueError("has values and branches in one node")
            frames.append(([], len(values)))
            deepest = max(deepest, len(frames))
            if deepest > DEPTH_LIMIT:
                raise ValueError(f"has more than {DEPTH_LIMIT} levels")
        elif not frames:
            raise ValueError(f"starts with {token[:20]!r}, expected a brace")
        elif token == "}":
            children, start = frames.pop()
            link = (
                _branch(children, links, rank) if children else _leaf(values, start, leaves, rank)
            )
            if frames:
                frames[-1][0].append(link)
            else:
                root = link
        elif frames[-1][0]:
            raise ValueError("has values and branches in one node")
        else:
            values.append(_number(token))
        if max(len(values), len(links)) > _COUNT_LIMIT:
            raise ValueError(f"has more than {_COUNT_LIMIT} values")
    if root is None:
        raise ValueError(f"ends before its last brace; {CUT_SHORT}")
    return TensorTree(
        rank,
        np.frombuffer(values, np.float32),
        np.array(leaves).reshape(-1, 2),
        links,
        root,
        deepest - 1,
    )


def _number(token: str) -> float:
    value = float(token) if token.isascii() and "_" not in token else math.nan
    if not abs(value) <= _LARGEST:
        raise ValueError(f"has {token[:20]!r} in place of a finite number")
    return value


def _branch(children: list[int], links: array[int], rank: int) -> int:
    if len(children) != 1 << rank:
        raise ValueError(f"has a node of {len(children)} branches, expected {1 << rank}")
    links.extend(children)
    return len(links) - len(children)


def _leaf(values: array[float], start: int, leaves: array[int], rank: int) -> int:
    count = len(values) - start
    side = 1 << max(count.bit_length() - 1, 0) // rank
    if side**rank != count:
        raise ValueError(f"has a leaf of {count} values, expected a power of {1 << rank}")
    leaves.extend((start, side))
    return -(len(leaves) // 2)


def write(values: Floats, tolerance: float, floor: float, digits: int) -> str:
    """The text of a tree of values on a grid, with cubes of nearly equal values made one.

    Values have shape (n, ..., n) with 3 or 4 axes, n a power of two, and are written with so many
    significant digits. Cubes become one if the range of their values is at most `tolerance` times
    their mean plus `floor`.
    """
    levels = [(values, np.ones(values.shape, np.bool_))]
    low = high = values
    while len(levels[-1][0]) > 1:
        mean = _blocks(levels[-1][0]).mean(axis=-1)
        low, high = _blocks(low).min(axis=-1), _blocks(high).max(axis=-1)
        levels.append((mean, high - low <= tolerance * np.abs(mean) + floor))
    axes = range(values.ndim)
    corners = np.array([[number >> axis & 1 for axis in axes] for number in range(1 << len(axes))])
    in_rows = np.array(list(product((0, 1), repeat=len(axes))))
    parts: list[str] = []

    def emit(level: int, place: npt.NDArray[np.int64]) -> None:
        mean, merged = levels[level]
        if merged[tuple(place)]:
            parts.append(f"{{{mean[tuple(place)]:.{digits}g}}}")
        elif level == 1:
            cells = levels[0][0][tuple((2 * place + in_rows).T)]
            parts.append("{" + " ".join(f"{cell:.{digits}g}" for cell in cells.tolist()) + "}")
        else:
            parts.append("{")
            for child in 2 * place + corners:
                emit(level - 1, child)
            parts.append("}\n")

    emit(len(levels) - 1, np.zeros(len(axes), np.int64))
    return "".join(parts)


def _blocks(values: Floats) -> Floats:
    """Cubes of two along each axis, shape (n / 2, ..., n / 2, 2^rank)."""
    rank, half = values.ndim, len(values) // 2
    split = values.reshape(*(length for _ in range(rank) for length in (half, 2)))
    order = (*range(0, 2 * rank, 2), *range(1, 2 * rank, 2))
    return np.asarray(split.transpose(order).reshape(*[half] * rank, -1))


def disk_to_square(x: Array, y: Array) -> tuple[Array, Array]:
    """The unit disk to the unit square, keeping ratios of areas (Shirley and Chiu 1997)."""
    xp = namespace(x, y)
    radius = xp.sqrt(x * x + y * y)
    wide = xp.abs(x) > xp.abs(y)
    long, short = xp.where(wide, x, y), xp.where(wide, y, x)
    side = xp.where(long < 0.0, -radius, radius)
    angle = xp.arctan2(short, xp.abs(long) + 1e-30)
    other = radius * angle * (4.0 / math.pi)
    return 0.5 + 0.5 * xp.where(wide, side, other), 0.5 + 0.5 * xp.where(wide, other, side)


def square_to_disk(u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """The inverse of :func:`disk_to_square`."""
    a, b = 2.0 * u - 1.0, 2.0 * v - 1.0
    wide = np.abs(a) > np.abs(b)
    long, short = np.where(wide, a, b), np.where(wide, b, a)
    angle = short / np.where(long == 0.0, 1.0, np.abs(long)) * (math.pi / 4.0)
    far, near = long * np.cos(angle), np.abs(long) * np.sin(angle)
    return np.where(wide, far, near), np.where(wide, near, far)
