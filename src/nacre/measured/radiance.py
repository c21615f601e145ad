"""Radiance's BSDF files: tensor trees in the XML of LBNL's WINDOW 6.

A tree over the sine of the incident direction's polar angle and the place of the other in the disk
of projected directions (isotropic, TensorTree3), or over both places (TensorTree4). Values are f_r
in 1/sr and constant within a cube; cubes of one size have the same projected solid angle. Color
stands in two further trees, as CIE 1976 u' and v'. The incident direction is the view, as rtrace,
which follows light backward, looks it up; it matters where f_r is not reciprocal.

Ward, Kurt and Bonneel 2012, "A Practical Framework for Sharing and Rendering Real-World
Bidirectional Scattering Distribution Functions"; Radiance's bsdf.c and bsdf_t.c, whose front is the
back of WINDOW 6.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from nacre.array import Array, Components, namespace
from nacre.brdf import Brdf
from nacre.color import RADIANCE_PRIMARIES, rgb_to_xyz_matrix
from nacre.errors import FormatError, printable
from nacre.geometry import azimuth
from nacre.io.files import PathLike, first_bytes, write_encoded
from nacre.io.format import Format
from nacre.io.xml_file import read_xml
from nacre.measured import tensor_tree
from nacre.measured.radiance_writer import (
    SIDE,
    SIDE_ANISOTROPIC,
    Resolution,
    document,
    tabulated,
)
from nacre.measured.tensor_tree import TensorTree, disk_to_square
from nacre.sampling import LobeSampledBrdf, check_isotropic

_RANKS = {"tensortree3": 3, "tensortree4": 4}
_FROM_XYZ = np.linalg.inv(rgb_to_xyz_matrix(RADIANCE_PRIMARIES))
_LARGEST = 1e35  # luminance whose color is finite
_SIZE_LIMIT = 1 << 28
_NAME_LIMIT = 200


class RadianceBrdf(LobeSampledBrdf):
    """A reflectance in tensor trees; with trees of rank 3 the material is isotropic.

    The trees hold f_r in 1/sr as Radiance's luminance; and u' and v' (CIE 1976) where there is
    color. :meth:`describe` shows `facts` too.
    """

    def __init__(
        self, trees: list[TensorTree], name: str = "", facts: dict[str, Any] | None = None
    ) -> None:
        super().__init__(name=name)
        self.trees = tuple(trees)
        self.isotropic = self.isotropy_known = trees[0].rank == 3  # type: ignore[misc]
        self._facts = facts or {}

    @property
    def nbytes(self) -> int:
        return sum(tree.nbytes for tree in self.trees)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        point = _point(wi, wo) if self.isotropic else _place(wi, wo)
        luminance = self.trees[0].at(point)
        if len(self.trees) == 1:
            return luminance, luminance, luminance
        xp = namespace(luminance)
        luminance = xp.minimum(luminance, _LARGEST)
        u, v = (xp.minimum(xp.maximum(tree.at(point), 0.01), 1.0) for tree in self.trees[1:])
        # CIE 15:2004, section 8.2.1.1, solved for X / Y and Z / Y.
        scale = luminance / (4.0 * v)
        x, z = 9.0 * u * scale, (12.0 - 3.0 * u - 20.0 * v) * scale
        red, green, blue = (
            float(row[0]) * x + float(row[1]) * luminance + float(row[2]) * z for row in _FROM_XYZ
        )
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        f_r = self.trees[0].values
        facts = {
            "tensor tree": f"rank {self.trees[0].rank}, {f_r.size} values",
            "value range": [float(f_r.min()), float(f_r.max())],
            "color": len(self.trees) > 1,
        }
        return super().describe() | facts | self._facts


def _place(wi: Components, wo: Components) -> tuple[Array, ...]:
    return *disk_to_square(-wo[0], -wo[1]), *disk_to_square(wi[0], wi[1])


def _point(wi: Components, wo: Components) -> tuple[Array, ...]:
    """Place in an isotropic tree: the mirror direction of the view has azimuth 0."""
    cosine, sine, radius = azimuth(wo)
    x, y = wi[0] * cosine + wi[1] * sine, wi[1] * cosine - wi[0] * sine
    return 0.5 - 0.5 * radius, *disk_to_square(-x, -y)


def load(path: PathLike) -> RadianceBrdf:
    """Read the reflection in a Radiance ``.xml`` file, on its front side if there is one.

    A FormatError says that the file cannot be read, is no tensor tree, or holds no reflection.
    """
    root = read_xml(path, _SIZE_LIMIT)
    layer = root.find("Optical/Layer") if root.tag == "WindowElement" else None
    if layer is None:
        raise FormatError(f"{path}: has no layer of WINDOW 6")
    structure = _text(layer, "DataDefinition/IncidentDataStructure")
    rank = _RANKS.get(structure.lower())
    if rank is None:
        held = structure[:40] or "none"
        problem = "only tensor trees are read, TensorTree3 and TensorTree4"
        raise FormatError(f"{path}: IncidentDataStructure: {held!r}; {problem}")
    blocks = _side(path, layer)
    names = ["visible", "cie-u", "cie-v"] if {"cie-u", "cie-v"} <= set(blocks) else ["visible"]
    if "visible" not in blocks:
        raise FormatError(f"{path}: holds no reflection of visible light")
    trees = []
    for name in names:
        block = blocks[name]
        where = f"{path}: {block.wavelength}, {block.direction}"
        if block.basis.lower() != "lbnl/shirley-chiu":
            raise FormatError(
                f"{where}: AngleBasis {block.basis[:40]!r}, expected LBNL/Shirley-Chiu"
            )
        try:
            trees.append(tensor_tree.parse(block.text, rank))
        except ValueError as error:
            raise FormatError(f"{where}: ScatteringData {error}") from error
    name, maker = (
        _text(layer, f"Material/{tag}")[:_NAME_LIMIT] for tag in ("Name", "Manufacturer")
    )
    facts = {"manufacturer": maker} if maker else None
    return RadianceBrdf(trees, name or Path(path).stem, facts)


class _Block(NamedTuple):
    wavelength: str  # "Visible", "CIE-u" and so on
    direction: str  # "Reflection Back" and so on
    basis: str
    text: str


def _text(element: Element, place: str) -> str:
    return (element.findtext(place) or "").strip()


def _side(path: PathLike, layer: Element) -> dict[str, _Block]:
    """Tables of one side by what they hold; the front in Radiance is the back in WINDOW 6."""
    tags = "WavelengthDataDirection", "AngleBasis", "ScatteringData"
    blocks = [
        _Block(_text(data, "Wavelength"), *(_text(block, tag) for tag in tags))
        for data in layer.iterfind("WavelengthData")
        for block in data.iterfind("WavelengthDataBlock")
    ]
    for side in ("reflection back", "reflection front"):
        found = {b.wavelength.lower(): b for b in blocks if b.direction.lower() == side}
        if found:
            return found
    held = ", ".join(sorted({b.direction for b in blocks}))[:80] or "nothing"
    raise FormatError(f"{path}: holds no reflection, but {held}")


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write a Radiance ``.xml`` file of the front side, whole or not at all.

    A cube holds the mean f_r of its directions, as far as it is known, and cubes that differ by
    less than 5 % become one. Views whose albedo is above 1 are scaled down to it. The disk has 128
    cubes across by default, 32 for an anisotropic material. Trees that were read are written as
    they stand, where no resolution is given.
    """
    if isinstance(brdf, RadianceBrdf) and resolution is None:
        texts = [tree.text() for tree in brdf.trees]
    else:
        check_isotropic(brdf)
        largest = SIDE if brdf.isotropic else SIDE_ANISOTROPIC
        if resolution is not None and resolution.side > largest and not brdf.isotropic:
            raise FormatError(f"{path}: resolution: up to {largest} for an anisotropic material")
        texts = tabulated(brdf, resolution.side if resolution else largest)
    name = printable(" ".join(brdf.name.split()))
    write_encoded(path, str.encode, document(name, 3 if brdf.isotropic else 4, texts))


def _recognize(head: bytes) -> bool:
    return b"<WindowElement" in head


FORMAT = Format(
    "Radiance BSDF",
    (".xml",),
    _recognize,
    load,
    save,
    resolution=Resolution,
    claims=lambda path: _recognize(first_bytes(path)),  # other files end in .xml too
)
