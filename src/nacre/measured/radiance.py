"""Radiance's BSDF files, the XML of LBNL's WINDOW 6: tensor trees and matrices.

Matrices are those of :mod:`nacre.measured.klems`.

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

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Brdf
from nacre.color import RADIANCE_PRIMARIES, rgb_to_xyz_matrix
from nacre.errors import FormatError, in_words, printable, reason
from nacre.geometry import azimuth
from nacre.io.files import PathLike, first_bytes, write_encoded
from nacre.io.format import Format
from nacre.io.text_file import parse_number
from nacre.io.xml_file import read_xml
from nacre.measured import tensor_tree
from nacre.measured.klems import BASES, Basis, KlemsBrdf
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
_MATRICES = "columns", "rows"
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


def load(path: PathLike) -> RadianceBrdf | KlemsBrdf:
    """Read the reflection in an ``.xml`` file, on Radiance's front side if there is one.

    Notes name everything else that the file holds. A FormatError says that the file cannot be read,
    is neither a tensor tree nor a matrix, or holds no reflection of visible light.
    """
    root = read_xml(path, _SIZE_LIMIT)
    layers = root.findall("Optical/Layer") if root.tag == "WindowElement" else []
    if not layers:
        raise FormatError(f"{path}: has no layer of WINDOW 6")
    layer = layers[0]
    structure = _text(layer, "DataDefinition/IncidentDataStructure").lower()
    if structure not in (*_RANKS, *_MATRICES):
        held = structure[:40] or "none"
        problem = f"expected {', '.join([*_RANKS, *_MATRICES])}"
        raise FormatError(f"{path}: IncidentDataStructure: {held!r}; {problem}")
    every = _blocks(layer)
    used = _used(path, every, ("cie-u", "cie-v") if structure in _RANKS else ("cie-x", "cie-z"))
    name, maker = (
        _text(layer, f"Material/{tag}")[:_NAME_LIMIT] for tag in ("Name", "Manufacturer")
    )
    name = name or Path(path).stem
    brdf: RadianceBrdf | KlemsBrdf
    if structure in _RANKS:
        trees = [_tree(path, block, _RANKS[structure]) for block in used]
        brdf = RadianceBrdf(trees, name, {"manufacturer": maker} if maker else None)
    else:
        brdf = _matrix(path, layer, used, name, by_rows=structure == "rows")
    left_out = [block for block in every if block not in used]
    return brdf.replaced(notes=_notes(used[0], left_out, len(layers)))


class _Block(NamedTuple):
    wavelength: str  # "Visible", "CIE-u" and so on
    direction: str  # "Reflection Back" and so on
    bases: tuple[str, str]  # of columns and of rows; for a tree its basis twice
    text: str


def _text(element: Element, place: str) -> str:
    return (element.findtext(place) or "").strip()


def _blocks(layer: Element) -> list[_Block]:
    found = []
    for data in layer.iterfind("WavelengthData"):
        for block in data.iterfind("WavelengthDataBlock"):
            bases = [
                _text(block, f"{axis}AngleBasis") or _text(block, "AngleBasis")
                for axis in ("Column", "Row")
            ]
            direction, text = (
                _text(block, t) for t in ("WavelengthDataDirection", "ScatteringData")
            )
            found.append(_Block(_text(data, "Wavelength"), direction, (bases[0], bases[1]), text))
    return found


def _used(path: PathLike, blocks: list[_Block], colors: tuple[str, str]) -> list[_Block]:
    """The blocks of one side that make the reflectance: visible light, and two of its color if
    there are any. The front in Radiance is the back in WINDOW 6.
    """
    for side in ("reflection back", "reflection front"):
        found = {b.wavelength.lower(): b for b in blocks if b.direction.lower() == side}
        if found:
            break
    else:
        held = ", ".join(sorted({b.direction for b in blocks}))[:80] or "nothing"
        raise FormatError(f"{path}: holds no reflection, but {held}")
    visible = found.get("visible") or found.get("cie-y")
    if visible is None:
        held = ", ".join(found)[:80]
        raise FormatError(f"{path}: holds no reflection of visible light, but of {held}")
    return [visible, *(found[c] for c in colors)] if set(colors) <= set(found) else [visible]


def _notes(used: _Block, left_out: list[_Block], layers: int) -> tuple[str, ...]:
    """Which side was read, and everything else that a file holds."""
    notes = []
    sides: dict[str, list[str]] = {}
    for block in left_out:
        sides.setdefault(block.direction[:40], []).append(block.wavelength[:40])
    if sides:
        listed = [f"{side} ({', '.join(dict.fromkeys(names))})" for side, names in sides.items()]
        what = f"{used.direction} ({used.wavelength}) is read"
        notes.append(f"{what}; the file also holds {in_words(listed)}, which is left out.")
    if layers > 1:
        notes.append(f"The first of {layers} layers is read.")
    return tuple(printable(note) for note in notes)


def _tree(path: PathLike, block: _Block, rank: int) -> TensorTree:
    where = f"{path}: {block.wavelength}, {block.direction}"
    if block.bases[0].lower() != "lbnl/shirley-chiu":
        held = block.bases[0][:40]
        raise FormatError(f"{where}: AngleBasis {held!r}, expected LBNL/Shirley-Chiu")
    try:
        return tensor_tree.parse(block.text, rank)
    except ValueError as error:
        raise FormatError(f"{where}: ScatteringData {error}") from error


def _matrix(
    path: PathLike, layer: Element, blocks: list[_Block], name: str, *, by_rows: bool
) -> KlemsBrdf:
    """A matrix whose columns are incident directions, or its rows if `by_rows`."""
    defined = _bases(path, layer)
    columns, rows = (_basis(path, blocks[0].bases[axis], defined) for axis in (0, 1))
    tables = []
    for block in blocks:
        where = f"{path}: {block.wavelength}, {block.direction}"
        if block.bases != blocks[0].bases:
            raise FormatError(f"{where}: has other bases than {blocks[0].wavelength}")
        tables.append(_numbers(where, block.text, rows.patches, columns.patches))
    y = tables[0]
    rgb = (
        np.stack([tables[1], y, tables[2]], axis=-1) @ _FROM_XYZ.T
        if len(tables) == 3
        else np.repeat(y[..., None], 3, axis=-1)
    )
    if by_rows:
        return KlemsBrdf(rgb.swapaxes(0, 1), rows, columns, name)
    return KlemsBrdf(rgb, columns, rows, name)


def _numbers(where: str, text: str, rows: int, columns: int) -> Floats:
    """The values of a matrix, parted by commas or blanks."""
    words = text.replace(",", " ").split(None, rows * columns)
    if len(words) != rows * columns:
        count = f"{len(words) if len(words) < rows * columns else 'more'} of {rows * columns}"
        raise FormatError(f"{where}: ScatteringData: {count} values ({rows} x {columns} patches)")
    try:
        values = np.fromiter(map(parse_number, words), float, len(words))
    except ValueError as error:
        raise FormatError(f"{where}: ScatteringData: {str(error)[:40]!r} is no number") from error
    if not np.abs(values).max() <= _LARGEST:
        raise FormatError(f"{where}: ScatteringData: a value is too large")
    return values.reshape(rows, columns)


def _bases(path: PathLike, layer: Element) -> dict[str, Basis]:
    """The bases that a file defines, by their names in lower case."""
    found = {}
    for element in layer.iterfind("DataDefinition/AngleBasis"):
        name = _text(element, "AngleBasisName")
        rings = list(element.iterfind("AngleBasisBlock"))
        where = f"{path}: AngleBasis {name[:40]!r}"
        try:
            lower = [parse_number(_text(ring, "ThetaBounds/LowerTheta")) for ring in rings]
            upper = [parse_number(_text(ring, "ThetaBounds/UpperTheta")) for ring in rings]
            counts = [int(parse_number(_text(ring, "nPhis"))) for ring in rings]
            if lower[1:] != upper[:-1] or not rings:
                raise ValueError("rings must follow one another without a gap")
            found[name.lower()] = Basis((*lower, upper[-1]), tuple(counts))
        except (ValueError, OverflowError) as error:
            raise FormatError(f"{where}: {reason(error)}") from error
    return found


def _basis(path: PathLike, name: str, defined: dict[str, Basis]) -> Basis:
    usual = {known.lower(): basis for known, basis in BASES.items()}
    basis = (defined | {k: v for k, v in usual.items() if k not in defined}).get(name.lower())
    if basis is None:
        known = ", ".join([*defined, *usual])[:160]
        raise FormatError(f"{path}: AngleBasis {name[:40]!r} is not defined (known: {known})")
    return basis


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
