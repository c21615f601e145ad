"""MaterialX documents (`.mtlx`): reads one of their materials, writes OpenPBR.

MaterialX specification 1.39, "MTLX File Format Definition". A written document has one node with a
value for every parameter, and a material; an anisotropic material's tangent comes from a node
`rotate3d`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from nacre.analytic.model import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.io.format import Format
from nacre.io.names import chosen
from nacre.io.xml_file import read_xml
from nacre.runtime.progress import Progress
from nacre.standard.files.facts import FACTS, about, facts_of, node_name
from nacre.standard.files.materialx.document import Document, Scope, inputs_given
from nacre.standard.files.materialx.inputs import AXES, Inputs
from nacre.standard.files.materialx.surfaces import SURFACES
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import NODE, TANGENTS
from nacre.standard.fitted import write_fitted
from nacre.standard.openpbr import OpenPbr

_LIMIT = 1 << 22
_KNOWN = ", ".join(SURFACES)


def encode(brdf: OpenPbr) -> bytes:
    """A document with a material; every number survives exactly.

    Raises FormatError if the metadata cannot be written.
    """
    name = node_name(brdf.name)
    root = Element("materialx", version="1.39", colorspace="lin_rec709")
    values: dict[str, Any] = dict(brdf.values)
    angle = values.pop("angle", None)
    if angle is not None:
        for each in AXES.values():
            node = SubElement(root, each, name=f"{name}_{each}", type="vector3")
            SubElement(node, "input", name="space", type="string", value="world")
        turned = SubElement(root, "rotate3d", name=f"{name}_turned", type="vector3")
        for each, kind in AXES.items():
            _connect(turned, each, "vector3", f"{name}_{kind}")
        _set(turned, "amount", -math.degrees(angle))  # MaterialX turns from y toward x
    shader = SubElement(root, NODE, name=f"{name}_surface", type="surfaceshader")
    for key, value in values.items():
        _set(shader, key, value)
    if angle is not None:
        for each in TANGENTS:
            _connect(shader, each, "vector3", f"{name}_turned")
    material = SubElement(root, "surfacematerial", name=name, type="material", doc=about(brdf))
    material.set(FACTS, facts_of(brdf))
    _connect(material, "surfaceshader", "surfaceshader", f"{name}_surface")
    indent(root)
    content: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return content + b"\n"


def _set(node: Element, name: str, value: Any) -> None:
    color = isinstance(value, tuple)
    text = ", ".join(map(repr, value)) if color else repr(value)
    SubElement(node, "input", name=name, type="color3" if color else "float", value=text)


def _connect(node: Element, name: str, kind: str, other: str) -> None:
    SubElement(node, "input", name=name, type=kind, nodename=other)


def save(brdf: Brdf, path: Path, progress: Progress | None = None) -> None:
    """Write a material; other models are fitted on pictures.

    Raises FormatError if the path is bad, or the model cannot be fitted.
    """
    write_fitted(brdf, OpenPbr, path, encode, progress)


def load(path: Path, material: str | None = None, opaque_part: bool = False) -> AnalyticBrdf:
    """Read a material by its name or its number.

    Parameters
    ----------
    path
        A document of any tool with surfaces from :data:`SURFACES`.
    material
        Name of a material, or its number from 1, where there are several.
    opaque_part
        Whether what no reflectance of one value has is left out, instead of refused: transmission,
        subsurface scattering (which becomes diffuse), emission, opacity, textures, normal maps. The
        material's notes then say what was.

    Raises
    ------
    FormatError
        With the node, the input and the fix, if there is no such material or it has another
        surface, or an input is not constant, out of bounds, or in an unknown color space.
    """
    document = _document(path)
    found = _materials(path, document)
    names = [each.name for each in found]
    wanted = found[chosen(path, names, material)]
    opaque = OpaquePart(opaque_part)
    try:
        brdf = _read(document, wanted, opaque)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error
    return brdf.replaced(name=brdf.name or wanted.name, notes=tuple(opaque.notes))


@dataclass(frozen=True)
class _Material:
    """A material, or a surface that is in none, and where in a document it lies."""

    element: Element
    scope: Scope

    @property
    def name(self) -> str:
        name = self.element.get("name", "")
        return name if name.isprintable() else ""


def _document(path: Path) -> Document:
    root = read_xml(path, _LIMIT)
    if root.tag != "materialx":
        raise FormatError(f"{path}: is not a MaterialX document: its root is {root.tag[:40]!r}")
    return Document(root)


def _materials(path: Path, document: Document) -> list[_Material]:
    """The materials in a document; the surfaces where there are none."""
    places = [document.scope, *(Scope(e) for e in document.root if e.tag == "nodegraph")]
    nodes = [_Material(node, place) for place in places for node in place.place]
    found = [each for each in nodes if each.element.tag == "surfacematerial"]
    found = found or [each for each in nodes if _is_surface(each.element)]
    if not found:
        for element in document.root:
            if element.tag == "material":
                newer = "open and save it with MaterialX 1.38 or newer"
                raise FormatError(f"{path}: has materials of MaterialX before 1.38; {newer}")
            if element.tag.endswith("include"):
                file = element.get("href", "")[:60]
                raise FormatError(
                    f"{path}: includes another file ({file}); save it with all in one"
                )
        raise FormatError(f"{path}: has no material and no surface, such as {NODE}")
    return found


def _is_surface(element: Element) -> bool:
    kind = element.get("type")
    return element.tag in SURFACES or (
        kind == "surfaceshader" and element.tag not in ("input", "output")
    )


def _read(document: Document, material: _Material, opaque: OpaquePart) -> AnalyticBrdf:
    node, scope, facts = material.element, material.scope, None
    if node.tag == "surfacematerial":
        facts = node.get(FACTS)
        node, scope = _surface(document, material, opaque)
    name = node.get("name", "")[:40]
    surface = SURFACES.get(node.tag)
    if surface is None:
        raise FormatError(f"{name}: is a {node.tag[:40]}; surfaces that are read: {_KNOWN}")
    given = Inputs(document, node, scope, surface, opaque)
    try:
        return surface.read(given.values(), given.turns(), facts, opaque)
    except ValueError as error:
        raise FormatError(str(error)) from error


def _surface(document: Document, material: _Material, opaque: OpaquePart) -> tuple[Element, Scope]:
    """The node of a material's surface, and where it lies."""
    name = material.name[:40]
    found = None
    for entry in inputs_given(material.element):
        field = f"{name}: {entry.get('name', '')[:40]}"
        try:
            source = document.source(entry, material.scope)
        except FormatError as error:
            raise FormatError(f"{field}: {error}") from error
        if entry.get("name") == "surfaceshader" and source is not None:
            found = source
        else:
            problem = f"{field}: only a surface at the front is read"
            opaque.without(problem, "remove it", f"{entry.get('name', '')[:40]} is left out.")
    if found is None:
        raise FormatError(f"{name or 'the material'}: has no surface")
    return found


def _names(path: Path) -> list[str]:
    return [each.name for each in _materials(path, _document(path))]


FORMAT = Format(
    "MaterialX",
    (".mtlx",),
    lambda head: b"<materialx" in head,
    load,
    save,
    materials=_names,
    model="openpbr",
    measured=False,
)
