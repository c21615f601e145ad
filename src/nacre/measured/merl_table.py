"""Reflectance tabulated over Rusinkiewicz angles, as the MERL database has it.

Matusik, Pfister, Brand and McMillan 2003, "A Data-Driven Reflectance Model".
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Table, namespace
from nacre.geometry import half_difference, to_spherical
from nacre.measured.axis import KNOWN, LEAST_KNOWN, cell
from nacre.sampling import LobeSampledBrdf

Interpolation: TypeAlias = Literal["trilinear", "nearest"]

SCALES = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
"""Factors from stored red, green and blue to f_r in 1/sr, as in the database's own reader."""


class MerlBrdf(LobeSampledBrdf):
    """A reflectance tabulated over Rusinkiewicz angles, isotropic and reciprocal by construction.

    With ``"trilinear"`` interpolation, values are linear in (sqrt(theta_h), theta_d, phi_d) between
    nodes, constant beyond the last nodes of the polar angles, and periodic in phi_d. Nodes without
    a valid sample do not take part: the others' weights are scaled up, and the result counts as
    valid only if every node with weight is valid. With ``"nearest"``, the node below, as in the
    database's own reader. Where no node is valid, f_r is 0.

    `stored` has the shape (3, theta_h, theta_d, phi_d), else it is a ValueError: values as in a
    file, before :data:`SCALES`, kept as float32; a sample is invalid if any channel is negative.
    """

    isotropy_known = True

    def __init__(
        self, stored: npt.ArrayLike, name: str = "", interpolation: Interpolation = "trilinear"
    ) -> None:
        values = np.asarray(stored)
        if values.ndim != 4 or values.shape[0] != 3 or 0 in values.shape:
            raise ValueError(f"expected shape (3, theta_h, theta_d, phi_d), got {values.shape}")
        if interpolation not in get_args(Interpolation):
            raise ValueError(f"interpolation is 'trilinear' or 'nearest', not {interpolation!r}")
        super().__init__(name=name)
        self.interpolation: Interpolation = interpolation
        self._nodes = Table(np.moveaxis(values, 0, -1))  # a sample's channels lie side by side

    @property
    def dimensions(self) -> tuple[int, int, int]:
        theta_h, theta_d, phi_d, _ = self._nodes.values.shape
        return theta_h, theta_d, phi_d

    @property
    def stored(self) -> npt.NDArray[np.float32]:
        """Values as in a file, before :data:`SCALES`: shape (3, theta_h, theta_d, phi_d)."""
        return np.moveaxis(self._nodes.values, -1, 0)

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Whether a node holds a valid sample: shape (theta_h, theta_d, phi_d)."""
        return np.asarray(np.all(self._nodes.values >= 0.0, axis=-1))

    @property
    def nbytes(self) -> int:
        return self._nodes.values.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        red, green, blue, known = self._interpolate(wi, wo)
        scale = 1.0 / namespace(known).maximum(known, LEAST_KNOWN)
        return SCALES[0] * scale * red, SCALES[1] * scale * green, SCALES[2] * scale * blue

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return self._interpolate(wi, wo)[3] >= KNOWN

    def describe(self) -> dict[str, Any]:
        mask = self.mask
        f_r = self._nodes.values[mask] * np.asarray(SCALES, np.float32)
        sizes = " x ".join(map(str, self.dimensions))
        return super().describe() | {
            "grid": f"theta_h x theta_d x phi_d: {sizes}",
            "interpolation": self.interpolation,
            "value range": [float(f_r.min()), float(f_r.max())] if f_r.size else None,
            "invalid samples": float(1.0 - mask.mean()),
        }

    def _interpolate(self, wi: Components, wo: Components) -> tuple[Array, Array, Array, Array]:
        """Weighted sums of the channels over valid nodes, and the sum of those nodes' weights."""
        xp = namespace(*wi, *wo)
        red = green = blue = known = 0.0
        for index, weight in self._neighbors(wi, wo):
            r, g, b = (xp.take(self._nodes, index * 3 + channel) for channel in range(3))
            valid = xp.minimum(xp.minimum(r, g), b) >= 0.0
            weight = xp.where(valid, weight, 0.0 * weight)
            red, green, blue = red + weight * r, green + weight * g, blue + weight * b
            known = known + weight
        return red, green, blue, known

    def _neighbors(self, wi: Components, wo: Components) -> Iterator[tuple[Array, Array]]:
        """Flat indices of the nodes around a pair of directions, and their weights."""
        xp = namespace(*wi, *wo)
        n_h, n_d, n_p = self.dimensions
        h, d = half_difference(wi, wo)
        (theta_h, _), (theta_d, _) = to_spherical(h), to_spherical(d)
        # Reciprocity: phi_d and phi_d + pi are the same sample.
        phi_d = xp.arctan2(xp.abs(d[1]), xp.where(d[1] < 0.0, -d[0], d[0]))
        positions = (
            (xp.sqrt(theta_h * (2.0 / math.pi)) * n_h, n_h),
            (theta_d * (2.0 / math.pi) * n_d, n_d),
            (phi_d * (1.0 / math.pi) * n_p, n_p + 1),  # node n_p is node 0 again
        )
        low, part = zip(*(cell(position, count) for position, count in positions), strict=True)

        def flat(i: Array, j: Array, k: Array) -> Array:
            return (i * n_d + j) * n_p + xp.where(k >= n_p, 0 * k, k)

        if self.interpolation == "nearest":
            yield flat(*low), 0.0 * part[0] + 1.0
            return
        high = [xp.minimum(i + 1, n - 1) for i, (_, n) in zip(low, positions, strict=True)]
        for i, u in ((low[0], 1.0 - part[0]), (high[0], part[0])):
            for j, v in ((low[1], 1.0 - part[1]), (high[1], part[1])):
                for k, w in ((low[2], 1.0 - part[2]), (high[2], part[2])):
                    yield flat(i, j, k), u * v * w
