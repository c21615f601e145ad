"""MaterialX: a graph of standard nodes whose BSDFs have parameters that depend on the view.

Specification 1.39 expects its GGX nodes to make up for the energy that reflection between facets
loses (Turquin 2019, "Practical multiple scattering compensation for microfacet models", equations
14 and 16): a color c becomes c (1 + c (1 - E) / E), with E the albedo of facets that reflect
everything. The graph therefore holds colors that become those of the mixture, at the nodes of its
tables.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.standard.bent_closures import LOBES, NODES
from nacre.standard.facet_albedo import albedo_table
from nacre.standard.lookup import interpolate
from nacre.targets.target import Target
from nacre.targets.text import facts, shortest

_Rows = npt.NDArray[np.float64]


class MaterialXClosures(Target):
    title = "MaterialX: a graph of standard BSDFs, for renderers that light surfaces themselves"
    model = "closures"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        mixture = self.of_model(material)
        root = Element("materialx", version="1.39", colorspace="lin_rec709")
        for line in facts(mixture).values():
            root.append(Comment(f" {line} "))
        bsdf = _Graph(root, name).mixture(
            {key: np.array(rows) for key, rows in mixture.values.items()}
        )
        surface = SubElement(root, "surface", name=f"{name}_surface", type="surfaceshader")
        SubElement(surface, "input", name="bsdf", type="BSDF", nodename=bsdf)
        shown = SubElement(root, "surfacematerial", name=name, type="material")
        place = SubElement(shown, "input", name="surfaceshader", type="surfaceshader")
        place.set("nodename", f"{name}_surface")
        indent(root)
        head = b'<?xml version="1.0" encoding="UTF-8"?>\n'
        return {f"{name}.mtlx": head + tostring(root) + b"\n"}


class _Graph:
    """Nodes of a document; methods add some and return the name of the last."""

    def __init__(self, root: Element, name: str) -> None:
        self._root, self._name = root, name

    def mixture(self, tables: Mapping[str, _Rows]) -> str:
        space = {"space": ("string", "world")}
        self._node("normal", "normal", "vector3", space)
        self._node("viewdirection", "away", "vector3", space)
        self._call("multiply", "view", "vector3", in1="away", in2=-1.0)
        self._call("dotproduct", "facing", "float", in1="normal", in2="view", of="vector3")
        for k, (low, high) in enumerate(itertools.pairwise(NODES)):
            self._call("subtract", f"above{k}", "float", in1="facing", in2=low)
            self._call("divide", f"ratio{k}", "float", in1=f"above{k}", in2=high - low)
            self._call("clamp", f"part{k}", "float", **{"in": f"ratio{k}"})
        color, normal = self._table("diffuse", "color3", tables["diffuse"]), self._bent(tables, 0)
        inputs = {
            "color": ("color3", color),
            "roughness": ("float", 0.0),
            "normal": ("vector3", normal),
        }
        total = self._node("oren_nayar_diffuse_bsdf", "base", "BSDF", inputs)
        for k in range(1, LOBES + 1):
            lobe = self._lobe(tables, k)
            inputs = {"in1": ("BSDF", total), "in2": ("BSDF", lobe)}
            total = self._node("add", f"sum{k}", "BSDF", inputs)
        return total

    def _lobe(self, tables: Mapping[str, _Rows], k: int) -> str:
        rows = tables[f"color{k}"], tables[f"roughness{k}"], tables[f"bend{k}"][0]
        color = self._table(f"color{k}", "color3", uncompensated(*rows))
        roughness = self._table(f"roughness{k}", "vector2", rows[1])
        alpha = self._call("multiply", f"alpha{k}", "vector2", in1=roughness, in2=roughness)
        inputs = {
            "color0": ("color3", color),
            "color90": ("color3", color),
            "roughness": ("vector2", alpha),
            "normal": ("vector3", self._bent(tables, k)),
            "tangent": ("vector3", f"{self._name}_view"),
        }
        return self._node("generalized_schlick_bsdf", f"lobe{k}", "BSDF", inputs)

    def _bent(self, tables: Mapping[str, _Rows], k: int) -> str:
        bend = self._table(f"bend{k}", "float", tables[f"bend{k}"])
        self._call("multiply", f"along{k}", "vector3", in1="view", in2=bend)
        self._call("add", f"sideways{k}", "vector3", in1="normal", in2=f"along{k}")
        return self._call("normalize", f"normal{k}", "vector3", **{"in": f"sideways{k}"})

    def _table(self, name: str, kind: str, rows: _Rows) -> str:
        """Numbers by view: a chain of mixes, in which those below the view have full weight."""
        numbers = [rows[:, k].tolist() for k in range(len(NODES))]
        value: str | list[float] = numbers[0]
        for k, after in enumerate(numbers[1:]):
            inputs = {
                "bg": (kind, value),
                "fg": (kind, after),
                "mix": ("float", f"{self._name}_part{k}"),
            }
            value = self._node("mix", f"{name}_{k}", kind, inputs)
        return str(value)

    def _call(self, node: str, name: str, kind: str, of: str = "", **inputs: Any) -> str:
        """A node whose inputs are numbers or other nodes, with its own type or that of `of`."""
        typed = {}
        for key, value in inputs.items():
            known = isinstance(value, str)
            full = f"{self._name}_{value}" if known and not value.startswith(self._name) else value
            scalar = not known or value.startswith(f"{self._name}_bend")
            typed[key] = ("float" if scalar else of or kind, full)
        return self._node(node, name, kind, typed)

    def _node(self, node: str, name: str, kind: str, inputs: Mapping[str, tuple[str, Any]]) -> str:
        full = f"{self._name}_{name}"
        element = SubElement(self._root, node, name=full, type=kind)
        for key, (each, value) in inputs.items():
            place = SubElement(element, "input", name=key, type=each)
            if isinstance(value, str) and each != "string":
                place.set("nodename", value)
            elif isinstance(value, str):
                place.set("value", value)
            else:
                numbers = np.atleast_1d(np.asarray(value, np.float32))
                place.set("value", ", ".join(shortest(x) for x in numbers))
        return full


def uncompensated(color: _Rows, roughness: _Rows, bend: npt.NDArray[np.float64]) -> _Rows:
    """Colors that become the given ones when facets compensate, shape (3, nodes).

    Arguments are rows of :class:`nacre.standard.closures.Closures`, with shapes (3, nodes), (2,
    nodes) and (nodes,).
    """
    facing = np.asarray(NODES)
    length = np.sqrt(1.0 + 2.0 * bend * facing + bend * bend)
    cosine = (facing + bend) / length
    albedo = interpolate(albedo_table(), np.sqrt(roughness[0] * roughness[1]), cosine)
    lost = (1.0 - albedo) / np.maximum(albedo, 0.1)
    return np.asarray(2.0 * color / (1.0 + np.sqrt(1.0 + 4.0 * lost * color)))
