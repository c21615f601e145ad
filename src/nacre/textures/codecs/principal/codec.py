"""Texels as a mean and a weighted sum of components."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.measured.textures.directions import SAME
from nacre.textures.codecs.codec import TexelCodec, TexelMap

_LEAST = 1e-12
"""Of variances, relative to the largest, so that none divides by zero."""


@dataclass(frozen=True, eq=False)
class PcaCodec(TexelCodec):
    """Principal components of reflectance at a fixed set of pairs of directions.

    A code is what is most likely of independent normal weights given normal noise: least squares
    with a ridge, from all the pairs or some of them. From all it is the projection onto the
    components, but for the small ridge.

    Parameters
    ----------
    wi, wo
        The directions, shape (n, 3).
    mean
        What all texels have, shape (n, 3).
    components
        Orthonormal, the strongest first, shape (values, n, 3).
    variances
        Mean squares of weights, shape (values,).
    noise
        Variance of reflectance about the sums, which is what the components leave.
    metadata
        How they were found.

    Raises
    ------
    ValueError
        If shapes do not match, or a variance or the noise is not a number above zero.
    """

    wi: Floats
    wo: Floats
    mean: Floats
    components: Floats
    variances: Floats
    noise: float
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n, values = len(self.wi), len(self.variances)
        for name, shape in (
            ("wi", (n, 3)),
            ("wo", (n, 3)),
            ("mean", (n, 3)),
            ("variances", (values,)),
            ("components", (values, n, 3)),
        ):
            if getattr(self, name).shape != shape or not n or not values:
                raise ValueError(f"{name} have shape {getattr(self, name).shape}, expected {shape}")
        if not ((self.variances >= 0.0).all() and self.variances.max() > 0.0 and self.noise > 0.0):
            raise ValueError("variances and noise must be positive")

    @property
    def values(self) -> int:  # type: ignore[override]
        """Values of a code."""
        return len(self.variances)

    def first(self, values: int) -> PcaCodec:
        """The codec of the strongest components only.

        Raises
        ------
        ValueError
            If there are not as many.
        """
        if not 1 <= values <= self.values:
            raise ValueError(f"{values} of {self.values} components")
        left_out = float(self.variances[values:].sum()) / self.mean.size
        return replace(
            self,
            components=self.components[:values],
            variances=self.variances[:values],
            noise=self.noise + left_out,
        )

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.encoder`.

        Raises
        ------
        NacreError
            If a pair of directions is not among those of the components.
        """
        mean, columns = self._at(wi, wo)
        wide = columns.astype(np.float64)
        variances = np.maximum(self.variances, _LEAST * self.variances.max())
        normal = wide @ wide.T + np.diag(self.noise / variances)
        solve = np.linalg.solve(normal, wide).astype(np.float32).T
        shift = mean @ solve

        def encode(texels: Floats) -> Floats:
            if texels.shape[1:] != (len(wi), 3):
                raise ValueError(f"texels are {texels.shape}, expected (b, {len(wi)}, 3)")
            codes: Floats = texels.reshape(len(texels), -1) @ solve - shift
            return codes

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.decoder`; reflectance below zero becomes zero.

        Raises
        ------
        NacreError
            If a pair of directions is not among those of the components.
        """
        mean, columns = self._at(wi, wo)

        def decode(codes: Floats) -> Floats:
            if codes.shape[1:] != (self.values,):
                raise ValueError(f"codes are {codes.shape}, expected (b, {self.values})")
            found = codes @ columns
            found += mean
            return np.maximum(found, 0.0, out=found).reshape(len(codes), len(wi), 3)

        return decode

    def _at(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
        """Mean, shape (3 n,), and components, (values, 3 n), at n pairs among their own."""
        tree = KDTree(np.concatenate([self.wi, self.wo], axis=1))
        distance, rows = tree.query(np.concatenate([wi, wo], axis=1), distance_upper_bound=SAME)
        strangers = int(np.count_nonzero(~np.isfinite(distance)))
        if strangers:
            raise NacreError(
                f"principal components are known at their own {len(self.wi):,} pairs of directions "
                f"only, {strangers:,} of {len(wi):,} are others; find components for these, or "
                "take a codec of any directions"
            )
        return self.mean[rows].reshape(-1), self.components[:, rows].reshape(self.values, -1)
