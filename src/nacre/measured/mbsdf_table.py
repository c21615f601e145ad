"""Reflectance over the polar angles of light and view and the azimuth between, as MDL has it.

NVIDIA Material Definition Language 1.2, Language Specification, Appendix B "MBSDF file format".
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Table, namespace
from nacre.geometry import to_spherical
from nacre.measured.axis import Blend, cell, outer
from nacre.sampling import LobeSampledBrdf

SIZE_LIMIT = 1 << 30  # bytes of the largest file
TEXT_LIMIT = 1 << 16  # bytes of the lines of text at the start of a file
NODE_LIMIT = 1024


@dataclass(frozen=True)
class Resolution:
    """Numbers of nodes of a table, 1 to 1024 each; a file takes 12 theta^2 phi bytes.

    A ValueError says that a number is out of range, or the file would be larger than :func:`load`
    reads.
    """

    theta: int = 45  # polar angles of the light, and as many of the view
    phi: int = 90  # azimuths of the view from the light over half a turn

    def __post_init__(self) -> None:
        if not all(1 <= nodes <= NODE_LIMIT for nodes in astuple(self)):
            raise ValueError(f"numbers of nodes are 1 to {NODE_LIMIT}")
        if 12 * self.theta**2 * self.phi + TEXT_LIMIT > SIZE_LIMIT:
            raise ValueError(f"a file would take more than {SIZE_LIMIT} bytes")


class MbsdfBrdf(LobeSampledBrdf):
    """A reflectance tabulated over the polar angles of light and view and the azimuth between.

    Values are linear in the three angles between the centers of cells and constant beyond the outer
    centers, as in the MDL SDK's examples, `texture_support_cuda.h`. The table need not be
    reciprocal. `stored` has the shape (theta_in, theta_out, phi, 3), or (..., 1) where it is gray,
    with as many theta_in, the light's, as theta_out, else it is a ValueError: f_r in 1/sr, float32,
    below 0 where a measurement is. `remarks` are lines of text in the file.
    """

    isotropy_known = True

    def __init__(
        self, stored: npt.ArrayLike, name: str = "", remarks: tuple[str, ...] = ()
    ) -> None:
        values = np.asarray(stored)
        if values.ndim != 4 or values.shape[3] not in (1, 3) or 0 in values.shape:
            raise ValueError(f"expected shape (theta_in, theta_out, phi, 3), got {values.shape}")
        if values.shape[0] != values.shape[1]:
            raise ValueError(f"expected as many theta_in as theta_out, got {values.shape}")
        super().__init__(name=name)
        self.remarks = remarks
        self._nodes = Table(values)

    @property
    def stored(self) -> npt.NDArray[np.float32]:
        return self._nodes.values

    @property
    def nbytes(self) -> int:
        return self.stored.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        theta, _, phi, channels = self.stored.shape
        (theta_i, _), (theta_o, _) = to_spherical(wi), to_spherical(wo)
        cosine = wi[0] * wo[0] + wi[1] * wo[1]
        sine = wi[0] * wo[1] - wi[1] * wo[0]
        azimuth = xp.arctan2(xp.abs(sine), cosine) * (phi / math.pi)
        polar = theta * 2.0 / math.pi
        light, view = nodes_around(theta_i * polar, theta), nodes_around(theta_o * polar, theta)
        blend = outer(outer(light, view, theta), nodes_around(azimuth, phi), phi)
        sums = [
            sum(weight * xp.take(self._nodes, index * channels + c) for index, weight in blend)
            for c in range(channels)
        ]
        return sums[0], sums[channels // 2], sums[-1]

    def describe(self) -> dict[str, Any]:
        f_r = self.stored
        facts = {
            "grid": f"theta_in x theta_out x phi: {' x '.join(map(str, f_r.shape[:3]))}",
            "value range": [float(f_r.min()), float(f_r.max())],
            "values below 0": float((f_r < 0.0).mean()),
        }
        return super().describe() | facts | ({"remarks": self.remarks} if self.remarks else {})


def nodes_around(position: Array, count: int) -> Blend:
    """Nodes around a position in cells, whose centers the nodes are; constant beyond the ends."""
    xp = namespace(position)
    low, part = cell(xp.maximum(position - 0.5, 0.0), count)
    return [(low, 1.0 - part), (xp.minimum(low + 1, count - 1), part)]
