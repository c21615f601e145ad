"""The UTIA BRDF database: reflectance tabulated over the four angles of two directions.

Filip and Vavra 2014, "Template-Based Sampling of Anisotropic BRDFs". A ``.bin`` file holds nothing
but little-endian float64 values, all of red, then all of green, then all of blue; within a channel
theta_i is slowest, then phi_i, theta_v and phi_v. Polar angles are 0, 15, ..., 75 degrees, azimuths
0, 7.5, ..., 352.5 degrees: an image of 288 x 288, a row a light, a column a view.

The order is that of Filip's code, as ALTA's plugin, dj_brdf.h and
Sztrajman's UTIA-brdf have it. Values are taken as linear color, as by the last.
"""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Table, namespace
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join, to_spherical
from nacre.io.files import PathLike, read_bytes, write_encoded
from nacre.io.format import Format
from nacre.measured.axis import KNOWN, LEAST_KNOWN, Blend, cell, outer
from nacre.measured.raw import read_values
from nacre.sampling import LobeSampledBrdf

SHAPE = (3, 6, 48, 6, 48)  # channels, and nodes in theta_i, phi_i, theta_v and phi_v

_, _POLAR, _AZIMUTHS, _, _ = SHAPE
_STEP = math.radians(15.0)  # between nodes in theta
_LARGEST = 0.99 * float(np.finfo(np.float32).max)
"""Bound of the table's values: their weights may sum to a little more than 1."""
INVALID = -1.0
"""Stored value that :func:`save` writes for a sample that is not known."""

_SIZE = 8 * math.prod(SHAPE)


class UtiaBrdf(LobeSampledBrdf):
    """A reflectance tabulated over (theta_i, phi_i, theta_v, phi_v), i being the light.

    Values are linear between nodes in all four angles and periodic in the azimuths. Beyond the last
    polar node, 75 degrees, the line through the last two goes on, as in readers based on Filip's
    code; where it falls below 0, f_r is 0. Nodes without a valid sample do not take part: the
    others' weights are scaled up, and the result counts as valid only if every node with weight is
    valid, beyond 75 degrees also those that the line comes from. Where no node is valid, f_r is 0.

    `stored`, with the shape :data:`SHAPE`, else a ValueError, has f_r in 1/sr, kept as float32; a
    sample is invalid if any channel is negative.
    """

    isotropic = False

    def __init__(self, stored: npt.ArrayLike, name: str = "") -> None:
        values = np.asarray(stored)
        if values.shape != SHAPE:
            raise ValueError(f"expected shape {SHAPE}, got {values.shape}")
        super().__init__(name=name)
        self.stored = np.ascontiguousarray(values, np.float32)
        self._nodes = Table(_with_horizon(self.stored, self.mask))

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Whether a node holds a valid sample: shape (6, 48, 6, 48)."""
        return np.asarray(np.all(self.stored >= 0.0, axis=0))

    @property
    def nbytes(self) -> int:
        return self.stored.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        blend = _blend(wi, wo)
        red, green, blue, known = (self._sum(channel, blend) for channel in range(4))
        scale = 1.0 / namespace(known).maximum(known, LEAST_KNOWN)
        return scale * red, scale * green, scale * blue

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return self._sum(3, _blend(wi, wo)) >= KNOWN

    def describe(self) -> dict[str, Any]:
        mask = self.mask
        f_r = self.stored[:, mask]
        return super().describe() | {
            "grid": f"theta_i x phi_i x theta_v x phi_v: {' x '.join(map(str, SHAPE[1:]))}",
            "value range": [float(f_r.min()), float(f_r.max())] if f_r.size else None,
            "invalid samples": float(1.0 - mask.mean()),
        }

    def _sum(self, channel: int, blend: Blend) -> Array:
        """Weighted sum of a channel of the nodes; the fourth is 1 at valid nodes, else 0."""
        total: Array = 0.0
        for index, weight in blend:
            total = total + weight * namespace(index).take(self._nodes, index * 4 + channel)
        return total


def _with_horizon(
    stored: npt.NDArray[np.float32], mask: npt.NDArray[np.bool_]
) -> npt.NDArray[np.float32]:
    """Nodes with a polar angle of 90 degrees added, shape (7, 48, 7, 48, 4).

    The channels are red, green, blue, all 0 where invalid, and whether the node is valid.
    """
    table = np.concatenate([np.where(mask, stored, 0.0), mask[None]]).astype(np.float64)
    for axis in (1, 3):
        before, last = (np.take(table, [i], axis) for i in (_POLAR - 2, _POLAR - 1))
        horizon = 2.0 * last - before
        horizon[3] = last[3] * before[3]
        horizon[:3] *= horizon[3]
        table = np.concatenate([table, horizon], axis)
    return np.moveaxis(np.clip(table, -_LARGEST, _LARGEST), 0, -1).astype(np.float32)


def _blend(wi: Components, wo: Components) -> Blend:
    """Nodes around a pair of directions and their weights."""
    light, view = (
        outer(_polar(theta), _azimuth(phi), _AZIMUTHS)
        for theta, phi in (to_spherical(wi), to_spherical(wo))
    )
    return outer(light, view, (_POLAR + 1) * _AZIMUTHS)


def _polar(theta: Array) -> Blend:
    low, part = cell(theta * (1.0 / _STEP), _POLAR)
    return [(low, 1.0 - part), (low + 1, part)]


def _azimuth(phi: Array) -> Blend:
    xp = namespace(phi)
    position = phi * (_AZIMUTHS / (2.0 * math.pi))
    position = xp.where(position < 0.0, position + float(_AZIMUTHS), position)
    low, part = cell(position, _AZIMUTHS)
    high = xp.where(low == _AZIMUTHS - 1, 0 * low, low + 1)
    return [(low, 1.0 - part), (high, part)]


def tabulate(brdf: Brdf) -> UtiaBrdf:
    """Any reflectance on the grid of the database; invalid where it is not known or not finite."""
    polar, azimuths = np.radians(15.0 * np.arange(_POLAR)), np.radians(7.5 * np.arange(_AZIMUTHS))
    theta, phi = np.meshgrid(polar, azimuths, indexing="ij")
    nodes = join(from_spherical(theta, phi)).reshape(-1, 3)
    wi, wo = nodes[:, None], nodes[None, :]
    f_r = brdf.eval(wi, wo)
    known = np.isfinite(f_r).all(axis=-1) & brdf.valid(wi, wo)
    stored = np.where(known[..., None], f_r, INVALID)
    return UtiaBrdf(np.moveaxis(stored, -1, 0).reshape(SHAPE), brdf.name)


def load(path: PathLike) -> UtiaBrdf:
    """Read a UTIA ``.bin`` file, whose name becomes the material's.

    A FormatError says that it cannot be read, has another length, or has a value that is not
    finite.
    """
    path = Path(path)
    data = read_bytes(path, 2 * _SIZE)
    contents = "288 x 288 x 3 values of a UTIA table"
    values = read_values(data, str(path), contents, math.prod(SHAPE), ["<f8"])
    return UtiaBrdf(values.reshape(SHAPE), path.stem)


def save(brdf: Brdf, path: PathLike) -> None:
    """Write a UTIA ``.bin`` file, whole or not at all.

    A :class:`UtiaBrdf` is written as it is, to float32 precision, invalid samples included: what
    this function wrote comes back byte for byte. Anything else is tabulated first (see
    :func:`tabulate`).
    """
    utia = brdf if isinstance(brdf, UtiaBrdf) else tabulate(brdf)
    write_encoded(path, np.ndarray.tobytes, utia.stored.astype("<f8"))


def _has_length(path: Path) -> bool:
    with suppress(OSError):
        return path.stat().st_size == _SIZE
    return False


FORMAT = Format("UTIA", (".bin",), None, load, save, claims=_has_length)
"""Entry of the registry of formats: the files start with nothing that tells them apart."""
