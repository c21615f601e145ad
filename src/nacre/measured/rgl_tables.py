"""The fields of an RGL material, checked before anything is computed from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError
from nacre.io.files import PathLike, identity
from nacre.io.mapped import MappedFile
from nacre.measured.raw import LARGEST
from nacre.measured.tensor_file import SIZE_LIMIT, Tensors, parse_tensors, read_tensors
from nacre.spectra import rgb_weights

_MAPPED = 1 << 26  # bytes of a file from which on spectra are mapped
_NODE_LIMIT = 4096  # most nodes along any one axis of a table
_DENSEST = 1e30  # bound of densities, so that interpolation between them does not overflow
_NANOMETRES = (100.0, 1e5)  # range of wavelengths; anything else is in another unit

_COMMON = {"description", "phi_i", "theta_i", "ndf", "sigma", "vndf", "luminance", "jacobian"}
"""Fields of every file, beside those of its colors."""

_Shape: TypeAlias = tuple[int | None, ...]
_Floats: TypeAlias = npt.NDArray[np.float32]


@dataclass(frozen=True)
class RglTables:
    """What an RGL tensor file holds, in its own conventions.

    "Incident" is the direction on which the measurement is conditioned: `wo` in this package. P
    azimuths and T polar angles of it, in radians, increase.
    """

    description: str  # name of the material, as the measurers wrote it
    phi_i: _Floats  # shape (P,): incident azimuths
    theta_i: _Floats  # shape (T,): incident polar angles
    ndf: _Floats
    """Shape (>= 2, >= 2), azimuth by polar angle of the half vector: microfacet density."""
    sigma: _Floats  # shape (>= 2, >= 2), incident azimuth by polar angle: projected microfacet area
    vndf: _Floats  # shape (P, T, A, B): density of visible half vectors, azimuth by polar angle
    luminance: _Floats  # shape (P, T, N, M): luminance on the square that `vndf` warps
    rgb: _Floats  # shape (P, T, 3, N, M): linear Rec. 709 reflectance on the same square
    jacobian: bool  # whether `rgb` and `spectra` are to be multiplied by ndf / (4 sigma)
    wavelengths: _Floats | None = None  # shape (B,), in nm, increasing; None without spectra
    spectra: _Floats | None = None
    """Shape (P, T, B, N, M), whose color is `rgb`; None without spectra."""
    others: Tensors = field(default_factory=dict)
    """Fields that nothing here reads, kept to be written again."""
    file: MappedFile | None = None  # what `spectra` are mapped from; None if in memory

    def check(self) -> None:
        """Raise a :class:`FormatError` if spectra are mapped from a file that has changed."""
        if self.file is not None:
            self.file.check()

    @property
    def isotropic(self) -> bool:
        """Whether azimuths of half vectors count from the incident direction."""
        return len(self.phi_i) <= 2

    @property
    def nbytes(self) -> int:
        """Bytes of the numbers that f_r comes from: all but the luminance."""
        colors = self.rgb if self.spectra is None else self.spectra
        used = (self.phi_i, self.theta_i, self.ndf, self.sigma, self.vndf, colors)
        return sum(table.nbytes for table in used)

    @property
    def reduction(self) -> int:
        """How often the measured range of incident azimuths fits into a full turn: 1, 2 or 4."""
        return 1 if self.isotropic else round(2.0 * math.pi / float(self.phi_i[-1] - self.phi_i[0]))


def read_tables(path: PathLike) -> RglTables:
    """Read and check an RGL tensor file, of colors or of spectra.

    The arrays are views of the file's content, which stays in memory as it is; in a large file the
    spectra alone stay in the file. A :class:`FormatError` names the field that is missing,
    misshapen or out of range.
    """
    tensors, file = _tensors(path)
    content = _Fields(tensors, str(path))
    phi_i = content.angles("phi_i", 2.0 * math.pi)
    theta_i = content.angles("theta_i", math.pi / 2.0)
    grid: _Shape = (len(phi_i), len(theta_i))
    wavelengths = spectra = None
    colors = {"wavelengths", "spectra"}
    if colors.isdisjoint(tensors):
        colors = {"rgb"}
        rgb = content.floats("rgb", (*grid, 3, None, None))
    else:
        wavelengths = content.wavelengths()
        spectra = content.floats("spectra", (*grid, len(wavelengths), None, None), finite=False)
        rgb = _colors(spectra, wavelengths, content, file)
    tables = RglTables(
        description=content.text("description"),
        phi_i=phi_i,
        theta_i=theta_i,
        ndf=content.positive("ndf", (None, None)),
        sigma=content.positive("sigma", (None, None)),
        vndf=content.density("vndf", (*grid, None, None)),
        luminance=content.density("luminance", (*grid, *rgb.shape[3:])),
        rgb=rgb,
        jacobian=content.flag("jacobian"),
        wavelengths=wavelengths,
        spectra=spectra,
        others={n: array for n, array in tensors.items() if n not in _COMMON | colors},
        file=file,
    )
    if tables.reduction not in (1, 2, 4):
        spans = "a full turn, a half or a quarter of one"
        raise content.error("phi_i", f"must span {spans}, as the symmetry allows")
    if tables.reduction > 1 and abs(tables.phi_i[0] + math.pi) > 1e-3:
        raise content.error("phi_i", "must start at -pi where it spans less than a full turn")
    return tables


def _tensors(path: PathLike) -> tuple[Tensors, MappedFile | None]:
    """The fields of a file, and what the spectra among them are mapped from."""
    found = identity(path)
    if found is None or found[1] < _MAPPED:
        return read_tensors(path), None
    file = MappedFile(path, SIZE_LIMIT)
    tensors = parse_tensors(file.data, path)
    read = {name: a if name == "spectra" else a.copy() for name, a in tensors.items()}
    return read, file if "spectra" in read else None


def _colors(
    spectra: _Floats, wavelengths: _Floats, content: _Fields, file: MappedFile | None
) -> _Floats:
    """Linear Rec. 709 of finite spectra (P, T, B, N, M), slice by slice, for they are large."""
    weights = rgb_weights(wavelengths)
    rgb = np.empty((*spectra.shape[:2], 3, *spectra.shape[3:]), np.float32)
    for index in np.ndindex(*spectra.shape[:2]):
        content.check_finite("spectra", spectra[index])
        colors = np.tensordot(weights.T, spectra[index], axes=1)
        rgb[index] = np.clip(colors, -LARGEST, LARGEST)
        if file is not None:
            file.release()
    return rgb


class _Fields:
    """Typed access to tensors; every complaint names the file and the field."""

    def __init__(self, tensors: Tensors, path: str) -> None:
        self.tensors, self._path = tensors, path

    def error(self, name: str, problem: str) -> FormatError:
        return FormatError(f"{self._path}: field '{name}': {problem}")

    def _get(self, name: str) -> npt.NDArray[Any]:
        if name not in self.tensors:
            raise self.error(name, f"is missing, found {', '.join(self.tensors)[:200]}")
        return self.tensors[name]

    def floats(self, name: str, shape: _Shape, *, finite: bool = True) -> _Floats:
        """A finite float32 array; None in `shape` stands for any number of nodes from 2."""
        values = self._get(name)
        if values.dtype != np.float32:
            raise self.error(name, f"holds {values.dtype}, expected float32")
        if len(shape) != values.ndim or not all(
            2 <= have <= _NODE_LIMIT if size is None else have == size
            for have, size in zip(values.shape, shape, strict=True)
        ):
            wanted = f"{tuple(size or 'n' for size in shape)} with n from 2 to {_NODE_LIMIT}"
            raise self.error(name, f"has shape {values.shape}, expected {wanted}")
        if finite:
            self.check_finite(name, values)
        return values

    def check_finite(self, name: str, values: _Floats) -> None:
        if not np.isfinite(values).all():
            raise self.error(name, "holds values that are not finite")

    def _list(self, name: str, what: str = "") -> _Floats:
        values = self.floats(name, self._get(name).shape)
        if values.ndim != 1 or len(values) > _NODE_LIMIT:
            raise self.error(name, f"has shape {values.shape}, expected one list{what}")
        return values

    def angles(self, name: str, limit: float) -> _Floats:
        values = self._list(name, " of angles")
        if not (np.diff(values) > 0.0).all():
            raise self.error(name, "angles must increase")
        if np.abs(values).max() > limit + 1e-4:
            raise self.error(name, f"angles must be radians of magnitude up to {limit:.4f}")
        return values

    def wavelengths(self) -> _Floats:
        values = self._list("wavelengths")
        low, high = _NANOMETRES
        if not (np.diff(values) > 0.0).all() or values[0] < low or values[-1] > high:
            raise self.error("wavelengths", f"must increase and be nm, from {low:g} to {high:g}")
        return values

    def positive(self, name: str, shape: _Shape) -> _Floats:
        values = self.floats(name, shape)
        if values.min() < 0.0:
            raise self.error(name, "holds negative values, which a density cannot have")
        if values.max() > _DENSEST:
            raise self.error(name, f"holds values above {_DENSEST:g}, which no density has")
        return values

    def density(self, name: str, shape: _Shape) -> _Floats:
        values = self.positive(name, shape)
        totals = values.sum(axis=(2, 3), dtype=np.float64)
        if not (totals > 0.0).all():
            phi, theta = (int(i) for i in np.argwhere(totals <= 0.0)[0])
            raise self.error(name, f"is zero throughout for phi_i {phi}, theta_i {theta}")
        return values

    def text(self, name: str) -> str:
        values = self._get(name)
        if values.ndim != 1 or values.dtype.itemsize != 1:
            raise self.error(name, "is not a text")
        return values.tobytes().decode("utf-8", "replace").rstrip("\0").strip()

    def flag(self, name: str) -> bool:
        values = self._get(name)
        if values.size != 1 or values.dtype.itemsize != 1 or int(values.flat[0]) not in (0, 1):
            raise self.error(name, "must be one byte, 0 or 1")
        return bool(values.flat[0])
