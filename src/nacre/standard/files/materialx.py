"""MaterialX documents (`.mtlx`) that hold one OpenPBR surface.

MaterialX specification 1.39, "MTLX File Format Definition" and "Color Spaces and Color Management
Systems". A written document has one node with a value for every parameter, and a material; an
anisotropic material's tangent comes from a node `rotate3d`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from nacre.brdf import Brdf
from nacre.color import srgb_to_linear
from nacre.errors import FormatError
from nacre.io.format import Format
from nacre.io.text_file import parse_number
from nacre.io.xml_file import read_xml
from nacre.runtime.progress import Progress
from nacre.standard.files.facts import FACTS, about, facts_of, node_name
from nacre.standard.files.openpbr_inputs import (
    KINDS,
    NODE,
    NODE_DEFINITION,
    TANGENTS,
    Input,
    read,
)
from nacre.standard.fitted import write_fitted
from nacre.standard.openpbr import OpenPbr

_LIMIT = 1 << 18
_GAMMAS = {"lin_rec709": 1.0, "none": 1.0, "g18_rec709": 1.8, "g22_rec709": 2.2}
_CONNECTIONS = "nodename", "nodegraph", "interfacename", "output", "channels"
_AXES = {"in": "tangent", "axis": "normal"}
"""Nodes behind a rotated tangent, by the inputs of `rotate3d`."""


def encode(brdf: OpenPbr) -> bytes:
    """A document with a material; every number survives exactly.

    Raises FormatError if the metadata cannot be written.
    """
    name = node_name(brdf.name)
    root = Element("materialx", version="1.39", colorspace="lin_rec709")
    values: dict[str, Any] = dict(brdf.values)
    angle = values.pop("angle", None)
    if angle is not None:
        for each in _AXES.values():
            node = SubElement(root, each, name=f"{name}_{each}", type="vector3")
            SubElement(node, "input", name="space", type="string", value="world")
        turned = SubElement(root, "rotate3d", name=f"{name}_turned", type="vector3")
        for each, kind in _AXES.items():
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


def load(path: Path) -> OpenPbr:
    """Read the only OpenPBR surface in a document.

    Raises FormatError with the node, the input and the fix, if there is none or another surface, or
    an input is not constant, out of bounds, or in an unknown color space.
    """
    root = read_xml(path, _LIMIT)
    if root.tag != "materialx":
        raise FormatError(f"{path}: is not a MaterialX document: its root is {root.tag[:40]!r}")
    try:
        shader, material = _surface(root)
        facts = None if material is None else material.get(FACTS)
        return _Shader(root, shader).brdf(facts)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error


def _surface(root: Element) -> tuple[Element, Element | None]:
    """The shader in a document, and its material, if any."""
    for element in root:
        if element.tag.endswith("include"):
            raise FormatError("includes another file; save it with all in one")
    shaders = [e for e in root if e.get("type") == "surfaceshader" and e.tag != "output"]
    shaders += [e for e in root if e.tag == NODE and e not in shaders]
    names = ", ".join(e.get("name", "")[:40] for e in shaders[:5])
    if len(shaders) > 1:
        raise FormatError(f"has {len(shaders)} surfaces ({names}); save one of them")
    if not shaders:
        raise FormatError(f"has no {NODE}; a shader within a node graph is not read")
    (shader,) = shaders
    if shader.tag != NODE or shader.get("nodedef", NODE_DEFINITION) != NODE_DEFINITION:
        fix = "; MaterialX's ShaderTranslator makes one of it" * (shader.tag == "standard_surface")
        raise FormatError(f"{names}: is a {shader.tag[:40]}; only {NODE} is read{fix}")
    materials = [e for e in root if e.tag == "surfacematerial"]
    if len(materials) > 1:
        raise FormatError(f"has {len(materials)} materials; save one of them")
    for entry in materials[0] if materials else ():
        if entry.get("name") == "surfaceshader" and entry.get("nodename") == shader.get("name"):
            continue
        if entry.tag == "input":
            field = f"{materials[0].get('name', '')[:40]}: {entry.get('name', '')[:40]}"
            raise FormatError(f"{field}: is not read: only a surface at the front is; remove it")
    return shader, materials[0] if materials else None


class _Shader:
    """A node and its inputs, as values."""

    def __init__(self, root: Element, node: Element) -> None:
        self.root, self.node = root, node
        self.inputs = {e.get("name", ""): e for e in node if e.tag == "input"}

    def brdf(self, facts: str | None) -> OpenPbr:
        """The material of an OpenPBR node with its facts."""
        inputs: dict[str, Input] = {}
        angles = []
        for name, element in self.inputs.items():
            if name in TANGENTS:
                angles.append(self._angle(element))
            elif name in KINDS:
                inputs[name] = self._value(element)
            else:
                problem = "is not read" if name.startswith("geometry_") else "is not known"
                raise FormatError(f"{self._field(element)}: {problem}; remove it")
        if len(set(angles)) > 1 or (angles and len(angles) < len(TANGENTS)):
            raise FormatError(f"{' and '.join(TANGENTS)}: are not the same; make them equal")
        return read(inputs, angles[0] if angles else None, facts)

    def _field(self, element: Element) -> str:
        return f"{self.node.get('name', '')[:40]}: {element.get('name', '')[:40]}"

    def _value(self, element: Element) -> Input:
        field = self._field(element)
        if _connected(element):
            raise FormatError(f"{field}: is connected to other nodes; bake it to a constant")
        if element.get("unit") is not None:
            raise FormatError(f"{field}: has a unit; give it in that of {NODE} without one")
        text, kind = element.get("value", ""), element.get("type")
        expected = KINDS[element.get("name", "")]
        if kind == "boolean" and expected is float and text in ("true", "false"):
            return float(text == "true")
        numbers = _numbers(field, text)
        if kind == "float" and expected is float and len(numbers) == 1:
            return numbers[0]
        if kind == "color3" and expected is tuple and len(numbers) == 3:
            red, green, blue = (float(c) for c in self._linear(field, element, numbers))
            return red, green, blue
        wanted = "a color3 of three numbers" if expected is tuple else "one float"
        raise FormatError(f"{field}: is not {wanted}, but {kind} {text[:40]!r}")

    def _linear(self, field: str, element: Element, color: Sequence[float]) -> Sequence[float]:
        """A color in linear Rec. 709, from the space given by the nearest enclosing element."""
        spaces = (each.get("colorspace") for each in (element, self.node, self.root))
        space = next((s for s in spaces if s), "lin_rec709")
        if space != "srgb_texture" and space not in _GAMMAS:
            known = ", ".join([*_GAMMAS, "srgb_texture"])
            raise FormatError(f"{field}: color space {space[:40]!r} is not one of {known}")
        if not all(0.0 <= c <= 1.0 for c in color):
            return color  # out of bounds, which the caller reports
        if space == "srgb_texture":
            return list(srgb_to_linear(np.array(color)))
        return [c ** _GAMMAS[space] for c in color]

    def _angle(self, element: Element) -> float:
        """Angle of a tangent that a node `rotate3d` turns about the normal."""
        field = self._field(element)
        problem = f"{field}: is not a tangent that rotate3d turns by a constant about the normal"
        turned = self._node(element.get("nodename"), "rotate3d")
        if turned is None:
            raise FormatError(problem)
        inputs = {e.get("name", ""): e for e in turned if e.tag == "input"}
        for name, kind in _AXES.items():
            source = inputs.get(name)
            if source is None or self._node(source.get("nodename"), kind) is None:
                raise FormatError(problem)
        amount = inputs.get("amount")
        if amount is None or _connected(amount):
            raise FormatError(problem)
        numbers = _numbers(field, amount.get("value", ""))
        if len(numbers) != 1:
            raise FormatError(problem)
        return -math.radians(numbers[0])

    def _node(self, name: str | None, kind: str) -> Element | None:
        return next((e for e in self.root if e.tag == kind and e.get("name") == name), None)


def _connected(element: Element) -> bool:
    return any(element.get(key) is not None for key in _CONNECTIONS)


def _numbers(field: str, text: str) -> list[float]:
    try:
        return [parse_number(part.strip()) for part in text.split(",", 16)]
    except ValueError as error:
        raise FormatError(f"{field}: {text[:40]!r} is not made of numbers") from error


FORMAT = Format(
    "MaterialX",
    (".mtlx",),
    lambda head: b"<materialx" in head,
    load,
    save,
    model="openpbr",
    measured=False,
)
