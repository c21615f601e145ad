"""Materials of the MERL BRDF database and tables with the same layout.

Matusik, Pfister, Brand and McMillan 2003, "A Data-Driven Reflectance Model". A file holds three
little-endian int32 node counts (theta_h, theta_d, phi_d: 90, 90, 180), then the float64 values of
red, of green and of blue, phi_d varying fastest. Nielsen, Jensen and Ramamoorthi 2015 published
theirs in the same layout. Files with float32 or float16 in place of float64 are read too: the
length of a file tells which it is.

Node (i, j, k) stands at theta_h = (i / 90)^2 pi / 2, theta_d = (j / 90) pi / 2 and phi_d = (k /
180) pi: the lower corner of the bin to which the database's own reader assigns it. A negative value
marks a sample that was not measured.
"""

from __future__ import annotations

import math
import struct
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np

from nacre.array import Components
from nacre.brdf import Brdf
from nacre.errors import CUT_SHORT, FormatError
from nacre.geometry import from_rusinkiewicz_angles, join
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.measured.merl_table import SCALES, Interpolation, MerlBrdf
from nacre.measured.raw import LARGEST, read_values
from nacre.sampling import check_isotropic

INVALID = -1.0
"""Stored value that :func:`save` writes for a sample that is not known."""

_HEADER = struct.Struct("<3i")
_TYPES = ("<f8", "<f4", "<f2")
NODE_LIMIT = 1024
_SIZE_LIMIT = 1 << 30
_FULL_TURN = (90, 90, 360)  # header of files that others made in this layout without folding phi_d
_HORIZON = 1e-6  # a node with a direction no higher (cosine) has no reflectance to tabulate


@dataclass(frozen=True)
class Resolution:
    """Numbers of nodes of a table, 1 to 1024 per angle; a file takes 24 bytes for each of their
    product.

    A ValueError says that a number is out of range, or that :func:`load` would not read the table.
    """

    theta_h: int = 90
    theta_d: int = 90
    phi_d: int = 180

    def __post_init__(self) -> None:
        if not all(1 <= nodes <= NODE_LIMIT for nodes in astuple(self)):
            raise ValueError(f"numbers of nodes are 1 to {NODE_LIMIT}")
        if _HEADER.size + 24 * math.prod(astuple(self)) > _SIZE_LIMIT:
            raise ValueError(f"a file would take more than {_SIZE_LIMIT} bytes")
        if astuple(self) == _FULL_TURN:
            raise ValueError("360 nodes in phi_d stand for a full turn; take 180 for half a turn")

    @property
    def dimensions(self) -> tuple[int, int, int]:
        return self.theta_h, self.theta_d, self.phi_d


def node_directions(
    resolution: Resolution, rows: slice = slice(None)
) -> tuple[Components, Components]:
    """Directions (wi, wo) of the nodes with phi_h = 0; either may lie below the horizon.

    Components have shapes that broadcast to (rows, theta_d, phi_d), float64; `rows` choose from
    theta_h.
    """
    n_h, n_d, n_p = resolution.dimensions
    theta_h = ((np.arange(n_h)[rows] / n_h) ** 2 * (math.pi / 2.0))[:, None, None]
    theta_d = (np.arange(n_d) / n_d * (math.pi / 2.0))[:, None]
    phi_d = np.arange(n_p) / n_p * math.pi
    return from_rusinkiewicz_angles(theta_h, 0.0, theta_d, phi_d)


def tabulate(brdf: Brdf, resolution: Resolution | None = None) -> MerlBrdf:
    """Any isotropic reflectance on a grid like that of the MERL database, which is the default.

    Nodes at or below the horizon, and those where `brdf` is not known or not finite, become
    invalid. The table can hold one value for a pair of directions and its exchange: it takes f_r
    with the difference vector, which points to the light, at phi_d in [0, pi).

    Raises a FormatError if `brdf` is anisotropic, and a NacreError if it only says that it is
    isotropic.
    """
    if not brdf.isotropic:
        raise FormatError(f"{brdf.name or 'this material'}: MERL holds isotropic reflectance only")
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    scales, stored = np.asarray(SCALES), np.empty((3, *resolution.dimensions), np.float32)
    for i in range(resolution.theta_h):
        wi, wo = map(join, node_directions(resolution, slice(i, i + 1)))
        f_r = np.minimum(brdf.eval(wi, wo), LARGEST * scales)
        known = (wi[..., 2] > _HORIZON) & (wo[..., 2] > _HORIZON)
        known &= np.isfinite(f_r).all(axis=-1) & brdf.valid(wi, wo)
        row = np.where(known[..., None], f_r / scales, INVALID)
        stored[:, i : i + 1] = np.moveaxis(row, -1, 0)
    return MerlBrdf(stored, brdf.name)


def load(path: PathLike, interpolation: Interpolation = "trilinear") -> MerlBrdf:
    """Read a MERL ``.binary`` file, whose name becomes the material's; see :class:`MerlBrdf`.

    A FormatError says that the file cannot be read, its length is not what its header says with
    float64, float32 or float16 values, or a value is not finite.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    if len(data) < _HEADER.size:
        raise FormatError(f"{path}: ends within the header; {CUT_SHORT}")
    dimensions = _HEADER.unpack_from(data)
    contents = f"{' x '.join(map(str, dimensions))} nodes"
    if not _recognize(data):
        raise FormatError(f"{path}: header gives {contents}, expected 90 x 90 x 180")
    if dimensions == _FULL_TURN:
        raise FormatError(
            f"{path}: 360 nodes in phi_d span a full turn of a material that is not reciprocal; "
            "only tables over half a turn are read"
        )
    values = read_values(data, str(path), contents, 3 * math.prod(dimensions), _TYPES, _HEADER.size)
    return MerlBrdf(values.reshape(3, *dimensions), Path(path).stem, interpolation)


def as_table(brdf: Brdf, resolution: Resolution | None) -> MerlBrdf:
    """The table to write: a :class:`MerlBrdf` itself, unless a resolution is given."""
    return brdf if isinstance(brdf, MerlBrdf) and resolution is None else tabulate(brdf, resolution)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a MERL ``.binary`` file of an isotropic reflectance, whole or not at all.

    A :class:`MerlBrdf` is written as it is, to float32 precision, invalid samples included, unless
    a resolution is given: what this function wrote comes back byte for byte. Anything else is
    tabulated first (see :func:`tabulate`).
    """
    merl = as_table(brdf, resolution)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(_HEADER.pack(*merl.dimensions))
        for channel in merl.stored:
            file.write(channel.astype("<f8").tobytes())


def _recognize(head: bytes) -> bool:
    return len(head) >= _HEADER.size and all(
        1 <= n <= NODE_LIMIT for n in _HEADER.unpack_from(head)
    )


FORMAT = Format("MERL", (".binary",), _recognize, load, save, isotropic=True, resolution=Resolution)
