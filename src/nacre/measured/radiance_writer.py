"""Tables of a reflectance as Radiance's tensor trees, and the XML around them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import RADIANCE_PRIMARIES, rgb_to_xyz_matrix
from nacre.measured import tensor_tree
from nacre.measured.tensor_tree import square_to_disk

SIDE, SIDE_ANISOTROPIC = 128, 32  # cubes across the disk of directions where no resolution is given

_TO_XYZ = rgb_to_xyz_matrix(RADIANCE_PRIMARIES)
_NEUTRAL = 4.0 / 19.0, 9.0 / 19.0  # u' and v' of Radiance's white, whose x and y are 1/3
_TOLERANCE, _FLOOR = 0.05, 1e-4
"""Of cubes that become one: relative range of f_r, and an absolute one in 1/sr."""
_COLOR = 0.004  # range of u' and v' of cubes that become one
_POINTS = (0.25, 0.75)  # within a cube, along each axis
_PAIRS = 1 << 19  # that are evaluated at a time


@dataclass(frozen=True)
class Resolution:
    """Cubes of a tree that is written: across the disk of directions a power of two, 4 to 256 for
    an isotropic material, up to 32 for others; else a ValueError.
    """

    side: int

    def __post_init__(self) -> None:
        if self.side not in (4, 8, 16, 32, 64, 128, 256):
            raise ValueError("the number of cubes is a power of two from 4 to 256")


def tabulated(brdf: Brdf, side: int) -> list[str]:
    """Texts of the trees of luminance and, unless all is gray, of u' and v'."""
    xyz = np.maximum(_tabulate(brdf, side), 0.0) @ _TO_XYZ.T
    y = xyz[..., 1]
    weight = np.maximum(xyz @ [1.0, 15.0, 3.0], 1e-30)  # CIE 15:2004, section 8.2.1.1
    u, v = 4.0 * xyz[..., 0] / weight, 9.0 * y / weight
    dark = y < 1e-9
    u, v = np.where(dark, _NEUTRAL[0], u), np.where(dark, _NEUTRAL[1], v)
    if max(np.ptp(u), np.ptp(v), abs(u.flat[0] - _NEUTRAL[0])) < 1e-4:
        return [_text(y, _TOLERANCE, _FLOOR, 0.0)]
    # Radiance 6 loses the color of trees that it takes a diffuse part from, and takes none from one
    # with a dark cube: here one at the horizon.
    y[(0,) * y.ndim] = 0.0
    return [
        _text(y, _TOLERANCE, _FLOOR, 0.0),
        _text(u, 0.0, _COLOR, _NEUTRAL[0]),
        _text(v, 0.0, _COLOR, _NEUTRAL[1]),
    ]


def _text(values: Floats, tolerance: float, floor: float, unused: float) -> str:
    if values.ndim == 4:
        return tensor_tree.write(values, tolerance, floor, 4)
    half = len(values)
    parts = []
    for number in range(8):
        if number & 1:  # sines below 0
            parts.append(f"{{{unused:.4g}}}")
            continue
        rows, columns = (slice(half * (number >> bit & 1), None) for bit in (1, 2))
        parts.append(
            tensor_tree.write(values[:, rows, columns][:, :half, :half], tolerance, floor, 4)
        )
    return "{" + "".join(parts) + "}"


def _tabulate(brdf: Brdf, side: int) -> Floats:
    """Mean f_r of cubes, shape (side / 2, side, side, 3), or four times `side` if anisotropic."""
    fine = ((np.arange(side)[:, None] + _POINTS) / side).ravel()
    lights = _direction(*square_to_disk(fine[:, None], fine))
    if brdf.isotropic:
        views = _direction(2.0 * fine[:side] - 1.0, np.zeros(side)).reshape(-1, 2, 3)
    else:
        pairs = (lights * [-1.0, -1.0, 1.0]).reshape(side, 2, side, 2, 3)
        views = pairs.swapaxes(1, 2).reshape(-1, 4, 3)
    step = max(1, _PAIRS * 3 // (lights.size * views.shape[1]))
    cubes = np.concatenate(
        [_mean(brdf, views[start : start + step], lights) for start in range(0, len(views), step)]
    )
    reflected = math.pi * cubes.mean(axis=(1, 2), dtype=np.float64).max(axis=1)
    cubes /= np.maximum(reflected, 1.0)[:, None, None, None]
    return cubes if brdf.isotropic else cubes.reshape(side, side, side, side, 3)


def _mean(brdf: Brdf, wo: Floats, wi: Floats) -> Floats:
    """f_r of cubes, shape (views, side, side, 3): the mean over the points that are known."""
    light, view = wi.astype(np.float32), wo[:, :, None, None].astype(np.float32)
    f_r = brdf.eval(light, view)
    known = brdf.valid(light, view) & np.isfinite(f_r).all(axis=-1)
    total = _cells(np.where(known[..., None], f_r, 0.0))
    return np.asarray(total / np.maximum(_cells(known[..., None].astype(np.float32)), 1.0))


def _cells(points: Floats) -> Floats:
    """Sums over the points of cubes: (n, s, 2 side, 2 side, c) becomes (n, side, side, c)."""
    n, s, fine, _, channels = points.shape
    return np.asarray(points.reshape(n, s, fine // 2, 2, fine // 2, 2, channels).sum((1, 3, 5)))


def _direction(x: Floats, y: Floats) -> Floats:
    x, y = np.broadcast_arrays(x, y)
    return np.stack([x, y, np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))], axis=-1)


def document(name: str, rank: int, texts: Sequence[str]) -> str:
    """The file of a material, from the trees of luminance, u' and v', or the first alone."""
    blocks = "".join(
        _BLOCK.format(name=name, text=text)
        for name, text in zip(("Visible", "CIE-u", "CIE-v"), texts, strict=False)
    )
    return _DOCUMENT.format(name=escape(name), rank=rank, blocks=blocks)


_DOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
<Material>
<Name>{name}</Name>
<Manufacturer>nacre</Manufacturer>
<DeviceType>Other</DeviceType>
</Material>
<DataDefinition>
<IncidentDataStructure>TensorTree{rank}</IncidentDataStructure>
</DataDefinition>
{blocks}</Layer>
</Optical>
</WindowElement>
"""

_BLOCK = """<WavelengthData>
<LayerNumber>System</LayerNumber>
<Wavelength unit="Integral">{name}</Wavelength>
<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
<DetectorSpectrum>ASTM E308 1931 Y.dsp</DetectorSpectrum>
<WavelengthDataBlock>
<WavelengthDataDirection>Reflection Back</WavelengthDataDirection>
<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>
<ScatteringDataType>BRDF</ScatteringDataType>
<ScatteringData>
{text}
</ScatteringData>
</WavelengthDataBlock>
</WavelengthData>
"""
