"""USD layers, against OpenUSD's reader and validators, and MaterialX's definitions."""

from __future__ import annotations

import re

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.standard.files import usda_text
from tests.oracles.runners.materialx import library
from tests.specimens.surfaces import brdfs

NODES = "ND_open_pbr_surface_surfaceshader", "UsdPreviewSurface"
TYPES = {"float": "float", "color3": "color3f", "vector3": "float3", "string": "string"}


@pytest.fixture(params=brdfs(), ids=lambda brdf: brdf.model)
def brdf(request):
    return request.param


@pytest.fixture
def path(brdf, tmp_path):
    nacre.save(brdf, tmp_path / "paint.usda")
    return tmp_path / "paint.usda"


def surfaces(path):
    usd = pytest.importorskip("pxr.Usd", reason="needs usd-core")
    shade = pytest.importorskip("pxr.UsdShade")
    stage = usd.Stage.Open(str(path))
    material = shade.MaterialBindingAPI(stage.GetPrimAtPath("/paint/sphere")).ComputeBoundMaterial()
    return stage, [material[0].ComputeSurfaceSource(context)[0] for context in ("mtlx", "")]


def test_openusd_finds_both_surfaces(path, brdf):
    stage, shaders = surfaces(path)
    assert tuple(shader.GetIdAttr().Get() for shader in shaders) == NODES
    for name, value in brdf.values.items():
        if name != "angle":
            found = shaders[0].GetInput(name).Get()
            np.testing.assert_allclose(np.array(found), value, rtol=1e-6)
    assert "free" in stage.GetPrimAtPath("/paint/materials/paint").GetCustomDataByKey("about")
    assert stage.GetDefaultPrim().GetName() == "paint"


def test_openusd_finds_it_valid(path):
    """But for nodes of MaterialX, which usd-core does not bring: these are looked at below."""
    stage, _ = surfaces(path)
    validation = pytest.importorskip("pxr.UsdValidation")
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    errors = validation.ValidationContext(validators).Validate(stage)
    others = [e.GetMessage() for e in errors if "'ND_" not in e.GetMessage()]
    assert not others


def test_nodes_have_the_inputs_that_materialx_defines(path):
    stage, _ = surfaces(path)
    shade = pytest.importorskip("pxr.UsdShade")
    seen = 0
    for prim in stage.Traverse():
        shader = shade.Shader(prim)
        if shader and shader.GetIdAttr().Get().startswith("ND_"):
            definition = library().getNodeDef(shader.GetIdAttr().Get())
            for each in shader.GetInputs():
                expected = definition.getInput(each.GetBaseName()).getType()
                assert str(each.GetTypeName()) == TYPES[expected]
                seen += 1
    assert seen >= 19


def test_what_is_written_comes_back(path, brdf):
    back = nacre.load(path)
    assert type(back) is type(brdf)
    assert (back.name, back.metadata) == (brdf.name, brdf.metadata)
    for name, value in brdf.values.items():
        assert back.values[name] == (pytest.approx(value, rel=1e-15) if name == "angle" else value)


def test_what_openusd_writes_again_is_read(path, brdf):
    stage, _ = surfaces(path)
    again = path.with_name("again.usda")
    stage.Flatten().Export(str(again))
    back = nacre.load(again)
    assert back.metadata == brdf.metadata
    for name, value in brdf.values.items():
        np.testing.assert_allclose(back.values[name], value, rtol=1e-6)


def test_a_binary_layer_is_refused_with_the_fix(path):
    stage, _ = surfaces(path)
    stage.Export(str(path.with_suffix(".usd")), args={"format": "usdc"})
    with pytest.raises(FormatError, match="binary layer; convert it to text with usdcat"):
        nacre.load(path.with_suffix(".usd"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("float inputs:base_weight = 0.9", "float inputs:base_weight = nan", "is not one number"),
        ("float inputs:base_weight = 0.9", "float inputs:base_weight = 2", "must lie in"),
        ("float inputs:base_weight = 0.9", "float inputs:base_weight.connect = </a>", "bake it"),
        ("float inputs:base_weight = 0.9", "float inputs:base_weight.timeSamples = {1: 2}", "bake"),
        ("float inputs:base_weight = 0.9", "float inputs:opacity = 0.9", "opacity: is not known"),
        ("inputs:base_weight = 0.9", "inputs:transmission_weight = 1", "transmission_weight is 1:"),
        ("(0.6, 0.3, 0.1)", "(0.6, 0.3)", "base_color: is not a color of three numbers"),
        ("(0.6, 0.3, 0.1)", '(1, 1, 1) (colorSpace = "acescc")', "'acescc' is none of"),
        ("ND_open_pbr", "ND_standard", "ND_standard_surface_surfaceshader; only"),
        ("outputs:mtlx:surface.connect", "outputs:b.connect", "its surface is UsdPreviewSurface"),
        ('def Material "paint"', 'def Scope "paint"', "has 0 materials"),
        ('def Scope "materials"', 'def Material "materials"', "has 2 materials"),
        ('def Scope "materials"', 'variantSet "a" = {}', "line 22: has variants"),
        ("radius = 0.1", "radius = $", "line 18: '"),
        ("radius = 0.1", "radius = " + "(" * 99, "more than 64 prims"),
        ("#usda 1.0", "#usda 2.0", "known format|does not begin"),
    ],
)
def test_what_is_not_read_is_named(tmp_path, old, new, words):
    path = tmp_path / "paint.usda"
    nacre.save(brdfs()[0], path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError, match=words) as caught:
        nacre.load(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("text", ["plain", 'a "b" \\c', "two\nlines", "tab\t é", '"""', "'''"])
def test_texts_come_back(text):
    layer = usda_text.parse(f"#usda 1.0\n( doc = {usda_text.quoted(text)} )")
    assert layer.metadata["doc"] == text


def test_the_opaque_part_is_read_in_any_color_space(tmp_path):
    path = tmp_path / "paint.usda"
    nacre.save(brdfs()[0], path)
    text = path.read_text()
    weight = re.search(r"inputs:base_weight = [0-9.]+", text)
    color = re.search(r"inputs:base_color = \([^)]*\)", text)
    assert weight
    assert color
    text = text.replace(
        color[0], 'inputs:base_color = (0.9, 0.8, 0.7) (colorSpace = "lin_ap1_scene")'
    )
    path.write_text(text)
    expected = (0.978831, 0.788029, 0.682302)
    np.testing.assert_allclose(nacre.load(path).values["base_color"], expected, atol=1e-6)
    more = f"{weight[0]}\n                float inputs:transmission_weight = 1"
    metal = re.sub(r"inputs:base_metalness = [0-9.]+", "inputs:base_metalness = 0", text)
    path.write_text(metal.replace(weight[0], more))
    with pytest.raises(FormatError, match=r"transmission is not read.*--opaque-part"):
        nacre.load(path)
    found = nacre.load(path, opaque_part=True)
    assert found.values["base_weight"] == 0.0
    assert found.notes == ("Transmission is left out (transmission_weight is 1).",)
