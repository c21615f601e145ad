"""Constants behind nodes, graphs and interfaces of MaterialX documents."""

from __future__ import annotations

import time

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.standard.files.materialx.nodes import NODES, inputs_of
from tests.oracles.runners.materialx import library

SURFACE = '<open_pbr_surface name="s" type="surfaceshader">{}</open_pbr_surface>'


def given(name: str, value: str, kind: str = "float") -> str:
    return f'<input name="{name}" type="{kind}" value="{value}"/>'


def linked(name: str, node: str, kind: str = "float", more: str = "") -> str:
    return f'<input name="{name}" type="{kind}" nodename="{node}" {more}/>'


def loaded(folder, text, **options):
    path = folder / "a.mtlx"
    path.write_text(f'<materialx version="1.39">{text}</materialx>')
    return nacre.load(path, **options)


def evaluated(folder, nodes: str, kind: str = "float", more: str = ""):
    """What an input gets that is connected to the node `n`."""
    name = "base_color" if kind == "color3" else "base_weight"
    return loaded(folder, nodes + SURFACE.format(linked(name, "n", kind, more))).values[name]


def node(category: str, inputs: str, kind: str = "float", name: str = "n") -> str:
    return f'<{category} name="{name}" type="{kind}">{inputs}</{category}>'


IN = given("in", "0.3")
PAIR = given("in1", "0.6") + given("in2", "0.5")
COLOR = given("in", "0.2, 0.6, 0.4", "color3")


@pytest.mark.parametrize(
    ("category", "inputs", "expected"),
    [
        ("constant", given("value", "0.25"), 0.25),
        ("dot", IN, 0.3),
        ("add", given("in1", "0.25") + given("in2", "0.5"), 0.75),
        ("subtract", PAIR, 0.1),
        ("multiply", PAIR, 0.3),
        ("multiply", given("in1", "0.6"), 0.6),
        ("divide", given("in1", "0.2") + given("in2", "0.5"), 0.4),
        ("modulo", given("in1", "-0.2") + given("in2", "0.5"), 0.3),
        ("power", given("in1", "0.5") + given("in2", "2"), 0.25),
        ("safepower", given("in1", "0.25") + given("in2", "0.5"), 0.5),
        ("min", PAIR, 0.5),
        ("max", PAIR, 0.6),
        ("invert", IN, 0.7),
        ("absval", given("in", "-0.3"), 0.3),
        ("sign", IN, 1.0),
        ("floor", IN, 0.0),
        ("ceil", IN, 1.0),
        ("round", IN, 0.0),
        ("fract", given("in", "-0.25"), 0.75),
        ("sqrt", given("in", "0.25"), 0.5),
        ("ln", given("in", "2"), np.log(2.0)),
        ("exp", given("in", "-1"), np.exp(-1.0)),
        ("sin", IN, np.sin(0.3)),
        ("cos", IN, np.cos(0.3)),
        ("tan", IN, np.tan(0.3)),
        ("asin", IN, np.arcsin(0.3)),
        ("acos", given("in", "0.8"), np.arccos(0.8)),
        ("atan2", given("iny", "0.5"), np.arctan(0.5)),
        ("clamp", given("in", "1.5"), 1.0),
        ("mix", given("fg", "1") + given("bg", "0.2") + given("mix", "0.25"), 0.4),
        ("remap", given("in", "0.5") + given("inhigh", "2") + given("outhigh", "0.8"), 0.2),
        ("range", given("in", "0.25") + given("gamma", "2"), 0.5),
        ("range", given("in", "4") + given("doclamp", "true", "boolean"), 1.0),
        ("smoothstep", given("in", "0.25"), 0.15625),
        ("contrast", given("in", "0.6") + given("amount", "2"), 0.7),
        ("ifgreater", given("value1", "2") + given("value2", "1") + PAIR, 0.6),
        ("ifgreater", given("value1", "1") + given("value2", "1") + PAIR, 0.5),
        ("ifgreatereq", given("value1", "1") + given("value2", "1") + PAIR, 0.6),
        ("ifequal", given("value1", "1") + given("value2", "1") + PAIR, 0.6),
        ("switch", PAIR + given("which", "1", "integer"), 0.5),
        ("and", given("in1", "true", "boolean") + given("in2", "true", "boolean"), 1.0),
        ("or", given("in1", "true", "boolean") + given("in2", "false", "boolean"), 1.0),
        ("xor", given("in1", "true", "boolean") + given("in2", "true", "boolean"), 0.0),
        ("not", given("in", "false", "boolean"), 1.0),
        (
            "dotproduct",
            given("in1", "0.5, 0.5, 0", "vector3") + given("in2", "1, 0.5, 9", "vector3"),
            0.75,
        ),
        ("magnitude", given("in", "0.3, 0.4", "vector2"), 0.5),
        ("extract", COLOR + given("index", "1", "integer"), 0.6),
        ("swizzle", COLOR + given("channels", "g", "string"), 0.6),
        ("convert", given("in", "true", "boolean"), 1.0),
    ],
)
def test_nodes_give_what_they_say(tmp_path, category, inputs, expected):
    assert evaluated(tmp_path, node(category, inputs)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("category", "inputs", "expected"),
    [
        ("convert", given("in", "0.3"), (0.3, 0.3, 0.3)),
        ("convert", given("in", "0.2, 0.6, 0.4, 0.9", "vector4"), (0.2, 0.6, 0.4)),
        ("combine3", PAIR + given("in3", "0.1"), (0.6, 0.5, 0.1)),
        (
            "multiply",
            given("in1", "0.2, 0.6, 0.4", "color3") + given("in2", "0.5"),
            (0.1, 0.3, 0.2),
        ),
        ("swizzle", COLOR + given("channels", "bgr", "string"), (0.4, 0.6, 0.2)),
        ("luminance", COLOR, (0.48037062,) * 3),
        ("saturate", COLOR + given("amount", "0"), (0.48037062,) * 3),
        ("normalize", given("in", "0.6, 0.8, 0", "vector3"), (0.6, 0.8, 0.0)),
        ("hsvtorgb", given("in", "0.5, 0.5, 0.8", "color3"), (0.4, 0.8, 0.8)),
        ("rgbtohsv", given("in", "0.4, 0.8, 0.8", "color3"), (0.5, 0.5, 0.8)),
        ("hsvadjust", COLOR + given("amount", "0, 1, 0.5", "vector3"), (0.1, 0.3, 0.2)),
    ],
)
def test_nodes_give_colors(tmp_path, category, inputs, expected):
    found = evaluated(tmp_path, node(category, inputs, "color3"), "color3")
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_names_and_defaults_of_inputs_are_materialxs():
    pytest.importorskip("MaterialX", reason="needs MaterialX")
    for category in NODES:
        definitions = library().getMatchingNodeDefs(category)
        assert definitions, category
        for definition in definitions:
            names = {given.getName() for given in definition.getActiveInputs()}
            if definition.getInput("in2") and category.startswith("combine"):
                continue  # the number of inputs is in the category
            unknown = names - inputs_of(category)
            assert not unknown, (category, definition.getName(), unknown)


def test_one_of_several_outputs_is_taken(tmp_path):
    separate = node("separate3", COLOR, "multioutput")
    for output, expected in (("outr", 0.2), ("outg", 0.6), ("outz", 0.4)):
        assert evaluated(tmp_path, separate, more=f'output="{output}"') == expected
    with pytest.raises(FormatError, match="s: base_weight: is connected to an output 'outq'"):
        evaluated(tmp_path, separate, more='output="outq"')


def test_channels_of_older_documents_are_swizzled(tmp_path):
    constant = node("constant", given("value", "0.2, 0.6, 0.4", "color3"), "color3")
    assert evaluated(tmp_path, constant, more='channels="g"') == 0.6
    with pytest.raises(FormatError, match="channels 'q': there is no channel 'q'"):
        evaluated(tmp_path, constant, more='channels="q"')


GRAPH = """
<nodegraph name="g">
  <input name="tint" type="color3" value="0.5, 0.25, 1.0"/>
  <constant name="c" type="color3" colorspace="SPACE">
    <input name="value" type="color3" value="0.5, 0.5, 0.5"/>
  </constant>
  <multiply name="m" type="color3">
    <input name="in1" type="color3" nodename="c"/>
    <input name="in2" type="color3" interfacename="tint"/>
  </multiply>
  <output name="out" type="color3" nodename="m"/>
  <output name="tint_out" type="color3" interfacename="tint"/>
</nodegraph>
"""


@pytest.mark.parametrize(
    ("space", "value"), [("lin_rec709", 0.5), ("srgb_texture", 0.2140411), ("g18_rec709", 0.5**1.8)]
)
def test_graphs_are_followed_with_their_color_spaces(tmp_path, space, value):
    inputs = '<input name="base_color" type="color3" nodegraph="g" output="out"/>'
    inputs += '<input name="coat_color" type="color3" nodegraph="g" output="tint_out"/>'
    values = loaded(tmp_path, GRAPH.replace("SPACE", space) + SURFACE.format(inputs)).values
    np.testing.assert_allclose(values["base_color"], (0.5 * value, 0.25 * value, value), rtol=1e-6)
    assert values["coat_color"] == (0.5, 0.25, 1.0)


def test_an_interface_can_be_connected_too(tmp_path):
    outer = node("constant", given("value", "1, 1, 0", "color3"), "color3", "o")
    graph = GRAPH.replace('value="0.5, 0.25, 1.0"', 'nodename="o"').replace("SPACE", "")
    inputs = '<input name="base_color" type="color3" nodegraph="g" output="out"/>'
    found = loaded(tmp_path, outer + graph + SURFACE.format(inputs)).values["base_color"]
    assert found == (0.5, 0.5, 0.0)


CUSTOM = """
<nodedef name="ND_half" node="half">
  <input name="of" type="float" value="0.8"/><output name="out" type="float"/>
</nodedef>
<nodegraph name="NG_half" nodedef="ND_half">
  <multiply name="m" type="float">
    <input name="in1" type="float" interfacename="of"/>
    <input name="in2" type="float" value="0.5"/>
  </multiply>
  <output name="out" type="float" nodename="m"/>
</nodegraph>
"""


def test_nodes_that_a_document_defines_are_evaluated(tmp_path):
    assert evaluated(tmp_path, CUSTOM + node("half", "")) == 0.4
    inner = node("half", given("of", "0.4"), name="inner")
    outer = node("half", linked("of", "inner"))
    assert evaluated(tmp_path, CUSTOM + inner + outer) == pytest.approx(0.1)


def test_a_surface_may_lie_in_a_graph(tmp_path):
    surface = SURFACE.format(given("base_weight", "0.5") + linked("base_metalness", "c"))
    constant = node("constant", given("value", "0.25"), name="c")
    output = '<output name="out" type="surfaceshader" nodename="s"/>'
    graph = f'<nodegraph name="g">{constant}{surface}{output}</nodegraph>'
    material = (
        '<surfacematerial name="m" type="material"><input name="surfaceshader" '
        'type="surfaceshader" nodegraph="g" output="out"/></surfacematerial>'
    )
    found = loaded(tmp_path, graph + material)
    assert (found.name, found.values["base_metalness"]) == ("m", 0.25)
    assert loaded(tmp_path, graph).values["base_metalness"] == 0.25


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        (node("image", given("file", "a.png", "filename")), r"is a texture \(a.png\); bake it"),
        (node("UsdUVTexture", ""), r"is a texture \(UsdUVTexture\)"),
        (
            node("noise3d", ""),
            r"varies over the surface, as a texture does \(node 'noise3d'\); bake",
        ),
        (node("dot", '<input name="in" type="float" defaultgeomprop="UV0" nodename="q"/>'), "'q'"),
        (node("dot", linked("in", "n")), "is connected to itself, or to over 100 nodes"),
        (node("divide", given("in2", "0")), "divide 'n': the result is not finite"),
        (node("dot", given("of", "1")), "dot 'n': has an input 'of', which is not known"),
        (node("dot", given("in", "1", "matrix33")), "is not of a type that is read"),
        (node("dot", given("in", "one")), "'one' is not made of numbers"),
        (node("dot", '<input name="in" type="float" interfacename="a"/>'), "takes 'a' of an inter"),
        (node("dot", '<input name="in" type="float" nodegraph="g"/>'), "a node graph 'g', which"),
        (node("dot", '<input name="in" type="float" output="o"/>'), "to an output 'o', which is"),
        (
            node("add", given("in1", "1, 2", "vector2") + given("in2", "1, 2, 3", "vector3")),
            "add 'n': its inputs do not fit|could not be broadcast",
        ),
        (CUSTOM.replace('nodename="m"', 'nodename="q"') + node("half", ""), "'q', which is not"),
        (CUSTOM.replace("<output", "<input") + node("half", ""), "node 'half'"),
        ('<nodegraph name="n"></nodegraph>', "to the output of 'n', which is not there"),
    ],
)
def test_what_is_no_constant_is_named(tmp_path, nodes, words):
    with pytest.raises(FormatError, match=words) as caught:
        evaluated(tmp_path, nodes)
    assert "s: base_weight: " in str(caught.value)


def test_circles_and_towers_end_soon(tmp_path):
    start = time.perf_counter()
    circle = node("dot", linked("in", "b"), name="n") + node("dot", linked("in", "n"), name="b")
    with pytest.raises(FormatError, match="to itself, or to over 100 nodes in a row"):
        evaluated(tmp_path, circle)
    circle = (
        '<nodegraph name="g"><output name="a" output="b"/><output name="b" output="a"/></nodegraph>'
    )
    with pytest.raises(FormatError, match="to itself"):
        loaded(
            tmp_path,
            circle + SURFACE.format('<input name="base_weight" nodegraph="g" output="a"/>'),
        )
    doubled = "".join(
        node("add", linked("in1", f"d{k + 1}") + linked("in2", f"d{k + 1}"), name=f"d{k}")
        for k in range(60)
    )
    doubled += node("constant", given("value", repr(0.5**61)), name="d60")
    assert evaluated(tmp_path, doubled + node("dot", linked("in", "d0"))) == 0.5
    tower = "".join(
        f'<nodedef name="ND_t{k}" node="t{k}"><output name="out" type="float"/></nodedef>'
        f'<nodegraph name="NG_t{k}" nodedef="ND_t{k}">'
        + node(f"t{k + 1}", "", name="x")
        + node(f"t{k + 1}", "", name="y")
        + node("add", linked("in1", "x") + linked("in2", "y"))
        + '<output name="out" type="float" nodename="n"/></nodegraph>'
        for k in range(30)
    )
    with pytest.raises(FormatError, match="takes over 20,000 steps to compute; bake it"):
        evaluated(tmp_path, tower + CUSTOM.replace("half", "t30") + node("t0", ""))
    assert time.perf_counter() - start < 20.0
