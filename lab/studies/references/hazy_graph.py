"""MaterialX's graph of OpenPBR 1.1 with the haze of 1.2, as pull request 298 of OpenPBR adds it.

Releases of MaterialX have no graph of version 1.2 yet. The pull request repeats the nodes from the
roughness to the lobes for the haze, and mixes lobes where the layers take them; here that is done
to the graph of the installed release.
"""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from lab.studies.references.hazy_openpbr import HAZE, SPREAD, HazyOpenPbr
from nacre.errors import require
from nacre.standard.files import materialx
from nacre.standard.files.openpbr_inputs import NODE
from tests.oracles.surface_shader import SurfaceShader

_NEW = f"{NODE}_with_haze"
_ROUGHNESS = "specular_roughness"
_REPEATED = (
    *(f"{_ROUGHNESS}_to_power_4", "add_coat_and_spec_roughnesses_to_power_4"),
    *("min_1_add_coat_and_spec_roughnesses_to_power_4", f"coat_affected_{_ROUGHNESS}"),
    *(f"effective_{_ROUGHNESS}", "main_roughness"),
    *("dielectric_reflection", "dielectric_reflection_tf", "dielectric_reflection_tf_mix"),
    *("metal_bsdf", "metal_bsdf_tf", "metal_bsdf_tf_mix"),
)
_MIXED = {"dielectric_base": "dielectric_reflection_tf_mix", "base_substrate": "metal_bsdf_tf_mix"}
"""Layers, and the lobes that they take."""


def shader(brdf: HazyOpenPbr, *, plain_mixes: bool = True) -> SurfaceShader:
    """MaterialX's shader of a material.

    MaterialX 1.39.5 replaces `mix` by `multiply` and `add` unless `plain_mixes`. The new graph has
    mixes of mixes above the diffuse base, and `multiply` forgets that a lobe of less weight lets
    more light through. Then the diffuse base is too dark, also where `specular_haze` is 0.
    """
    return SurfaceShader(document(brdf), plain_mixes=plain_mixes)


def document(brdf: HazyOpenPbr) -> str:
    """A MaterialX document with a material, and with the graph that evaluates it.

    Raises RuntimeError if the installed graph lacks a node that is repeated.
    """
    search = require("MaterialX", "dev").getDefaultDataSearchPath()
    path = Path(search.find("libraries/bxdf/open_pbr_surface.mtlx").asString())
    library = fromstring(path.read_text("utf-8"))
    root = fromstring(materialx.encode(brdf))
    for place, node in enumerate(_with_haze(library)):
        root.insert(place, node)
    for surface in root.findall(NODE):
        surface.tag = _NEW
    return tostring(root, encoding="unicode")


def _with_haze(library: Element) -> tuple[Element, Element]:
    """The definition of a node, and its graph."""
    definition = library.find(f"nodedef[@node='{NODE}']")
    graph = library.find(f"nodegraph[@nodedef='ND_{NODE}_surfaceshader']")
    if definition is None or graph is None:
        raise RuntimeError("MaterialX has no graph of OpenPBR")
    definition.set("name", f"ND_{_NEW}")
    definition.set("node", _NEW)
    for name, value in ((HAZE, "0.0"), (SPREAD, "0.3")):
        _input(definition, name, "float", value=value)
    graph.set("name", f"NG_{_NEW}")
    graph.set("nodedef", f"ND_{_NEW}")
    nodes = {node.get("name"): node for node in graph}
    if lacking := [name for name in _REPEATED if name not in nodes]:
        raise RuntimeError(f"MaterialX's graph of OpenPBR has no {', '.join(lacking)}")

    added = [_mix("haze_roughness", "float", value="1.0")]
    _input(added[0], "bg", "float", interfacename=_ROUGHNESS)
    _input(added[0], "mix", "float", interfacename=SPREAD)
    for name in _REPEATED:
        node = deepcopy(nodes[name])
        node.set("name", f"{name}_haze")
        for given in node:
            if given.get("nodename") in _REPEATED:
                given.set("nodename", f"{given.get('nodename')}_haze")
            elif given.get("interfacename") == _ROUGHNESS:
                del given.attrib["interfacename"]
                given.set("nodename", "haze_roughness")
        added.append(node)
    for layer, lobes in _MIXED.items():
        node = _mix(f"{lobes}_with_haze", "BSDF", nodename=f"{lobes}_haze")
        _input(node, "bg", "BSDF", nodename=lobes)
        _input(node, "mix", "float", interfacename=HAZE)
        added.append(node)
        for given in nodes[layer]:
            if given.get("nodename") == lobes:
                given.set("nodename", f"{lobes}_with_haze")
    graph[:0] = added
    return definition, graph


def _mix(name: str, kind: str, **above: str) -> Element:
    node = Element("mix", name=name, type=kind)
    _input(node, "fg", kind, **above)
    return node


def _input(node: Element, name: str, kind: str, **source: str) -> None:
    SubElement(node, "input", name=name, type=kind, **source)
