"""Materials of the EPFL RGL database: adaptively parametrized tables in tensor files.

Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and
Rendering". The color, or the spectrum, is tabulated on a square that a density of half vectors
warps, see :mod:`nacre.measured.adaptive`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Brdf
from nacre.geometry import split
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.measured.adaptive import AdaptiveWarp, Point, View, unit_azimuth, unit_elevation
from nacre.measured.axis import zero_index
from nacre.measured.rgl_tables import RglTables, read_tables
from nacre.measured.rgl_writer import Resolution, tabulate_tables, with_spectra, write_tables
from nacre.measured.tensor_file import MAGIC
from nacre.measured.warp import Grid

_MIN_COSINE = 1e-20  # keeps directions at the horizon, which callers discard, from dividing by 0


class RglBrdf(Brdf):
    """A material of the RGL database, from a checked tensor file; samples itself with its own map.

    f_r is the tabulated color times ndf / (4 sigma cos theta_i), theta_i being the light's: the
    tables hold reflectance with the cosine. Single negative channels are colors outside the Rec.
    709 gamut, not missing samples. The tables are zero in every channel only around nodes whose
    light direction lies below the horizon; there f_r is not known. For a spectral file the colors
    are computed node by node, and the spectra stay for :meth:`eval_spectral`. Without a name, the
    file's own description is the material's.
    """

    isotropy_known = True

    def __init__(self, tables: RglTables, name: str = "") -> None:
        self._warp = AdaptiveWarp(tables)
        super().__init__(name=name or tables.description, sampler=self._warp)
        self.isotropic = tables.isotropic
        self.tables = tables
        self.wavelengths = tables.wavelengths
        self._ndf, self._sigma = Grid(tables.ndf[None]), Grid(tables.sigma[None])
        channels = np.moveaxis(tables.rgb, 2, 0)
        self._rgb = [Grid(channel.reshape(-1, *channel.shape[2:])) for channel in channels]

    @property
    def nbytes(self) -> int:
        """The luminance does not count: it serves sampling only."""
        return self.tables.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        view = self._warp.view(wo)
        point = self._warp.invert(wi, view)
        scale = self._scale(wi, point, view)
        red, green, blue = (scale * channel for channel in self._color(point, view))
        return red, green, blue

    def eval_bands(self, wi: Floats, wo: Floats) -> Floats:
        spectra = self.tables.spectra
        if spectra is None:
            return super().eval_bands(wi, wo)
        self.tables.check()
        light, view = split(wi), self._warp.view(split(wo))
        point = self._warp.invert(light, view)
        scale: Floats = self._scale(light, point, view)
        nodes = spectra.reshape(-1, spectra.shape[2], spectra.shape[3] * spectra.shape[4])
        patch = self._rgb[0].locate(point.u, point.v)
        bands = np.zeros((len(wi), nodes.shape[1]), scale.dtype)
        for slices, fraction in view.blend:
            for node, weight in self._rgb[0].nodes(patch):
                bands += (fraction * weight)[:, None] * nodes[slices, :, node]
        return scale[:, None] * bands

    def valid_components(self, wi: Components, wo: Components) -> Array:
        """Where some channel is positive."""
        view = self._warp.view(wo)
        red, green, blue = self._color(self._warp.invert(wi, view), view)
        xp = namespace(red)
        return xp.maximum(xp.maximum(red, green), blue) > 0.0

    def _scale(self, wi: Components, point: Point, view: View) -> Array:
        """Factor on tabulated reflectance: the jacobian, and no cosine."""
        xp = namespace(*wi, point.x)
        scale = 1.0 / xp.maximum(wi[2], _MIN_COSINE)
        if self.tables.jacobian:
            whole = [(zero_index(scale), 1.0)]
            ndf = self._ndf.eval(point.x, point.y, whole)
            sigma = self._sigma.eval(unit_elevation(view.theta), unit_azimuth(view.phi), whole)
            scale = scale * ndf / (4.0 * xp.maximum(sigma, _MIN_COSINE))
        return scale

    def _color(self, point: Point, view: View) -> Components:
        patch = self._rgb[0].locate(point.u, point.v)
        red, green, blue = (channel.at(patch, view.blend) for channel in self._rgb)
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        """Fractions are of tabulated points."""
        tables, rgb = self.tables, self.tables.rgb
        return super().describe() | {
            "grid": (
                f"theta_i x phi_i: {len(tables.theta_i)} x {len(tables.phi_i)}; "
                f"vndf {_size(tables.vndf)}; rgb {_size(rgb)}"
            ),
            "table range": [float(rgb.min()), float(rgb.max())],
            "points with a negative channel": float((rgb < 0.0).any(axis=2).mean()),
            "points below the horizon": float((rgb <= 0.0).all(axis=2).mean()),
        }


def _size(table: npt.NDArray[np.floating]) -> str:
    return " x ".join(map(str, table.shape[-2:]))


def load(path: PathLike) -> RglBrdf:
    """Read an RGL tensor file, ``_rgb.bsdf`` or ``_spec.bsdf``."""
    tables = read_tables(path)
    return RglBrdf(tables, tables.description or Path(path).stem)


def tabulate(brdf: Brdf, resolution: Resolution | None = None) -> RglBrdf:
    """As :func:`nacre.measured.rgl_writer.tabulate_tables`, as a reflectance."""
    return RglBrdf(tabulate_tables(brdf, resolution), brdf.name)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write an RGL tensor file, whole or not at all.

    An :class:`RglBrdf` is written as it is, unless a resolution is given: every array of its file
    comes back bit for bit, spectra included. Anything else is tabulated first (see
    :func:`tabulate`). A file whose name ends in ``_spec.bsdf`` holds spectra: those of `brdf` where
    it has some, else spectra of its colors (see :func:`nacre.color.upsample`). A FormatError says
    that the path cannot be written, or an anisotropic material needs more azimuths.
    """
    spectral = _holds_spectra(path)
    if not isinstance(brdf, RglBrdf) or resolution is not None:
        tables = tabulate_tables(brdf, resolution, spectral)
    elif spectral and brdf.wavelengths is None:
        tables = with_spectra(brdf.tables)
    else:
        tables = brdf.tables
    write_tables(tables, path)


def _holds_spectra(path: PathLike) -> bool:
    """Whether a file with this name is to hold spectra, by how the database names its files."""
    return Path(path).stem.endswith("_spec")


FORMAT = Format(
    "RGL",
    (".bsdf",),
    lambda head: head.startswith(MAGIC),
    load,
    save,
    resolution=Resolution,
    keeps_bands=lambda brdf, path, anew: (
        _holds_spectra(path) or (isinstance(brdf, RglBrdf) and not anew)
    ),
)
