"""A file format: isotropic tables as text, over two polar angles and the azimuth between.

The first line is `polar table N M`, the second the name. N x N x M lines of red, green and blue
follow: f_r in 1/sr at theta_i, then theta_o, from 0 to 90 degrees in N steps, then the azimuth from
the light to the viewer, from 0 to 180 degrees in M steps; the last one changes fastest.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from nacre import Brdf, FormatError
from nacre.array import Components, Floats
from nacre.geometry import from_spherical, join
from nacre.io.files import atomic_path, read_bytes
from nacre.io.format import Format

MAGIC = "polar table"
POLAR, AZIMUTHS = 31, 37
"""Steps of the tables that are written."""
SIZE_LIMIT = 1 << 26


class PolarBrdf(Brdf):
    """A table of f_r, linear between its nodes.

    Parameters
    ----------
    table
        Shape (polar, polar, azimuths, 3), in 1/sr, linear RGB.
    name
        Of the material.
    """

    isotropic, isotropy_known = True, True
    traceable = False  # its interpolation takes NumPy arrays only

    def __init__(self, table: Floats, name: str = "") -> None:
        super().__init__(name=name)
        self.table = table

    @property
    def nbytes(self) -> int:
        """Bytes of the table."""
        return self.table.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.Brdf`."""
        polar, _, azimuths, _ = self.table.shape
        theta_i, theta_o = (np.arccos(np.clip(w[2], 0.0, 1.0)) for w in (wi, wo))
        across, along = wi[0] * wo[1] - wi[1] * wo[0], wi[0] * wo[0] + wi[1] * wo[1]
        phi = np.abs(np.arctan2(across, along))
        steps = 2.0 * (polar - 1) / math.pi
        at = [steps * theta_i, steps * theta_o, phi * (azimuths - 1) / math.pi]
        red, green, blue = (
            map_coordinates(self.table[..., channel], at, order=1, mode="nearest")
            for channel in range(3)
        )
        return red, green, blue


def load(path: Path) -> PolarBrdf:
    """Read a table; whatever is wrong with it is a :class:`nacre.FormatError` that names the file.

    Raises
    ------
    FormatError
        If the file cannot be read or is not such a table.
    """
    try:
        first, name, *rows = read_bytes(path, SIZE_LIMIT).decode("utf-8").splitlines()
        polar, azimuths = map(int, first.removeprefix(MAGIC).split())
        table = np.array([row.split() for row in rows], np.float32)
        if min(polar, azimuths) < 2 or table.shape != (polar * polar * azimuths, 3):
            raise ValueError(f"{len(rows)} lines are no table of {polar} x {polar} x {azimuths}")
        if not np.isfinite(table).all():
            raise ValueError("some values are not finite")
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(f"{path}: is not a whole polar table: {error}") from error
    return PolarBrdf(table.reshape(polar, polar, azimuths, 3), name)


def save(brdf: Brdf, path: Path) -> None:
    """Write any isotropic reflectance, whole or not at all; a table is written as it is.

    Raises
    ------
    FormatError
        If it is anisotropic, or the file cannot be written.
    """
    if not brdf.isotropic:
        raise FormatError(f"{path}: polar tables hold isotropic reflectance only")
    table = brdf.table if isinstance(brdf, PolarBrdf) else tabulate(brdf)
    polar, _, azimuths, _ = table.shape
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f"{MAGIC} {polar} {azimuths}\n{' '.join(brdf.name.split())}\n")
        np.savetxt(file, table.reshape(-1, 3), "%.9g")


def tabulate(brdf: Brdf) -> Floats:
    """f_r at the nodes; those on the horizon, where it is not defined, lie just above it."""
    polar = np.minimum(np.linspace(0.0, math.pi / 2.0, POLAR), 1.57)
    azimuths = np.linspace(0.0, math.pi, AZIMUTHS)
    theta_i, theta_o, phi = np.meshgrid(polar, polar, azimuths, indexing="ij")
    wi, wo = from_spherical(theta_i, 0.0 * phi), from_spherical(theta_o, phi)
    return brdf.eval(join(wi), join(wo)).astype(np.float32)


FORMAT = Format(
    "polar table",
    (".polar",),
    lambda head: head.startswith(MAGIC.encode()),
    load,
    save,
    isotropic=True,
)
"""The entry point of the package, in `pyproject.toml`."""
