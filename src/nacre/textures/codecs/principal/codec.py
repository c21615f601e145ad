"""Texels as a mean and a weighted sum of components."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.tensors import Tensors, check_header, check_numbers, check_unit_vectors
from nacre.measured.textures.directions import SAME
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec, TexelMap, TrainingRun, check_shape
from nacre.textures.codecs.principal.analysis import PcaRecipe, strongest_components

_SMALLEST = 1e-12  # of variances, relative to the largest, so that none divides by zero
_FILE_KIND = "principal components"  # what files call this kind of codec
_VERSION = 1
_LARGEST = 1e12
_ARRAYS = ("wi", "wo", "mean", "components", "variances")


@dataclass(frozen=True, eq=False)
class PcaCodec(TexelCodec):
    """Principal components of reflectance at a fixed set of pairs of directions.

    A code is what is most likely of independent normal weights given normal noise: least squares
    with a ridge, from all the pairs or some of them. From all it is the projection onto the
    components, but for the small ridge. At other directions, encoding and decoding are a
    NacreError. A ValueError says that shapes do not match, or that a variance or the noise is not a
    number above zero.
    """

    wi: Floats  # the directions, shape (n, 3)
    wo: Floats
    mean: Floats  # what all texels have, shape (n, 3)
    components: Floats  # orthonormal, the strongest first, shape (code_dim, n, 3)
    variances: Floats  # mean squares of weights, shape (code_dim,)
    noise: float  # variance of reflectance about the sums: what the components leave out
    metadata: dict[str, Any] = field(default_factory=dict)

    kind = "pca"
    any_directions = False

    def __post_init__(self) -> None:
        n, code_dim = len(self.wi), len(self.variances)
        shapes: dict[str, tuple[int, ...]] = {"wi": (n, 3), "wo": (n, 3), "mean": (n, 3)}
        shapes |= {"variances": (code_dim,), "components": (code_dim, n, 3)}
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape or not n or not code_dim:
                raise ValueError(f"{name} have shape {getattr(self, name).shape}, expected {shape}")
        if not ((self.variances >= 0.0).all() and self.variances.max() > 0.0 and self.noise > 0.0):
            raise ValueError("variances and noise must be positive")

    @property
    def code_dim(self) -> int:  # type: ignore[override]
        return len(self.variances)

    def first(self, code_dim: int) -> PcaCodec:
        if not 1 <= code_dim <= self.code_dim:
            raise NacreError(f"there are only {self.code_dim} principal components")
        left_out = float(self.variances[code_dim:].sum()) / self.mean.size
        components, variances = self.components[:code_dim], self.variances[:code_dim]
        noise = self.noise + left_out
        return replace(self, components=components, variances=variances, noise=noise)

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        mean, columns = self._at(wi, wo)
        wide = columns.astype(np.float64)
        variances = np.maximum(self.variances, _SMALLEST * self.variances.max())
        normal = wide @ wide.T + np.diag(self.noise / variances)
        solve = np.linalg.solve(normal, wide).astype(np.float32).T
        shift = mean @ solve

        def encode(texels: Floats) -> Floats:
            check_shape("texels", texels, len(wi), 3)
            return np.asarray(texels.reshape(len(texels), -1) @ solve - shift)

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """Reflectance below zero becomes zero."""
        mean, columns = self._at(wi, wo)

        def decode(codes: Floats) -> Floats:
            check_shape("codes", codes, self.code_dim)
            found = codes @ columns
            found += mean
            return np.maximum(found, 0.0, out=found).reshape(len(codes), len(wi), 3)

        return decode

    def _at(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
        """Mean, shape (3 n,), and components, (code_dim, 3 n), at n pairs among their own."""
        from scipy.spatial import KDTree

        tree = KDTree(np.concatenate([self.wi, self.wo], axis=1))
        distance, rows = tree.query(np.concatenate([wi, wo], axis=1), distance_upper_bound=SAME)
        strangers = int(np.count_nonzero(~np.isfinite(distance)))
        if strangers:
            raise NacreError(
                f"principal components are known at their own {len(self.wi):,} pairs of directions "
                f"only, {strangers:,} of {len(wi):,} are others; find components for these, or "
                "take a codec of any directions"
            )
        return self.mean[rows].reshape(-1), self.components[:, rows].reshape(self.code_dim, -1)

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        tensors = {name: np.ascontiguousarray(getattr(self, name), np.float32) for name in _ARRAYS}
        header = {"version": _VERSION, "model": _FILE_KIND, "values": "pi f_r, linear Rec. 709"}
        return header | {"noise": float(self.noise), "metadata": self.metadata}, tensors

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> PcaCodec:
        check_header(header, _VERSION)
        noise = header["noise"]
        if not isinstance(noise, float) or not 0.0 < noise < _LARGEST:
            raise ValueError(f"noise is {noise!r}, expected a number above 0")
        arrays = {name: tensors[name] for name in _ARRAYS}
        for name, array in arrays.items():
            if array.dtype != np.float32:
                raise ValueError(f"{name} are not float32 numbers")
        check_numbers(arrays, _LARGEST)
        check_unit_vectors({name: arrays[name] for name in ("wi", "wo")})
        return cls(**arrays, noise=noise, metadata=header["metadata"])

    @classmethod
    def recipe(cls, *, code_dim: int | None = None, seed: int = 0) -> PcaRecipe:
        """How to find `code_dim` components, 32 where None; the seed chooses texels."""
        return PcaRecipe(seed=seed) if code_dim is None else PcaRecipe(code_dim, seed=seed)

    @classmethod
    def train(cls, run: TrainingRun, recipe: PcaRecipe) -> PcaCodec:
        """See :meth:`TexelCodec.train`; takes seconds, and keeps no state."""
        return find_components(run.textures, recipe, run.progress)


def find_components(
    textures: Sequence[Callable[[], Btf]],
    recipe: PcaRecipe,
    progress: Progress = silent,
    min_count: int | None = None,
) -> PcaCodec:
    """The codec of the components with the largest variances.

    Each texture is opened by a call, twice in all; all have the same pairs of directions. There are
    no more components than texels, nor than values of a texel; `min_count` of them suffice, or as
    many as the recipe says where None.

    Raises a FormatError if a texture cannot be read, and a NacreError if there are too few
    components or directions differ.
    """
    least = min_count or recipe.code_dim
    return PcaCodec(*strongest_components(textures, recipe, progress, least))
