"""What an exported texture has to compute, by NumPy in double precision."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import cosine_hemisphere, join, split
from nacre.sampling.tilted import TiltedMixture
from tests.oracles.pairs import pairs

LUMAS, CHROMAS = 96, 16


def read_ktx2(content: bytes) -> npt.NDArray[Any]:
    """Pixels of the first level of a KTX 2.0 file of half floats or bytes: (layers, height, width,
    channels), without layers where it is a picture.
    """
    return read_levels(content)[0]


def read_levels(content: bytes) -> list[npt.NDArray[Any]]:
    """Pixels of all levels; see :func:`read_ktx2`."""
    kind, size, width, height, depth, layers, faces, levels, packing = struct.unpack_from(
        "<9I", content, 12
    )
    channels, dtype = {37: (4, "u1"), 76: (1, "<f2"), 97: (4, "<f2")}[kind]
    if (size, depth, faces, packing) != (np.dtype(dtype).itemsize, 0, 1, 0):
        raise ValueError("a file of half floats or bytes is expected")
    found = []
    for level in range(levels):
        start, count, whole = struct.unpack_from("<3Q", content, 80 + 24 * level)
        assert count == whole
        shape = (max(height >> level, 1), max(width >> level, 1), channels)
        pixels = np.frombuffer(content, dtype, count // size, start)
        found.append(pixels.reshape((layers, *shape) if layers else shape))
    return found


@dataclass(frozen=True)
class Points:
    """Where a texture is evaluated: places (n, 2), levels (n,), directions (n, 3), all float32."""

    uv: Floats
    level: Floats
    wi: Floats
    wo: Floats

    @classmethod
    def random(cls, count: int, levels: int, seed: int = 0) -> Points:
        """Places on the texture and around it; levels and fractions of them, beyond either end."""
        random = np.random.default_rng(seed)
        uv = random.uniform(-1.0, 2.0, (count, 2))
        level = random.uniform(-0.5, levels - 0.5, count)
        level = np.where(random.random(count) < 0.3, np.round(level), level)
        wi, wo = pairs(count, seed)
        # Half of them as lights and views lie on a surface, most of which are not near mirrors.
        often = random.random(count) < 0.5
        wi[often], wo[often] = (
            join(cosine_hemisphere(*random.random((2, int(often.sum()))))) for _ in range(2)
        )
        parts = uv, level, wi, wo
        return cls(*(np.ascontiguousarray(part, np.float32) for part in parts))

    @property
    def place(self) -> Floats:
        """Place and level, shape (n, 3)."""
        return np.concatenate([self.uv, self.level[:, None]], axis=1)


class TextureTruth:
    """An exported texture of `height` x `width` texels, from the arrays that were written."""

    def __init__(self, files: Mapping[str, bytes], name: str, height: int, width: int) -> None:
        arrays = {
            key.removeprefix(f"{name}_").removesuffix(".ktx2"): read_ktx2(content)
            for key, content in files.items()
            if key.endswith(".ktx2")
        }
        self._weights = _numbers(arrays["weights"])
        self._functions = _numbers(arrays["functions"])
        self._lobes = arrays["lobes"].astype(np.float64)
        self._heights = arrays.get("heights")
        self._height, self._width = height, width
        self.resolution = round(len(self._functions) ** 0.5)
        self.levels = int(np.log2(max(height, width))) + 1

    def evaluate(self, points: Points) -> Floats:
        """f_r in 1/sr, shape (n, 3)."""
        wi, wo = points.wi.astype(np.float64), points.wo.astype(np.float64)
        functions = between_nodes(self._functions, wi, wo)
        level = np.clip(points.level.astype(np.float64), 0.0, self.levels - 1)
        fine = np.floor(level).astype(int)
        coarse = np.minimum(fine + 1, self.levels - 1)
        uv = points.uv.astype(np.float64)
        after = (level - fine)[:, None]
        parts = [self._level(uv, which, functions) for which in (fine, coarse)]
        visible = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
        return np.where(visible[:, None], parts[0] * (1.0 - after) + parts[1] * after, 0.0) / np.pi

    def lobe(self, uv: Floats) -> TiltedMixture:
        """The lobes at places."""
        parts = bilinear(self._lobes, uv.astype(np.float64)).T
        return TiltedMixture(parts[0], parts[1], (parts[2], parts[3]))

    def pdf(self, points: Points) -> Floats:
        """Densities, shape (n,)."""
        wi, wo = (split(w.astype(np.float64)) for w in (points.wi, points.wo))
        with np.errstate(all="ignore"):
            found: Floats = self.lobe(points.uv).pdf_components(wi, wo)
        return np.where((wi[2] > 0.0) & (wo[2] > 0.0), found, 0.0)

    def parallax(self, points: Points) -> Floats:
        """Where views meet the height field, shape (n, 2)."""
        assert self._heights is not None
        field = self._heights.astype(np.float64)
        rows, columns, _ = field.shape
        bottom, top = field.min(), field.max()
        uv, wo = points.uv.astype(np.float64), points.wo.astype(np.float64)
        along = wo[:, :2] / np.maximum(wo[:, 2:], 0.1) * (1.0, -self._width / self._height)
        pixels = np.abs(along) * (columns, rows) * (top - bottom)
        step = (top - bottom) / np.clip(np.ceil(pixels.max(1)), 1.0, 256.0)

        def above(level: Floats) -> Floats:
            return level - bilinear(field, uv + along * level[:, None])[:, 0]

        level, before = np.full(len(uv), top), np.zeros(len(uv))
        gap = above(level)
        while (going := (gap > 0.0) & (level > bottom)).any():
            level = np.where(going, level - step, level)
            before = np.where(going, gap, before)
            gap = np.where(going, above(level), gap)
        back = np.where(before > 0.0, gap / np.minimum(gap - before, -1e-12), 0.0)
        met: Floats = uv + along * (level + step * back)[:, None]
        return met

    def _level(self, uv: Floats, level: npt.NDArray[np.intp], functions: Floats) -> Floats:
        """Reflectance factors between the texels of a level."""
        factor = np.zeros((len(uv), 3))
        for which in np.unique(level):
            rows = level == which
            high, wide = max(self._height >> which, 1), max(self._width >> which, 1)
            top, left = self._origin(which)
            map_ = self._weights[top : top + high, left : left + wide]
            for index, share in _texels(uv[rows], high, wide):
                factor[rows] += share[:, None] * _joined(map_[index], functions[rows])
        return factor

    def _origin(self, level: int) -> tuple[int, int]:
        """Where a level begins: the first in the corner, the others one after the other."""
        if level == 0:
            return 0, 0
        if self._width >= self._height:
            return self._height, self._width - (self._width >> (level - 1))
        return self._height - (self._height >> (level - 1)), self._width


class FilteredTruth:
    """A texture exported in few bytes per texel, whose codes are mixed before decoding.

    Pixels 0 to 1 of the k-th texture stand for `low[k]` + `span[k]` times them, shape (4,) each.
    """

    def __init__(self, files: Mapping[str, bytes], name: str, low: Floats, span: Floats) -> None:
        self._maps = [
            [
                pixels / 255.0 * span[k] + low[k]
                for pixels in read_levels(files[f"{name}_weights{k}.ktx2"])
            ]
            for k in range(len(low))
        ]
        self._functions = _numbers(read_ktx2(files[f"{name}_functions.ktx2"]))

    def evaluate(self, points: Points) -> Floats:
        """f_r in 1/sr, shape (n, 3)."""
        wi, wo = points.wi.astype(np.float64), points.wo.astype(np.float64)
        functions = between_nodes(self._functions, wi, wo).reshape(len(wi), -1, 4)
        roots = functions[:, 0, :3].copy()
        for k, levels in enumerate(self._maps):
            numbers = trilinear(levels, points.uv.astype(np.float64), points.level)
            for color in range(3):
                roots[:, color] += (numbers * functions[:, 1 + 3 * k + color]).sum(1)
        visible = (wi[:, 2] > 0.0) & (wo[:, 2] > 0.0)
        factors = _colored(*roots.T)
        return np.where(visible[:, None], factors, 0.0) / np.pi


def trilinear(levels: Sequence[Floats], uv: Floats, level: Floats) -> Floats:
    """Between pixels of two levels, shape (n, channels)."""
    level = np.clip(level.astype(np.float64), 0.0, len(levels) - 1)
    found = np.zeros((len(uv), levels[0].shape[2]))
    for k, pixels in enumerate(levels):
        share = np.maximum(1.0 - np.abs(level - k), 0.0)
        found += share[:, None] * bilinear(pixels, uv)
    return found


def _numbers(pixels: npt.NDArray[np.float16]) -> Floats:
    """Of pixels of layers, (layers, rows, columns, 4), all numbers: (rows, columns, 4 layers)."""
    layers, rows, columns, four = pixels.shape
    return pixels.transpose(1, 2, 0, 3).reshape(rows, columns, layers * four).astype(np.float64)


def between_nodes(functions: Floats, wi: Floats, wo: Floats) -> Floats:
    """Functions (R^2, R^2, numbers) of tiles of views at pairs of directions, (n, numbers)."""
    size = round(len(functions) ** 0.5)
    light, view = (_place(w) * (size - 1) for w in (wi, wo))
    low = [np.minimum(np.floor(p), size - 2).astype(int) for p in (light, view)]
    after = [p - q for p, q in zip((light, view), low, strict=True)]
    total = np.zeros((len(wi), functions.shape[2]))
    for corner in np.ndindex(2, 2, 2, 2):
        (lx, vx), (ly, vy) = (
            (low[0][:, axis] + corner[axis], low[1][:, axis] + corner[axis + 2]) for axis in (0, 1)
        )
        steps = [
            np.where(corner[2 * k + axis], after[k][:, axis], 1.0 - after[k][:, axis])
            for k in (0, 1)
            for axis in (0, 1)
        ]
        values = functions[ly * size + vy, lx * size + vx]
        total += np.prod(steps, axis=0)[:, None] * values
    return total


def _place(w: Floats) -> Floats:
    """Where directions are in a square from 0 to 1: Lambert's equal-area projection."""
    return np.clip(w[:, :2] / np.sqrt(1.0 + np.maximum(w[:, 2:], 0.0)) * 0.5 + 0.5, 0.0, 1.0)


def _texels(uv: Floats, height: int, width: int) -> list[tuple[tuple[Floats, Floats], Floats]]:
    x, y = np.mod(uv[:, 0], 1.0) * width - 0.5, np.mod(uv[:, 1], 1.0) * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    found = []
    for dy, dx in np.ndindex(2, 2):
        share = (x - left if dx else 1.0 - x + left) * (y - top if dy else 1.0 - y + top)
        found.append((((top + dy) % height, (left + dx) % width), share))
    return found


def bilinear(pixels: Floats, uv: Floats) -> Floats:
    """Between pixels of a picture that repeats, shape (n, channels)."""
    parts = [share[:, None] * pixels[index] for index, share in _texels(uv, *pixels.shape[:2])]
    return np.sum(parts, axis=0)


def _joined(weights: Floats, functions: Floats) -> Floats:
    """Reflectance factors from weights and functions of luma and of pairs of colors."""
    luma = (weights[:, :LUMAS] * functions[:, :LUMAS]).sum(1)
    pair = weights[:, LUMAS:].reshape(-1, 2, CHROMAS) * functions[:, None, LUMAS:]
    return _colored(luma, *pair.sum(2).T)


def _colored(luma: Floats, first: Floats, second: Floats) -> Floats:
    """Reflectance factors of roots, as luma and two differences of colors."""
    gray = np.maximum(luma / np.sqrt(3.0), 0.0)
    red_green, rest = first / np.sqrt(2.0), second / np.sqrt(6.0)
    color = np.stack([rest + red_green, rest - red_green, -2.0 * rest], axis=1)
    lowest = -color.min(1)
    with np.errstate(all="ignore"):
        kept = np.where(gray < lowest, gray / lowest, 1.0)
    return np.square(gray[:, None] + kept[:, None] * color)
