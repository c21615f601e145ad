"""Polarized BRDFs of the KAIST database, of which the intensity of unpolarized light is read.

A tensor file with Mueller matrices on a grid in the Rusinkiewicz angles, for some wavelengths.
Their first element is f_r in 1/sr for unpolarized light of which the whole intensity is measured;
nodes below the horizon are not numbers. Baek et al. 2020, "Image-Based Acquisition and Modeling of
Polarimetric Reflectance"; Mitsuba's `measured_polarized` reads the same files.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, Table, namespace
from nacre.errors import FormatError
from nacre.geometry import rusinkiewicz_angles, split
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.measured.axis import KNOWN, LEAST_KNOWN, Axis, Blend, outer
from nacre.measured.tensor_file import MAGIC, read_tensors
from nacre.sampling import LobeSampledBrdf
from nacre.spectra import as_channels

_AXES = "phi_d", "theta_d", "theta_h"
_LARGEST = 1e30
_NOTE = (
    "The file holds Mueller matrices; their first element is read, the reflectance of unpolarized "
    "light, and the polarization is left out."
)


class PolarizedBrdf(LobeSampledBrdf):
    """Spectral reflectance of unpolarized light, linear between nodes in the Rusinkiewicz angles.

    Parameters
    ----------
    phi_d, theta_d, theta_h
        Nodes in radians, increasing, shapes (p,), (d,) and (h,).
    spectra
        f_r in 1/sr, shape (p, d, h, bands); NaN where it is not known.
    wavelengths
        Bands in nm, increasing, shape (bands,).
    """

    isotropic = True
    isotropy_known = True

    def __init__(
        self,
        phi_d: npt.ArrayLike,
        theta_d: npt.ArrayLike,
        theta_h: npt.ArrayLike,
        spectra: npt.ArrayLike,
        wavelengths: npt.ArrayLike,
        name: str = "",
    ) -> None:
        super().__init__(name=name)
        self._axes = Axis(phi_d), Axis(theta_d), Axis(theta_h)
        self.wavelengths = np.asarray(wavelengths, np.float64)
        values = np.asarray(spectra, np.float32)
        expected = (*map(len, self._axes), len(self.wavelengths))
        if values.shape != expected:
            raise ValueError(f"spectra of shape {values.shape}, expected {expected}")
        known = np.asarray(np.isfinite(values).all(axis=-1))
        self.spectra = np.where(known[..., None], np.clip(values, 0.0, _LARGEST), np.float32(0.0))
        self.known = known
        colors, self.channels = as_channels(self.spectra, self.wavelengths)
        nodes = np.concatenate([colors, known[..., None]], axis=-1)
        self._nodes = Table(np.clip(nodes, -_LARGEST, _LARGEST).astype(np.float32))

    @property
    def nbytes(self) -> int:
        return int(self.spectra.nbytes)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        blend = self._blend(wi, wo)
        red, green, blue, known = (self._sum(channel, blend) for channel in range(4))
        scale = 1.0 / namespace(known).maximum(known, LEAST_KNOWN)
        return scale * red, scale * green, scale * blue

    def eval_bands(self, wi: Floats, wo: Floats) -> Floats:
        blend = self._blend(split(wi), split(wo))
        nodes = self.spectra.reshape(-1, self.spectra.shape[-1])
        total = np.zeros((len(wi), nodes.shape[1]))
        for index, weight in blend:
            total += np.asarray(weight)[:, None] * nodes[index]
        known = np.maximum(self._sum(3, blend), LEAST_KNOWN)
        return np.asarray(total / known[:, None])

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return self._sum(3, self._blend(wi, wo)) >= KNOWN

    def describe(self) -> dict[str, Any]:
        grid = " x ".join(str(len(axis)) for axis in self._axes)
        return super().describe() | {
            "grid": f"{' x '.join(_AXES)}: {grid}",
            "value range": [float(self.spectra.min()), float(self.spectra.max())],
            "invalid samples": float(1.0 - self.known.mean()),
        }

    def _sum(self, channel: int, blend: Blend) -> Array:
        total: Array = 0.0
        for index, weight in blend:
            total = total + weight * namespace(index).take(self._nodes, index * 4 + channel)
        return total

    def _blend(self, wi: Components, wo: Components) -> Blend:
        theta_h, _, theta_d, phi_d = rusinkiewicz_angles(wi, wo)
        xp = namespace(phi_d)
        first = float(self._axes[0].nodes.values.min())
        turn = 2.0 * math.pi
        phi_d = xp.where(phi_d < first, phi_d + turn, phi_d)
        phi_d = xp.where(phi_d >= first + turn, phi_d - turn, phi_d)
        last = float(self._axes[0].nodes.values.max())
        # Where one half is tabulated, the other is its mirror image.
        phi_d = xp.where(phi_d > last, 2.0 * math.pi - phi_d, phi_d) if last < 3.5 else phi_d
        blends = [
            axis.blend(x) for axis, x in zip(self._axes, (phi_d, theta_d, theta_h), strict=True)
        ]
        slow = outer(blends[0], blends[1], len(self._axes[1]))
        return outer(slow, blends[2], len(self._axes[2]))


def load(path: PathLike) -> PolarizedBrdf:
    """Read the reflectance of unpolarized light from a ``.pbsdf`` file.

    A FormatError says that the file cannot be read, or which field is missing or wrong.
    """
    tensors = read_tensors(path)
    missing = [name for name in (*_AXES, "wvls", "M") if name not in tensors]
    if missing:
        raise FormatError(f"{path}: field '{missing[0]}' is missing")
    axes = []
    for name in _AXES:
        nodes = np.asarray(tensors[name], np.float64).reshape(-1)
        within = np.abs(nodes).max(initial=np.inf if not len(nodes) else 0.0) <= 7.0
        if not (within and (np.diff(nodes) > 0.0).all()):
            raise FormatError(f"{path}: field '{name}': must increase, in radians")
        axes.append(nodes)
    wavelengths = np.asarray(tensors["wvls"], np.float64).reshape(-1)
    if not len(wavelengths) or wavelengths[0] <= 0.0 or not (np.diff(wavelengths) > 0.0).all():
        raise FormatError(f"{path}: field 'wvls': must be positive and increase")
    expected = (*map(len, axes), len(wavelengths), 4, 4)
    if tensors["M"].shape != expected:
        found = tensors["M"].shape
        raise FormatError(f"{path}: field 'M': has shape {found}, expected {expected}")
    intensity = tensors["M"][..., 0, 0]
    if not np.isfinite(intensity).any():
        raise FormatError(f"{path}: field 'M': no value is a number")
    brdf = PolarizedBrdf(axes[0], axes[1], axes[2], intensity, wavelengths, Path(path).stem)
    return brdf.replaced(notes=(_NOTE,))


def _recognize(head: bytes) -> bool:
    return head.startswith(MAGIC) and b"theta_d" in head and b"phi_d" in head and b"wvls" in head


FORMAT = Format("polarized BRDF", (".pbsdf",), _recognize, load)
