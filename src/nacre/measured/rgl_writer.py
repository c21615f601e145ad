"""Any reflectance on the adaptive parametrization of the RGL database.

What :mod:`nacre.measured.adaptive` reads (Dupuy and Jakob 2018, "An Adaptive Parameterization for
Efficient Material Acquisition and Rendering"), computed from the material itself: the density of
microfacet normals by power iteration (:mod:`nacre.sampling.microfacets`), from it the densities of
visible normals that warp the square, and on the warped square the color relative to what the
microfacets alone would give.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats
from nacre.brdf import Brdf
from nacre.color import luminance, primaries, upsampling_nodes
from nacre.errors import FormatError
from nacre.geometry import from_spherical, half_vector, join, reflect, to_spherical
from nacre.io.files import PathLike
from nacre.measured.adaptive import unit_azimuth, unit_elevation
from nacre.measured.rgl_tables import RglTables
from nacre.measured.symmetry import symmetry
from nacre.measured.tensor_file import Tensors, write_tensors
from nacre.measured.warp import Grid, Warp
from nacre.sampling import check_isotropic
from nacre.sampling.microfacets import GRAZING, NormalGrid
from nacre.spectra import rgb_weights

_HIGHLIGHTS = tuple(math.radians(angle) for angle in (60.0, 75.0))
"""Angles between half vector and light at which highlights add to the density of normals."""
_GRAZING_POWER = 1.5  # how much denser views are toward the horizon, where most changes; 1: evenly
_DIM, _DIM_POWER = 0.25, 0.25
"""Part of the normals that follows this power of D: leaves points of the square to dim directions.
A uniform part would too, but between a bright point and a dark one f_r cos / D is interpolated, and
reading multiplies by D: where D stays high, a highlight without a diffuse part gets a halo."""
_UNIFORM = 1e-4  # part of the normals that is uniform: keeps D, which divides the color, above 0
_RIM = 0.25  # cosine below the horizon to which tables go on, so that what is above interpolates
_LOW = 1e-3  # from lights at this cosine and at twice it, f_r cos is extrapolated to the horizon
_MIN_KNOWN = 1e-12  # color of a point that is known to be black; 0 would say that nothing is known
_MIN_LUMINANCE = 0.005  # relative to the mean, added where light can come from: all is sampled
_LARGEST = 1e30
_MIN_AZIMUTHS = 4  # with fewer, a table cannot tell an anisotropic material from an isotropic one
_MAX_NORMALS = 1 << 13  # bound of the half vectors: memory grows with the square of their number
_MAX_VALUES = 1 << 27  # bound of all numbers in a file; it is half a gigabyte then


@dataclass(frozen=True)
class Resolution:
    """Numbers of nodes of the tables; a file takes about four bytes for each.

    An anisotropic material needs at least 4 azimuths of the view; an isotropic one has 1, and the
    table of a symmetric one a half or a quarter. A ValueError says that a number is too small to
    interpolate, or that the tables are too large to compute or to keep.
    """

    phi_i: int  # azimuths of the view over a full turn, both ends included
    theta_i: int  # polar angles of the view
    square: int  # points along an edge of the warped square that holds the color
    azimuths: int  # of the half vector, for the densities of normals
    polars: int  # likewise; at most 8192 pairs

    def __post_init__(self) -> None:
        if self.phi_i < 1 or min(astuple(self)[1:]) < 2:
            raise ValueError("there are 2 or more nodes, 1 or more for phi_i")
        normals = self.azimuths * self.polars
        if normals > _MAX_NORMALS:
            raise ValueError(f"azimuths times polars is at most {_MAX_NORMALS}")
        if self.phi_i * self.theta_i * (4 * self.square**2 + normals) > _MAX_VALUES:
            raise ValueError(f"a file would hold more than {_MAX_VALUES} numbers")


ISOTROPIC = Resolution(1, 40, 72, 32, 128)  # default for isotropic materials

ANISOTROPIC = Resolution(33, 16, 48, 64, 64)  # default for anisotropic materials

SYMMETRIC = Resolution(65, 24, 48, 64, 64)
"""Default for anisotropic materials that half a turn and mirroring leave unchanged."""


def tabulate_tables(
    brdf: Brdf, resolution: Resolution | None = None, spectral: bool = False
) -> RglTables:
    """Tables of any reflectance, isotropic or not.

    The table's interpolation needs values a little below the horizon: there it holds f_r cos on the
    line through its values at the horizon and at the direction mirrored up. Farther down, and where
    f_r is not known, tables are 0. f_r is clamped to be non-negative, and left out where it is not
    finite. Azimuths span the part of a full turn that the material's symmetry leaves.

    The default resolution is :data:`ISOTROPIC`, :data:`ANISOTROPIC` or :data:`SYMMETRIC`. Spectral
    tables have the spectra of `brdf` where it has :attr:`nacre.Brdf.wavelengths`, else of its
    colors by :func:`with_spectra`. A FormatError says that `brdf` is anisotropic and the azimuths
    of the view too few for it, or that its spectra take too many numbers.
    """
    if spectral and brdf.wavelengths is None:
        return with_spectra(tabulate_tables(brdf, resolution))
    check_isotropic(brdf)
    bands = None if brdf.wavelengths is None or not spectral else brdf.wavelengths
    evaluate = brdf.eval if bands is None else brdf.eval_spectral
    to_rgb = np.eye(3) if bands is None else rgb_weights(bands)
    nodes, phi_i, theta_i = view_nodes(brdf, resolution)
    size = len(phi_i) * len(theta_i) * nodes.square**2 * len(to_rgb)
    if bands is not None and size > _MAX_VALUES:
        name = f"{brdf.name or 'this material'}: {len(bands)} bands"
        raise FormatError(f"{name} make {size} numbers, more than {_MAX_VALUES}; take fewer nodes")
    grid = NormalGrid(nodes.azimuths, nodes.polars, brdf.isotropic)
    fields = normal_fields(brdf, grid, _normals(grid, brdf), phi_i, theta_i)
    warp = Warp(fields["vndf"].reshape(-1, *grid.shape))
    ndf_grid, area_grid = (Grid(fields[name][None]) for name in ("ndf", "sigma"))
    views = list(itertools.product(phi_i, theta_i))
    edge = np.linspace(0.0, 1.0, nodes.square)
    v, u = np.meshgrid(edge, edge, indexing="ij")
    whole = [(0, 1.0)]
    found = np.empty((len(views), len(to_rgb), *u.shape), np.float32)
    rgb = found if bands is None else np.empty((len(views), 3, *u.shape), np.float32)
    bright = np.empty((len(views), *u.shape), np.float32)
    for index, (phi, theta) in enumerate(views):
        x, y, _ = warp.sample(u, v, [(index, 1.0)])
        half = from_spherical(x * x * (0.5 * math.pi), (2.0 * y - 1.0) * math.pi)
        wo = from_spherical(min(float(theta), GRAZING), float(phi))
        wi = reflect(wo, half)
        up = wi[0], wi[1], np.abs(wi[2])
        values, known = _continued(brdf, evaluate, wi, up, wo)
        sigma = area_grid.eval(unit_elevation(theta), unit_azimuth(phi), whole)
        theta_h, phi_h = to_spherical(half_vector(up, wo))
        density = ndf_grid.eval(unit_elevation(theta_h), unit_azimuth(phi_h), whole)
        values = values * (4.0 * sigma / density)[..., None]
        values = np.where(known[..., None], np.maximum(values, _MIN_KNOWN), values)
        found[index] = np.moveaxis(np.clip(values, -_LARGEST, _LARGEST), -1, 0)
        if bands is not None:
            rgb[index] = np.tensordot(to_rgb.T, found[index], 1)
        red, green, blue = np.abs(rgb[index])
        bright[index] = _to_sample(luminance((red, green, blue)), known)

    shape = len(phi_i), len(theta_i)
    tables = RglTables(
        luminance=bright.reshape(*shape, *u.shape), rgb=rgb.reshape(*shape, 3, *u.shape), **fields
    )
    if bands is None:
        return tables
    spectra = found.reshape(*shape, -1, *u.shape)
    return replace(tables, wavelengths=bands.astype(np.float32), spectra=spectra)


def with_spectra(tables: RglTables) -> RglTables:
    """Tables with the spectra of their colors, also between nodes: :func:`nacre.color.upsample` is
    linear.
    """
    wavelengths = upsampling_nodes()
    weights = np.stack(primaries(wavelengths), axis=1).astype(np.float32)
    spectra = np.moveaxis(np.tensordot(weights, tables.rgb, (1, 2)), 0, 2)
    return replace(tables, wavelengths=wavelengths.astype(np.float32), spectra=spectra)


def normal_fields(
    brdf: Brdf, grid: NormalGrid, normals: Floats, phi_i: Floats, theta_i: Floats
) -> dict[str, Any]:
    """The fields of :class:`RglTables` that a density of normals decides: all but the colors."""
    vndf = [grid.visible(normals, theta, phi) for phi, theta in itertools.product(phi_i, theta_i)]
    return {
        "description": brdf.name,
        "phi_i": phi_i.astype(np.float32),
        "theta_i": theta_i.astype(np.float32),
        "ndf": normals.astype(np.float32),
        "sigma": grid.projected_area(normals).astype(np.float32),
        "vndf": np.stack(vndf, dtype=np.float32).reshape(len(phi_i), len(theta_i), *grid.shape),
        "jacobian": True,
    }


def view_nodes(brdf: Brdf, resolution: Resolution | None) -> tuple[Resolution, Floats, Floats]:
    """Numbers of nodes, and the azimuths and polar angles of the views, for a reflectance.

    A :class:`FormatError` says that it is anisotropic and the azimuths too few for that.
    """
    parts = 1 if brdf.isotropic else symmetry(brdf)
    default = ISOTROPIC if brdf.isotropic else SYMMETRIC if parts == 4 else ANISOTROPIC
    nodes = resolution or default
    if not brdf.isotropic and nodes.phi_i < _MIN_AZIMUTHS:
        name = brdf.name or "this material"
        raise FormatError(f"{name}: is anisotropic; take at least {_MIN_AZIMUTHS} phi_i")
    phi_i = np.zeros(1) if brdf.isotropic else _azimuths(nodes.phi_i, parts)
    height = np.linspace(1.0, 0.0, nodes.theta_i) ** _GRAZING_POWER
    return nodes, phi_i, 0.5 * math.pi * (1.0 - height)


def write_tables(tables: RglTables, path: PathLike) -> None:
    """Write tables as they are to a tensor file, whole or not at all.

    A :class:`FormatError` can also say that they are mapped from a file that has changed.
    """
    tables.check()
    text = (tables.description or " ").encode(errors="replace")  # a field cannot be empty
    fields: Tensors = {"description": np.frombuffer(text, np.uint8)}
    colors = ("rgb",) if tables.spectra is None else ("wavelengths", "spectra")
    for name in ("phi_i", "theta_i", "sigma", "ndf", "vndf", "luminance", *colors):
        fields[name] = getattr(tables, name)
    fields["jacobian"] = np.array([tables.jacobian], np.uint8)
    write_tensors(fields | tables.others, path)


def _azimuths(count: int, parts: int) -> Floats:
    """Even azimuths from -pi over a part of a full turn, which `count` of them would span."""
    end = (2.0 / parts - 1.0) * math.pi
    return np.linspace(-math.pi, end, max(math.ceil((count - 1) / parts), 2) + 1)


def _normals(grid: NormalGrid, brdf: Brdf) -> Floats:
    """D that places the points of the tables: from the normals found, more of the rare ones."""
    found = [grid.density(brdf), *(grid.highlight(brdf, angle) for angle in _HIGHLIGHTS)]
    density: Floats = np.mean(found, axis=0)
    dim = grid.normalized(density**_DIM_POWER)
    mixed: Floats = (1.0 - _DIM - _UNIFORM) * density + _DIM * dim
    return mixed + _UNIFORM / math.pi


def _continued(
    brdf: Brdf,
    evaluate: Callable[[Floats, Floats], Floats],
    wi: Components,
    up: Components,
    wo: Components,
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """f_r cos, below the horizon on the line through the horizon and `up`; where it is known."""
    light = join(up)
    view = np.broadcast_to(join(wo), light.shape)
    f_r = evaluate(light, view)
    finite = np.asarray(np.isfinite(f_r).all(axis=-1))
    values = np.where(finite[..., None], f_r, 0.0) * light[..., 2:]
    rim = finite & (wi[2] <= 0.0) & (wi[2] > -_RIM)
    edge = 2.0 * _grazing(evaluate, light[rim], view[rim], _LOW)
    edge -= _grazing(evaluate, light[rim], view[rim], 2.0 * _LOW)
    # Not below 0: other readers would reflect it just above the horizon.
    values[rim] = np.maximum(2.0 * edge - values[rim], 0.0)
    values[wi[2] <= -_RIM] = 0.0
    return values, finite & (wi[2] > 0.0) & brdf.valid(light, view)


def _grazing(
    evaluate: Callable[[Floats, Floats], Floats], light: Floats, view: Floats, cosine: float
) -> Floats:
    """f_r cos where the light is lowered to a cosine, shape (n, bands); 0 if not finite."""
    low = light.copy()
    low[:, :2] *= math.sqrt(1.0 - cosine * cosine) / np.linalg.norm(low[:, :2], axis=1)[:, None]
    low[:, 2] = cosine
    values = cosine * evaluate(low, view)
    return np.where(np.isfinite(values), values, 0.0)


def _to_sample(bright: Floats, known: npt.NDArray[np.bool_]) -> Floats:
    """Luminance to draw samples by: nowhere 0 where f_r is known, not 0 throughout."""
    if not bright.any():
        return np.where(known, 1.0, 0.0) if known.any() else np.ones(known.shape)
    brighter = bright + np.where(known, _MIN_LUMINANCE * bright.mean(), 0.0)
    # Rounding must not take it over the bound.
    return np.asarray(np.minimum(brighter, 0.5 * _LARGEST), np.float64)
