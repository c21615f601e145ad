"""Inputs of one surface in a MaterialX document, as values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import Element

from nacre.errors import FormatError
from nacre.io.text_file import parse_number
from nacre.standard.files.materialx.document import Document, Scope, VariesError, inputs_given
from nacre.standard.files.materialx.surface import Surface
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import Input

AXES = {"in": "tangent", "axis": "normal"}
"""Nodes behind a rotated tangent, by the inputs of `rotate3d`."""


class Inputs:
    """A surface's inputs, as values."""

    def __init__(
        self,
        document: Document,
        node: Element,
        scope: Scope,
        surface: Surface,
        opaque: OpaquePart,
    ) -> None:
        self._document, self._node, self._scope = document, node, scope
        self._surface, self._opaque = surface, opaque
        self._elements = {e.get("name", ""): e for e in inputs_given(node)}
        known = {*surface.defaults, *surface.ignored, *surface.normals, *surface.tangents}
        for name, element in self._elements.items():
            if name not in known:
                raise FormatError(f"{self._field(element)}: is not known; remove it")
        definition = node.get("nodedef")
        if definition is None:
            version = node.get("version", "").split(".")[:3]
            definition = next(
                (each for each in surface.definitions if each.endswith("_" + "".join(version))),
                next(iter(surface.definitions)),
            )
        if definition not in surface.definitions:
            names = ", ".join(surface.definitions)
            wrong = f"has the nodedef {definition[:60]!r}"
            raise FormatError(f"{node.get('name', '')[:40]}: {wrong}; read are {names}")
        self._defaults = {**surface.defaults, **surface.definitions[definition]}

    def values(self) -> Mapping[str, Any]:
        """Values of all inputs that matter, as numbers and colors; those that vary are the
        defaults, if that is not refused.
        """
        self._check_normals()
        return {name: self._value(name) for name in self._defaults}

    def turns(self) -> dict[str, float]:
        """Angles in radians of the tangents that are turned."""
        found = {}
        for name in self._surface.tangents:
            if (element := self._elements.get(name)) is None:
                continue
            try:
                found[name] = self._angle(element)
            except FormatError as error:
                taken = f"{name} {error}; it is not turned instead."
                self._opaque.without(f"{self._field(element)}: {error}", "make it one", taken)
        return found

    def _field(self, element: Element) -> str:
        return f"{self._node.get('name', '')[:40]}: {element.get('name', '')[:40]}"

    def _value(self, name: str) -> Input:
        default = self._defaults[name]
        element = self._elements.get(name)
        if element is None:
            return default
        field = self._field(element)
        try:
            found = self._document.value(element, self._scope)
        except VariesError as error:
            taken = f"{name} {error}; {_shown(default)} is taken instead."
            self._opaque.without(f"{field}: {error}", "bake it to a constant", taken)
            return default
        except FormatError as error:
            raise FormatError(f"{field}: {error}") from error
        if isinstance(default, tuple) and len(found) == 3:
            return float(found[0]), float(found[1]), float(found[2])
        if not isinstance(default, tuple) and len(found) == 1:
            return float(found[0])
        wanted = "a color3 of three numbers" if isinstance(default, tuple) else "one float"
        given = f"{element.get('type')} {element.get('value', '')[:40]!r}"
        raise FormatError(f"{field}: is not {wanted}, but {given}")

    def _check_normals(self) -> None:
        """Refuse normals that are not the surface's own, or leave them out."""
        for name in self._surface.normals:
            element = self._elements.get(name)
            if element is None:
                continue
            field = self._field(element)
            try:
                source = self._document.source(element, self._scope)
                plain = source[0].tag == "normal" if source else _is_up(element)
            except FormatError as error:
                raise FormatError(f"{field}: {error}") from error
            if not plain:
                problem = f"{field}: is not read: only the surface's own normal is"
                self._opaque.without(problem, "remove it", f"{name}, a normal map, is left out.")

    def _angle(self, element: Element) -> float:
        """Angle of a tangent that a node `rotate3d` turns about the normal."""
        problem = FormatError("is not a tangent that rotate3d turns by a constant about the normal")
        found = self._document.source(element, self._scope)
        if found is None:
            raise problem
        turned, scope = found
        if turned.tag == "tangent":
            return 0.0
        inputs = {e.get("name", ""): e for e in inputs_given(turned)}
        if turned.tag != "rotate3d" or not {*AXES, "amount"} <= inputs.keys():
            raise problem
        for name, kind in AXES.items():
            source = self._document.source(inputs[name], scope)
            if source is None or source[0].tag != kind:
                raise problem
        amount = self._document.value(inputs["amount"], scope)
        if len(amount) != 1:
            raise problem
        return -math.radians(amount[0])


def _is_up(element: Element) -> bool:
    """Whether a vector points away from the surface, as the normal does in a tangent's frame."""
    parts = [part.strip() for part in element.get("value", "").split(",", 4)]
    try:
        return [parse_number(part) for part in parts] == [0.0, 0.0, 1.0]
    except ValueError as error:
        raise FormatError(f"{element.get('value', '')[:40]!r} is not made of numbers") from error


def _shown(value: Input) -> str:
    numbers = value if isinstance(value, tuple) else (value,)
    text = ", ".join(f"{number:g}" for number in numbers)
    return f"({text})" if isinstance(value, tuple) else text
