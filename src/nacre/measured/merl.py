"""Materials of the MERL BRDF database and tables of the same layout.

Matusik, Pfister, Brand and McMillan 2003, "A Data-Driven Reflectance Model". A file holds three
little-endian int32 node counts (theta_h, theta_d, phi_d: 90, 90, 180), then the float64 values of
red, of green and of blue, phi_d varying fastest. Nielsen, Jensen and Ramamoorthi 2015 published
theirs in the same layout.

Node (i, j, k) stands at theta_h = (i / 90)^2 pi / 2, theta_d = (j / 90) pi / 2 and
phi_d = (k / 180) pi: the lower corner of the bin to which the database's own reader assigns it. A
negative value marks a sample that was not measured.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np

from nacre.brdf import Brdf
from nacre.files import Format, FormatError, PathLike, atomic_path, read_bytes
from nacre.geometry import from_rusinkiewicz_angles, join
from nacre.measured.merl_table import SCALES, Interpolation, MerlBrdf

DIMENSIONS = (90, 90, 180)
"""Nodes in theta_h, theta_d and phi_d of the database's files."""

INVALID = -1.0
"""Stored value that :func:`save` writes for a sample that is not known."""

_FULL_TURN = (90, 90, 360)
"""Header of files that others made in this layout without folding phi_d."""
_HEADER = struct.Struct("<3i")
_NODE_LIMIT = 1024
_SIZE_LIMIT = 1 << 30
_HORIZON = 1e-6
"""A node whose directions are not higher than this (cosine) has no reflectance to tabulate."""


def tabulate(brdf: Brdf) -> MerlBrdf:
    """Any isotropic reflectance on the grid of the MERL database.

    Nodes at or below the horizon, and those where `brdf` is not known or not finite, become
    invalid. The table can hold one value for a pair of directions and its exchange: it takes f_r
    with the difference vector, which points to the light, at phi_d in [0, pi).

    Raises
    ------
    FormatError
        If `brdf` is anisotropic.
    """
    if not brdf.isotropic:
        raise FormatError(f"{brdf.name or 'this material'}: MERL holds isotropic reflectance only")
    n_h, n_d, n_p = DIMENSIONS
    theta_d, phi_d = np.meshgrid(
        np.arange(n_d) / n_d * (math.pi / 2.0), np.arange(n_p) / n_p * math.pi, indexing="ij"
    )
    stored = np.full((3, *DIMENSIONS), INVALID, np.float32)
    for i in range(n_h):
        theta_h = np.full_like(theta_d, (i / n_h) ** 2 * (math.pi / 2.0))
        wi, wo = map(join, from_rusinkiewicz_angles(theta_h, 0.0 * theta_h, theta_d, phi_d))
        f_r = brdf.eval(wi, wo)
        known = (wi[..., 2] > _HORIZON) & (wo[..., 2] > _HORIZON)
        known &= np.isfinite(f_r).all(axis=-1) & brdf.valid(wi, wo)
        row = np.where(known[..., None], f_r / np.asarray(SCALES), INVALID)
        stored[:, i] = np.moveaxis(row, -1, 0)
    return MerlBrdf(stored, brdf.name)


def load(path: PathLike, interpolation: Interpolation = "trilinear") -> MerlBrdf:
    """Read a MERL ``.binary`` file.

    Parameters
    ----------
    path
        File to read; its name becomes the material's.
    interpolation
        See :class:`MerlBrdf`.

    Raises
    ------
    FormatError
        If the file cannot be read, its length is not what its header says, or a value is not
        finite.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    if len(data) < _HEADER.size:
        raise FormatError(f"{path}: ends within the header; the file is cut short")
    dimensions = _HEADER.unpack_from(data)
    if not all(1 <= n <= _NODE_LIMIT for n in dimensions):
        raise FormatError(
            f"{path}: header gives {' x '.join(map(str, dimensions))} nodes, expected 90 x 90 x 180"
        )
    if dimensions == _FULL_TURN:
        raise FormatError(
            f"{path}: 360 nodes in phi_d span a full turn of a material that is not reciprocal; "
            "only tables over half a turn are read"
        )
    size = _HEADER.size + 3 * 8 * math.prod(dimensions)
    if len(data) != size:
        problem = "is cut short" if len(data) < size else "has trailing bytes"
        raise FormatError(
            f"{path}: {len(data)} bytes, but {' x '.join(map(str, dimensions))} nodes take {size}; "
            f"the file {problem}"
        )
    values = np.frombuffer(data, "<f8", offset=_HEADER.size).reshape(3, *dimensions)
    if not (np.abs(values) <= np.finfo(np.float32).max).all():  # also false for NaN
        raise FormatError(f"{path}: values: some are not finite; download the file again")
    return MerlBrdf(values, Path(path).stem, interpolation)


def save(brdf: Brdf, path: PathLike) -> None:
    """Write a MERL ``.binary`` file, whole or not at all.

    A :class:`MerlBrdf` is written as it is, to float32 precision, invalid samples included: what
    this function wrote comes back byte for byte. Anything else is tabulated first (see
    :func:`tabulate`).

    Raises
    ------
    FormatError
        If `brdf` is anisotropic or the path cannot be written.
    """
    merl = brdf if isinstance(brdf, MerlBrdf) else tabulate(brdf)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_HEADER.pack(*merl.dimensions))
        for channel in merl.stored:
            file.write(channel.astype("<f8").tobytes())


def _recognise(head: bytes) -> bool:
    return len(head) >= _HEADER.size and all(
        1 <= n <= _NODE_LIMIT for n in _HEADER.unpack_from(head)
    )


FORMAT = Format("MERL", (".binary",), _recognise, load, save)
"""Entry of the registry of formats."""
