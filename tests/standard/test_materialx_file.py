"""MaterialX documents, against MaterialX's own reader and definitions."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import nacre
from nacre import analytic
from nacre.errors import FormatError
from nacre.standard.files import openpbr_inputs
from nacre.standard.openpbr import AnisotropicOpenPbr
from tests.oracles.runners.materialx import library
from tests.specimens.surfaces import brdfs

mx = pytest.importorskip("MaterialX", reason="needs MaterialX")


def document(inputs: str = "", attributes: str = "", around: str = "{}") -> str:
    shader = f'<open_pbr_surface name="paint" type="surfaceshader">{inputs}</open_pbr_surface>'
    return f'<materialx version="1.39" {attributes}>{around.format(shader)}</materialx>'


MATERIAL = (
    '<surfacematerial name="m" type="material" SHOWN>'
    '<input name="surfaceshader" type="surfaceshader" nodename="paint"/></surfacematerial>'
)


def loaded(folder, text, **options):
    path = folder / "paint.mtlx"
    path.write_text(text)
    return nacre.load(path, **options)


@pytest.mark.parametrize("brdf", brdfs(), ids=lambda brdf: brdf.model)
def test_materialx_reads_what_is_written(tmp_path, brdf):
    path = tmp_path / "paint.mtlx"
    nacre.save(brdf, path)
    found = mx.createDocument()
    found.setDataLibrary(library())
    mx.readFromXmlFile(found, str(path))
    assert found.validate() == (True, "")
    (material,) = found.getMaterialNodes()
    (shader,) = mx.getShaderNodes(material)
    assert shader.getNodeDef().getName() == "ND_open_pbr_surface_surfaceshader"
    assert "free" in material.getAttribute("doc")
    for name, value in brdf.values.items():
        if name != "angle":
            read = shader.getInput(name)
            assert read.getActiveColorSpace() == "lin_rec709"
            numbers = read.getValue()
            numbers = numbers.asTuple() if isinstance(value, tuple) else numbers
            np.testing.assert_allclose(numbers, value, rtol=1e-6)


@pytest.mark.parametrize("brdf", brdfs(), ids=lambda brdf: brdf.model)
def test_what_is_written_comes_back(tmp_path, brdf):
    nacre.save(brdf, tmp_path / "paint.mtlx")
    back = nacre.load(tmp_path / "paint.mtlx")
    assert type(back) is type(brdf)
    assert (back.name, back.metadata) == (brdf.name, brdf.metadata)
    for name, value in brdf.values.items():
        assert back.values[name] == (pytest.approx(value, rel=1e-15) if name == "angle" else value)


def test_defaults_and_bounds_are_those_of_the_definition():
    definition = library().getNodeDef("ND_open_pbr_surface_surfaceshader")
    bounds = {p.name: p for p in AnisotropicOpenPbr.parameters}
    for given in definition.getInputs():
        name, value = given.getName(), given.getValue()
        if given.getType() not in ("float", "color3"):
            continue
        assert openpbr_inputs.KINDS[name] is (float if given.getType() == "float" else tuple)
        if name in openpbr_inputs.DEFAULTS:
            value = value.asTuple() if given.getType() == "color3" else value
            np.testing.assert_allclose(openpbr_inputs.DEFAULTS[name], value, rtol=1e-6)
            for end, parameter in (("min", bounds[name].low), ("max", bounds[name].high)):
                soft = given.getAttribute(f"uisoft{end}") or given.getAttribute(f"ui{end}")
                assert float(soft.split(",")[0]) == parameter
    assert set(openpbr_inputs.DEFAULTS) == set(bounds) - {"angle"}


def test_what_a_file_does_not_give_is_the_default(tmp_path):
    assert loaded(tmp_path, document()).values["base_color"] == (0.8, 0.8, 0.8)


@pytest.mark.parametrize(
    ("root", "own", "expected"),
    [
        ("", "", 0.5),
        ('colorspace="lin_rec709"', "", 0.5),
        ('colorspace="srgb_texture"', "", 0.2140411),
        ('colorspace="lin_rec709"', 'colorspace="srgb_texture"', 0.2140411),
        ('colorspace="srgb_texture"', 'colorspace="lin_rec709"', 0.5),
        ("", 'colorspace="g22_rec709"', 0.5**2.2),
    ],
)
def test_colors_are_converted_and_numbers_are_not(tmp_path, root, own, expected):
    inputs = f'<input name="base_color" type="color3" value="0.5, 0, 1" {own}/>'
    inputs += '<input name="base_metalness" type="float" value="0.5" />'
    values = loaded(tmp_path, document(inputs, root)).values
    assert values["base_color"] == pytest.approx((expected, 0.0, 1.0), abs=1e-6)
    assert values["base_metalness"] == 0.5


def given(name: str, value: str, kind: str = "float", more: str = "") -> str:
    return f'<input name="{name}" type="{kind}" value="{value}" {more}/>'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (document(given("base_weight", "", more='nodename="x"')), "paint: base_weight: is connect"),
        (
            document(given("base_color", "1, 1, 1", "color3", 'colorspace="acescc"')),
            "base_color: color space 'acescc' is none of those read: acescg,",
        ),
        (document(given("base_color", "9, 1, 1", "color3")), r"base_color must lie in \[-2, 4\]"),
        (document(given("base_weight", "0.1", more='unit="meter"')), "base_weight: has a unit"),
        (document(given("base_weight", "1, 2")), "base_weight: is not one float"),
        (document(given("base_color", "1")), "base_color: is not a color3"),
        (document(given("base_weight", "x")), "base_weight: 'x' is not made of numbers"),
        (document(given("base_wait", "1")), "paint: base_wait: is not known"),
        (document(given("specular_ior", "0.5")), r"specular_ior must lie in \[1, 100\]"),
        (document(given("transmission_weight", "0.5")), "transmission_weight is 0.5: transmission"),
        (document(given("transmission_weight", "2")), r"transmission_weight must lie in \[0, 1\]"),
        (document(given("subsurface_weight", "1")), "subsurface_weight is 1: subsurface scatter"),
        (document(given("emission_luminance", "9")), "emission_luminance is 9: emission is not"),
        (document(given("geometry_opacity", "0.5")), "geometry_opacity is 0.5: opacity other"),
        (
            document(
                '<input name="geometry_normal" nodename="a"/>', around='{}<normalmap name="a"/>'
            ),
            "paint: geometry_normal: is not read",
        ),
        (
            document('<input name="geometry_normal" nodename="a"/>'),
            "connected to 'a', which is not",
        ),
        (
            document(
                '<input name="geometry_tangent" nodename="a"/>', around='{}<normal name="a"/>'
            ),
            "paint: geometry_tangent: is not a tangent",
        ),
        (
            document().replace("open_pbr", "lama"),
            "is a lama_surface; surfaces that are read: open_",
        ),
        (document(around="{0}{0}"), "holds 2 materials; .* --material: paint, paint"),
        (document(around="{0}{0}").replace("open_pbr_surface", "a"), "holds 2 materials"),
        (
            document(around='<xi:include href="/etc/passwd"/><!-- {} -->'),
            r"includes another file \(/etc/passwd\); save it with all in one",
        ),
        (document(around='<material name="a"/><!-- {} -->'), "of MaterialX before 1.38; open and"),
        (document(around="<!-- {} -->"), "has no material and no surface"),
        (document(around='{}<surfacematerial name="a"/>'), "a: has no surface"),
        (
            document(
                around='{}<surfacematerial><input name="surfaceshader" nodename="b"/>'
                "</surfacematerial>"
            ),
            "surfaceshader: is connected to 'b', which is not there",
        ),
        (
            document(
                around='{}<displacement name="d" type="displacementshader"/><surfacematerial '
                'name="m"><input name="displacementshader" nodename="d"/></surfacematerial>'
            ),
            "m: displacementshader: only a surface at the front is read; remove it, or",
        ),
        (document().replace("<open_pbr_surface", '<open_pbr_surface nodedef="ND_a"'), "'ND_a'"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + document(given("base_weight", "&b;")), "DOCTYPE"),
        (document(around="<a>" * 100 + "{}" + "</a>" * 100), "more than 64 elements"),
        (document()[:-3], "is not whole XML"),
        (
            document(around=MATERIAL.replace("<surf", "{}<surf").replace("SHOWN", 'nacre="[]"')),
            "'nacre' is not what nacre writes",
        ),
    ],
)
def test_what_is_not_read_is_named(tmp_path, text, words):
    with pytest.raises(FormatError, match=words) as caught:
        loaded(tmp_path, text)
    assert str(tmp_path) in str(caught.value)


def test_what_has_no_effect_is_no_hindrance(tmp_path):
    texture = '<image name="i" type="float"><input name="file" type="filename" value="a"/></image>'
    more = '<input name="transmission_depth" type="float" nodename="i"/>'
    more += given("geometry_thin_walled", "true", "boolean") + given("coat_ior", "0")
    assert loaded(tmp_path, document(more, around="{}" + texture)).values["coat_ior"] == 1.6
    inputs = given("transmission_color", "1, 0, 0", "color3") + given("subsurface_radius", "2")
    inputs += given("geometry_opacity", "1") + given("geometry_thin_walled", "false", "boolean")
    assert loaded(tmp_path, document(inputs)).model == "openpbr"


def test_other_materials_are_fitted(tmp_path, monkeypatch):
    monkeypatch.setattr(analytic, "fit", partial(analytic.fit, starts=1))
    plain = analytic.MODELS["lambert"](diffuse=(0.2, 0.3, 0.4), name="plain")
    nacre.save(plain, tmp_path / "plain.mtlx")
    found = nacre.load(tmp_path / "plain.mtlx")
    assert found.metadata["fit"]["views_psnr"] > 30.0
    wi, wo = np.random.default_rng(1).random((2, 50, 3)) + 0.1
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    errors = np.abs(found.eval(wi, wo) / plain.eval(wi, wo) - 1.0)
    assert np.median(errors) < 0.1


@pytest.mark.parametrize(
    "changed",
    [
        lambda text: "<!-- " + "terms and more terms\n" * 200 + "-->\n" + text,
        lambda text: "\ufeff" + text.replace("\n", "\r\n"),
        lambda text: '<?xml version="1.0" encoding="utf-16"?>' + text,
    ],
    ids=["long comment", "mark and CRLF", "UTF-16"],
)
def test_documents_of_other_editors_are_read(tmp_path, changed):
    text = changed(document(given("base_weight", "0.5")))
    path = tmp_path / "PAINT.MTLX"
    path.write_bytes(text.encode("utf-16" if "utf-16" in text else "utf-8"))
    assert nacre.load(path).values["base_weight"] == 0.5
