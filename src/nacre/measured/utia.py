"""Materials of the UTIA BRDF database: anisotropic tables in raw ``.bin`` files.

Filip and Vavra 2014, "Template-Based Sampling of Anisotropic BRDFs". A file holds nothing but
little-endian float64 values, all of red, then all of green, then all of blue; within a channel
theta_i is slowest, then phi_i, theta_v and phi_v. Polar angles are 0, 15, ..., 75 degrees, azimuths
0, 7.5, ..., 352.5 degrees: an image of 288 x 288, a row a light, a column a view.

The order is that of Filip's code, as ALTA's plugin, dj_brdf.h and
Sztrajman's UTIA-brdf have it. Values are taken as linear color, as by the last.
"""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import numpy as np

from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.measured.raw import read_values
from nacre.measured.utia_table import SHAPE, UtiaBrdf

INVALID = -1.0
"""Stored value that :func:`save` writes for a sample that is not known."""

_SIZE = 8 * math.prod(SHAPE)


def tabulate(brdf: Brdf) -> UtiaBrdf:
    """Any reflectance on the grid of the UTIA database.

    Nodes where `brdf` is not known or not finite become invalid.
    """
    _, polar, azimuths, _, _ = SHAPE
    theta, phi = np.meshgrid(
        np.radians(15.0 * np.arange(polar)), np.radians(7.5 * np.arange(azimuths)), indexing="ij"
    )
    nodes = join(from_spherical(theta, phi)).reshape(-1, 3)
    wi, wo = nodes[:, None], nodes[None, :]
    f_r = brdf.eval(wi, wo)
    known = np.isfinite(f_r).all(axis=-1) & brdf.valid(wi, wo)
    stored = np.where(known[..., None], f_r, INVALID)
    return UtiaBrdf(np.moveaxis(stored, -1, 0).reshape(SHAPE), brdf.name)


def load(path: PathLike) -> UtiaBrdf:
    """Read a UTIA ``.bin`` file, whose name becomes the material's.

    A FormatError says that it cannot be read, has another length, or a value is not finite.
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
    with atomic_path(path) as temporary:
        temporary.write_bytes(utia.stored.astype("<f8").tobytes())


def _has_length(path: Path) -> bool:
    with suppress(OSError):
        return path.stat().st_size == _SIZE
    return False


FORMAT = Format("UTIA", (".bin",), None, load, save, claims=_has_length)
"""Entry of the registry of formats: the files start with nothing that tells them apart."""
