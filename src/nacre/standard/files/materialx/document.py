"""MaterialX documents as graphs: where inputs get their values from, through nodes and interfaces.

MaterialX 1.39, "MaterialX Names", "Node Graph Elements" and "Custom Nodes".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from nacre.array import Doubles
from nacre.errors import FormatError
from nacre.io.text_file import parse_number
from nacre.standard.files.color_spaces import to_rec_709
from nacre.standard.files.materialx.nodes import (
    NODES,
    SIZES,
    inputs_of,
    resized,
    result,
    swizzled,
)

_DEEPEST = 100  # nodes behind each other
_MOST = 20_000  # values that are computed for one material
_CONNECTIONS = "nodename", "nodegraph", "interfacename", "output"
_PICTURES = "image", "texture", "triplanar"  # parts of categories


class VariesError(FormatError):
    """A value that is not the same all over a surface."""


@dataclass(frozen=True, eq=False)
class Scope:
    """Where names of nodes and of interfaces are looked up."""

    place: Element
    """The document or a node graph."""
    outer: Scope | None = None
    instance: Element | None = None
    """The node that a graph is the inside of, which lies in the outer scope."""
    definition: Element | None = None
    """The `nodedef` of that node."""


class Document:
    """A document whose constants can be evaluated.

    Parameters
    ----------
    root
        The element `materialx`.
    """

    def __init__(self, root: Element) -> None:
        self.root = root
        self.scope = Scope(root)
        self._parents = {child: parent for parent in root.iter() for child in parent}
        self._names: dict[Element, dict[str, Element]] = {}
        self._scopes: dict[tuple[Element, Element | None, Scope | None], Scope] = {}
        self._known: dict[tuple[Element, Scope], Doubles] = {}
        self._left = _MOST
        graphs = {e.get("nodedef"): e for e in root if e.tag == "nodegraph"}
        self._definitions: dict[str, list[tuple[Element, Element]]] = {}
        for each in root:
            graph = graphs.get(each.get("name"))
            if each.tag == "nodedef" and each.get("name") is not None and graph is not None:
                self._definitions.setdefault(each.get("node", ""), []).append((each, graph))

    def source(self, element: Element, scope: Scope) -> tuple[Element, Scope] | None:
        """The node that an input or output is connected to, and where that lies; None for a value.

        Raises FormatError if there is no such node, or only circles.
        """
        for _ in range(_DEEPEST):
            found = self._next(element, scope)
            if found is None:
                return None
            element, scope = found
            if element.tag not in ("input", "output"):
                return element, scope
        raise FormatError("is connected to itself, or through too many graphs")

    def value(self, element: Element, scope: Scope) -> Doubles:
        """The numbers of an input, shape (size,); colors are linear Rec. 709.

        Raises VariesError if they depend on the place on the surface, and FormatError if they are
        damaged, lie in an unknown color space or are connected to what is not there.
        """
        self._left = _MOST
        return self._value(element, scope, 0)

    def _next(self, element: Element, scope: Scope) -> tuple[Element, Scope] | None:
        """What an input or output is connected to: an output, an input of the interface, a node."""
        if (name := element.get("interfacename")) is not None:
            return self._interface(name, scope)
        if (name := element.get("nodegraph")) is not None:
            graph = self._find(scope.place, name) or self._find(self.root, name)
            if graph is None or graph.tag != "nodegraph":
                raise FormatError(f"is connected to a node graph {name[:40]!r}, which is not there")
            return self._output(element, graph, self._within(graph, None, None))
        if (name := element.get("nodename")) is not None:
            node = self._find(scope.place, name)
            if node is None or node is element:
                raise FormatError(f"is connected to {name[:40]!r}, which is not there")
            if node.tag == "nodegraph":
                return self._output(element, node, self._within(node, None, None))
            return node, scope
        if (name := element.get("output")) is not None:
            found = self._find(scope.place, name)
            if found is None or found.tag != "output" or found is element:
                raise FormatError(f"is connected to an output {name[:40]!r}, which is not there")
            return found, scope
        return None

    def _interface(self, name: str, scope: Scope) -> tuple[Element, Scope]:
        outer = scope.outer or self.scope
        if scope.instance is not None and (found := _input(scope.instance, name)) is not None:
            return found, outer
        owner = scope.place if scope.definition is None else scope.definition
        if scope.place is not self.root and (found := _input(owner, name)) is not None:
            return found, outer
        raise FormatError(f"takes {name[:40]!r} of an interface that has none")

    def _output(self, element: Element, graph: Element, scope: Scope) -> tuple[Element, Scope]:
        outputs = [each for each in graph if each.tag == "output"]
        name = element.get("output")
        if name is not None:
            outputs = [each for each in outputs if each.get("name") == name]
        if len(outputs) != 1:
            which = "the output" if name is None else f"an output {name[:40]!r}"
            graph_name = graph.get("name", "")[:40]
            raise FormatError(f"is connected to {which} of {graph_name!r}, which is not there")
        return outputs[0], scope

    def _within(
        self, graph: Element, instance: Element | None, outer: Scope | None, **more: Any
    ) -> Scope:
        key = graph, instance, outer
        if key not in self._scopes:
            self._scopes[key] = Scope(graph, outer, instance, **more)
        return self._scopes[key]

    def _find(self, place: Element, name: str) -> Element | None:
        if place not in self._names:
            named = ((e.get("name", ""), e) for e in place if e.tag not in ("input", "token"))
            self._names[place] = dict(named)
        return self._names[place].get(name)

    def _value(self, element: Element, scope: Scope, depth: int) -> Doubles:
        if depth > _DEEPEST:
            raise FormatError(f"is connected to itself, or to over {_DEEPEST} nodes in a row")
        self._left -= 1
        if self._left < 0:
            raise FormatError(f"takes over {_MOST:,} steps to compute; bake it to a constant")
        found = self._next(element, scope)
        if found is None:
            return self._given(element)
        behind, where = found
        if behind.tag in ("input", "output"):
            value = self._value(behind, where, depth + 1)
        else:
            value = self._node(element, behind, where, depth + 1)
        channels = element.get("channels")
        try:
            return value if channels is None else swizzled(value, channels[:4])
        except ValueError as error:
            raise FormatError(f"channels {channels!r}: {error}") from error

    def _node(self, element: Element, node: Element, scope: Scope, depth: int) -> Doubles:
        """The output of a node that an input is connected to."""
        if node.tag == "swizzle" or node.tag in NODES:
            value = self._computed(node, scope, depth)
            if node.tag.startswith("separate"):
                return _one_of(value, element.get("output", ""))
            return value
        if (inside := self._inside(node, scope)) is None:
            raise VariesError(_what_varies(node))
        output, scope = self._output(element, inside.place, inside)
        return self._value(output, scope, depth + 1)

    def _computed(self, node: Element, scope: Scope, depth: int) -> Doubles:
        key = node, scope
        if key in self._known:
            return self._known[key]
        where = f"{node.tag} {node.get('name', '')[:40]!r}"
        known = {"in", "channels"} if node.tag == "swizzle" else inputs_of(node.tag)
        inputs = {}
        for each in inputs_given(node):
            name = each.get("name", "")
            if name not in known:
                raise FormatError(f"{where}: has an input {name[:40]!r}, which is not known")
            if each.get("type") != "string":
                inputs[name] = self._value(each, scope, depth)
        kind = node.get("type", "")
        try:
            if node.tag == "swizzle":
                channels = _input(node, "channels")
                letters = "" if channels is None else channels.get("value", "")[:4]
                picked = swizzled(inputs.get("in", np.zeros(1)), letters)
                self._known[key] = resized(picked, SIZES.get(kind, picked.size))
            else:
                self._known[key] = result(node.tag, inputs, kind)
        except ValueError as error:
            raise FormatError(f"{where}: {error}") from error
        return self._known[key]

    def _inside(self, node: Element, scope: Scope) -> Scope | None:
        """The graph that a document defines a node by; None for nodes that it does not define."""
        for definition, graph in self._definitions.get(node.tag, ()):
            kinds = {e.get("type") for e in definition if e.tag == "output"}
            named = node.get("nodedef") in (None, definition.get("name"))
            if named and node.get("type") in (*kinds, "multioutput"):
                return self._within(graph, node, scope, definition=definition)
        return None

    def _given(self, element: Element) -> Doubles:
        """The numbers in an element's value."""
        text, kind = element.get("value", ""), element.get("type", "")
        if kind == "boolean" and text in ("true", "false"):
            return np.array([float(text == "true")])
        if kind in ("filename", "geomname", "string"):
            raise VariesError(f"is a {kind} ({text[:40]!r}), no number")
        if not text and element.get("defaultgeomprop"):
            raise VariesError(f"depends on the surface's {element.get('defaultgeomprop', '')[:40]}")
        try:
            numbers = [parse_number(part.strip()) for part in text.split(",", 16)]
        except ValueError as error:
            raise FormatError(f"{text[:40]!r} is not made of numbers") from error
        if SIZES.get(kind) != len(numbers):
            raise FormatError(f"is not {_words(kind)}, but {text[:40]!r}")
        if element.get("unit") is not None:
            raise FormatError("has a unit; give it in that of the surface without one")
        if not kind.startswith("color"):
            return np.array(numbers)
        return np.concatenate([to_rec_709(numbers[:3], self._space(element)), numbers[3:]])

    def _space(self, element: Element) -> str:
        """The color space of a value, given by the nearest enclosing element."""
        each: Element | None = element
        while each is not None:
            if space := each.get("colorspace"):
                return space
            each = self._parents.get(each)
        return "lin_rec709"


def inputs_given(node: Element) -> Iterator[Element]:
    """The inputs of a node, but for those that are empty, which are as if they were not there."""
    for each in node:
        if each.tag == "input" and (each.get("value") or is_connected(each)):
            yield each


def is_connected(element: Element) -> bool:
    return any(element.get(key) is not None for key in _CONNECTIONS)


def _input(node: Element, name: str) -> Element | None:
    return next((e for e in inputs_given(node) if e.get("name") == name), None)


def _one_of(value: Doubles, output: str) -> Doubles:
    """One number of several: `outx`, `outr` and so on."""
    try:
        return swizzled(value, output.removeprefix("out")[:1] or "?")
    except ValueError as error:
        raise FormatError(f"is connected to an output {output[:40]!r}: {error}") from error


def _words(kind: str) -> str:
    size = SIZES.get(kind, 0)
    if size == 0:
        return f"of a type that is read ({kind[:40]!r} is not)"
    return f"one {kind}" if size == 1 else f"a {kind} of {size} numbers"


def _what_varies(node: Element) -> str:
    category = node.tag[:40]
    if any(part in category.lower() for part in _PICTURES):
        file = _input(node, "file")
        named = "" if file is None else file.get("value", "")[:60]
        return f"is a texture ({named or category})"
    return f"varies over the surface, as a texture does (node {category!r})"
