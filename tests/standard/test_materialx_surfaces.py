"""Surfaces that are read beside OpenPBR, and the opaque part of those that do more than reflect."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.standard.disney import AnisotropicDisney, Disney
from nacre.standard.files.materialx.surfaces import SURFACES
from nacre.standard.gltf import AnisotropicGltf, Gltf
from nacre.standard.openpbr import AnisotropicOpenPbr
from tests.oracles.runners.materialx import OpenGl, library
from tests.oracles.surface_shader import SurfaceShader


def document(category: str, values, more: str = "") -> str:
    inputs = "".join(
        f'<input name="{name}" type="{kind(value)}" value="{text(value)}"/>'
        for name, value in values.items()
    )
    surface = f'<{category} name="s" type="surfaceshader" {more}>{inputs}</{category}>'
    connected = '<input name="surfaceshader" type="surfaceshader" nodename="s"/>'
    material = f'<surfacematerial name="m" type="material">{connected}</surfacematerial>'
    return f'<materialx version="1.39">{surface}{material}</materialx>'


def kind(value) -> str:
    if isinstance(value, bool):
        return "boolean"
    return {tuple: "color3", int: "integer"}.get(type(value), "float")


def text(value) -> str:
    return ", ".join(map(repr, value)) if isinstance(value, tuple) else str(value).lower()


def loaded(folder, category, values, more="", **options):
    path = folder / "a.mtlx"
    path.write_text(document(category, values, more))
    return nacre.load(path, **options)


@pytest.mark.parametrize("category", SURFACES)
def test_inputs_and_defaults_are_those_of_the_definitions(category):
    pytest.importorskip("MaterialX", reason="needs MaterialX")
    surface = SURFACES[category]
    for name, changed in surface.definitions.items():
        definition = library().getNodeDef(name)
        assert definition.getNodeString() == category
        inputs = {each.getName(): each for each in definition.getActiveInputs()}
        known = {*surface.defaults, *surface.ignored, *surface.normals, *surface.tangents}
        assert set(inputs) == known
        for each, default in {**surface.defaults, **changed}.items():
            value = inputs[each].getValue()
            value = value.asTuple() if isinstance(default, tuple) else float(value)
            np.testing.assert_allclose(default, value, rtol=1e-6)
    (first, *_) = surface.definitions
    assert library().getNodeDef(first).getDefaultVersion() or len(surface.definitions) == 1


def _standard(random, **more):
    """Random values for all inputs of standard_surface that an opaque one has."""
    values = {
        name: tuple(random.uniform(0.05, 0.95, 3).tolist())
        if isinstance(default, tuple)
        else float(random.uniform(0.05, 0.95))
        for name, default in SURFACES["standard_surface"].defaults.items()
    }
    values |= {"specular_IOR": 1.7, "coat_IOR": 1.4, "thin_film_IOR": 1.3}
    values |= {"thin_film_thickness": 350.0, "opacity": (1.0, 1.0, 1.0), "thin_walled": False}
    absent = ("transmission", "subsurface", "emission", "coat_affect_color")
    values |= dict.fromkeys((*absent, "specular_rotation", "coat_rotation"), 0.0)
    return values | more


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"metalness": 0.0, "specular": 0.4},
        {"metalness": 0.0, "coat": 0.0, "thin_film_thickness": 0.0},
        {"metalness": 1.0, "specular_color": (0.0, 0.0, 0.0)},
        {"specular_anisotropy": 0.0, "coat_anisotropy": 0.0},
    ],
)
def test_standard_surface_is_translated_as_by_materialx(tmp_path, more):
    """Against the graph that MaterialX's translator writes, flattened, whose arithmetic is read."""
    mx = pytest.importorskip("MaterialX", reason="needs MaterialX")
    shading = pytest.importorskip("MaterialX.PyMaterialXGenShader")
    values = _standard(np.random.default_rng(4), **more)
    ours = loaded(tmp_path, "standard_surface", values)
    given = mx.createDocument()
    given.setDataLibrary(library())
    mx.readFromXmlString(given, document("standard_surface", values))
    (shader,) = mx.getShaderNodes(given.getMaterialNodes()[0])
    shading.ShaderTranslator.create().translateShader(shader, "open_pbr_surface")
    for graph in given.getNodeGraphs():
        graph.flattenSubgraphs()
    mx.writeToXmlFile(given, str(tmp_path / "translated.mtlx"))
    theirs = nacre.load(tmp_path / "translated.mtlx")
    assert type(ours) is type(theirs)
    assert ours.values.keys() == theirs.values.keys()
    for name, value in theirs.values.items():
        np.testing.assert_allclose(ours.values[name], value, rtol=1e-5, atol=1e-7, err_msg=name)
    assert ours.notes == ("Translated from standard_surface to OpenPBR, as MaterialX does it.",)


def test_older_standard_surfaces_have_older_defaults(tmp_path):
    newer = loaded(tmp_path, "standard_surface", {})
    assert (newer.values["base_weight"], newer.values["base_color"]) == (1.0, (0.8, 0.8, 0.8))
    for more in ('version="1.0.0"', 'nodedef="ND_standard_surface_surfaceshader_100"'):
        older = loaded(tmp_path, "standard_surface", {}, more)
        assert (older.values["base_weight"], older.values["base_color"]) == (0.8, (1.0, 1.0, 1.0))


def test_rotations_turn_the_tangent(tmp_path):
    values = {"specular_anisotropy": 0.5, "specular_rotation": 0.125}
    found = loaded(tmp_path, "standard_surface", values)
    assert isinstance(found, AnisotropicOpenPbr)
    assert found.values["angle"] == pytest.approx(-math.pi / 4.0)
    both = values | {"coat": 1.0, "coat_anisotropy": 0.5, "coat_rotation": 0.125}
    assert loaded(tmp_path, "standard_surface", both).values["angle"] == found.values["angle"]
    with pytest.raises(FormatError, match="tangents of base and coat are not the same"):
        loaded(tmp_path, "standard_surface", both | {"coat_rotation": 0.0})


def test_what_a_translation_drops_is_noted(tmp_path):
    values = {"coat": 1.0, "coat_affect_color": 0.5}
    notes = loaded(tmp_path, "standard_surface", values).notes
    assert notes[-1] == "OpenPBR has no coat_affect_color; it is left out (it is 0.5)."


def test_gltf_is_read_as_it_is(tmp_path):
    names = {
        "base_color": "baseColorFactor",
        "metallic": "metallicFactor",
        "roughness": "roughnessFactor",
        "ior": "ior",
        "specular": "specularFactor",
        "specular_color": "specularColorFactor",
        "iridescence": "iridescenceFactor",
        "iridescence_ior": "iridescenceIor",
        "iridescence_thickness": "iridescenceThicknessMaximum",
        "sheen_color": "sheenColorFactor",
        "sheen_roughness": "sheenRoughnessFactor",
        "clearcoat": "clearcoatFactor",
        "clearcoat_roughness": "clearcoatRoughnessFactor",
    }
    random = np.random.default_rng(2)
    values = {
        name: tuple(random.random(3).tolist()) if "color" in name else float(random.random())
        for name in names
    }
    values |= {"ior": 1.7, "iridescence_ior": 1.4, "iridescence_thickness": 300.0}
    found = loaded(tmp_path, "gltf_pbr", values)
    assert type(found) is Gltf
    assert found.values == {names[name]: value for name, value in values.items()}
    turned = values | {"anisotropy_strength": 0.5, "anisotropy_rotation": 4.0}
    found = loaded(tmp_path, "gltf_pbr", turned)
    assert type(found) is AnisotropicGltf
    assert found.values["anisotropyRotation"] == pytest.approx(4.0 - math.pi)


def test_usd_preview_surface_has_two_workflows(tmp_path):
    values = {"diffuseColor": (0.2, 0.4, 0.6), "metallic": 0.3, "roughness": 0.4, "ior": 1.8}
    found = loaded(tmp_path, "UsdPreviewSurface", values)
    assert found.values["baseColorFactor"] == (0.2, 0.4, 0.6)
    assert (found.values["metallicFactor"], found.values["ior"]) == (0.3, 1.8)
    assert found.notes == ("UsdPreviewSurface, read as glTF's material of the same values.",)
    values |= {"useSpecularWorkflow": 1, "specularColor": (0.04, 0.08, 0.4), "clearcoat": 0.5}
    found = loaded(tmp_path, "UsdPreviewSurface", values)
    assert (found.values["metallicFactor"], found.values["ior"]) == (0.0, 1.5)
    np.testing.assert_allclose(found.values["specularColorFactor"], (1.0, 2.0, 10.0))
    assert "Its coat has the index 1.5, not 1.8." in found.notes


def test_disney_is_mitsubas_principled(tmp_path):
    mi = pytest.importorskip("mitsuba", reason="needs Mitsuba")
    mi.set_variant("scalar_rgb")
    values = {"baseColor": (0.2, 0.4, 0.6), "metallic": 0.3, "roughness": 0.4, "specular": 0.7}
    values |= {"specularTint": 0.2, "sheen": 0.5, "sheenTint": 0.4, "clearcoat": 0.6}
    values |= {"clearcoatGloss": 0.7, "anisotropic": 0.5}
    found = loaded(tmp_path, "disney_principled", values)
    assert type(found) is AnisotropicDisney
    named = {"specularTint": "spec_tint", "sheenTint": "sheen_tint"}
    named |= {"clearcoatGloss": "clearcoat_gloss"}
    given = {named.get(k, k): v for k, v in values.items() if k != "baseColor"}
    color = {"type": "rgb", "value": list(values["baseColor"])}
    bsdf = mi.load_dict({"type": "principled", "base_color": color, **given})
    hit = mi.SurfaceInteraction3f()
    for wi, wo in _directions(40):
        hit.wi = wo.tolist()
        expected = np.array(bsdf.eval(mi.BSDFContext(), hit, wi.tolist())) / wi[2]
        np.testing.assert_allclose(found.eval(wi, wo), expected, rtol=2e-3, atol=1e-4)
    assert type(loaded(tmp_path, "disney_principled", {})) is Disney


def _directions(count: int):
    drawn = np.random.default_rng(7).normal(size=(2, count, 3))
    drawn[..., 2] = np.abs(drawn[..., 2]) + 0.2
    return zip(*(drawn / np.linalg.norm(drawn, axis=-1, keepdims=True)), strict=True)


REFUSED = [
    ("open_pbr_surface", {"transmission_weight": 0.25}, "transmission"),
    ("open_pbr_surface", {"subsurface_weight": 0.5}, "subsurface scattering"),
    ("open_pbr_surface", {"emission_luminance": 100.0}, "emission"),
    ("open_pbr_surface", {"geometry_opacity": 0.5}, "opacity"),
    ("standard_surface", {"transmission": 0.25}, "transmission"),
    ("standard_surface", {"subsurface": 0.5}, "subsurface scattering"),
    ("standard_surface", {"emission": 1.0}, "emission"),
    ("standard_surface", {"opacity": (0.5, 0.5, 0.5)}, "opacity"),
    ("gltf_pbr", {"transmission": 0.25, "metallic": 0.0}, "transmission"),
    ("gltf_pbr", {"emissive": (0.0, 0.1, 0.0)}, "emission"),
    ("gltf_pbr", {"alpha": 0.4, "alpha_mode": 2}, "transparency"),
    ("gltf_pbr", {"alpha": 0.4, "alpha_mode": 1}, "transparency"),
    ("UsdPreviewSurface", {"opacity": 0.75}, "transmission"),
    ("UsdPreviewSurface", {"opacity": 0.75, "opacityMode": 1}, "cut out"),
    ("UsdPreviewSurface", {"opacity": 0.25, "opacityThreshold": 0.5}, "cut out"),
    ("UsdPreviewSurface", {"emissiveColor": (1.0, 0.0, 0.0)}, "emission"),
    ("UsdPreviewSurface", {"displacement": 0.5}, "displacement"),
    ("disney_principled", {"specTrans": 0.25}, "transmission"),
    ("disney_principled", {"subsurface": 0.5}, "subsurface scattering"),
]


@pytest.mark.parametrize(("category", "values", "word"), REFUSED)
def test_what_is_not_opaque_is_refused_by_name_or_left_out(tmp_path, category, values, word):
    with pytest.raises(FormatError, match=f"{word}.*, or read the opaque part with --opaque-part"):
        loaded(tmp_path, category, values)
    found = loaded(tmp_path, category, values, opaque_part=True)
    assert any(name in note for name in values for note in found.notes) or found.notes


@pytest.mark.parametrize(
    ("category", "values"),
    [
        ("open_pbr_surface", {"transmission_weight": 0.5, "base_metalness": 1.0}),
        ("standard_surface", {"subsurface": 0.5, "metalness": 1.0}),
        ("gltf_pbr", {"emissive": (1.0, 1.0, 1.0), "emissive_strength": 0.0}),
        ("gltf_pbr", {"alpha": 0.5, "alpha_cutoff": 0.5, "alpha_mode": 1}),
        ("gltf_pbr", {"alpha": 0.5}),
        ("UsdPreviewSurface", {"opacity": 0.5, "opacityThreshold": 0.5}),
        ("UsdPreviewSurface", {"opacity": 0.5, "metallic": 1.0}),
        ("disney_principled", {"subsurface": 0.5, "specTrans": 1.0, "metallic": 1.0}),
    ],
)
def test_what_does_not_show_is_not_refused(tmp_path, category, values):
    loaded(tmp_path, category, values)


def test_the_opaque_part_has_less_diffuse_or_another_color(tmp_path):
    def values(**given):
        found = loaded(tmp_path, "open_pbr_surface", given, opaque_part=True)
        return found.values["base_weight"], found.values["base_color"]

    color, inner = (0.2, 0.4, 0.6), (0.8, 0.4, 0.2)
    assert values(base_color=color, transmission_weight=0.25) == (0.75, color)
    scattering = {"base_color": color, "subsurface_color": inner, "subsurface_weight": 0.5}
    assert values(**scattering) == (1.0, pytest.approx((0.5, 0.4, 0.4)))
    both = values(**scattering, base_weight=0.5, transmission_weight=0.5)
    assert both == (0.5, pytest.approx((0.45, 0.3, 0.25)))
    thin = {"subsurface_weight": 1.0, "subsurface_color": inner, "geometry_thin_walled": True}
    assert values(**thin) == (1.0, pytest.approx((0.4, 0.2, 0.1)))
    with pytest.raises(FormatError, match=r"base_metalness is 0\.5: no part of a metal transmits"):
        values(transmission_weight=0.5, base_metalness=0.5)


def test_glass_reflects_at_its_boundary_only(tmp_path):
    """Against MaterialX's GLSL, which shows no light from behind."""
    if problem := OpenGl().missing():
        pytest.skip(f"needs {problem}")
    values = {"transmission_weight": 1.0, "specular_roughness": 0.3, "specular_ior": 1.6}
    _compare(tmp_path, "open_pbr_surface", values, 1e-4)


@pytest.mark.parametrize(
    ("category", "values", "median"),
    [
        ("gltf_pbr", {"metallic": 1.0, "base_color": (0.9, 0.6, 0.3), "roughness": 0.4}, 4e-2),
        ("gltf_pbr", {"metallic": 0.0, "base_color": (0.1, 0.3, 0.7), "roughness": 0.4}, 2e-2),
        ("UsdPreviewSurface", {"metallic": 1.0, "roughness": 0.3}, 2e-2),
        ("UsdPreviewSurface", {"diffuseColor": (0.1, 0.3, 0.7)}, 2e-2),
        ("standard_surface", {"base_color": (0.1, 0.3, 0.7)}, 1e-4),
        ("standard_surface", {"metalness": 1.0, "base_color": (0.9, 0.6, 0.3)}, 5e-2),
        ("disney_principled", {"baseColor": (0.1, 0.3, 0.7)}, 6e-2),
    ],
)
def test_surfaces_look_as_in_materialx(tmp_path, category, values, median):
    if problem := OpenGl().missing():
        pytest.skip(f"needs {problem}")
    _compare(tmp_path, category, values, median)


def _compare(folder, category, values, median):
    light = np.array((0.3, 0.2, 0.9)) / np.linalg.norm((0.3, 0.2, 0.9))
    normals = np.array([wi for wi, _ in _directions(400)])
    normals = normals[(normals @ light > 0.1) & (normals[:, 2] > 0.1)]
    tangents = np.cross(normals, (0.3, 0.8, 0.1))
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    frame = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
    wi, wo = ((frame @ w).astype(np.float32) for w in (light, np.array((0.0, 0.0, 1.0))))
    shown = SurfaceShader(document(category, values)).radiance({}, light, normals, tangents)
    found = loaded(folder, category, values, opaque_part=True).eval(wi, wo) * wi[:, 2:]
    errors = np.abs(found - shown) / np.maximum(shown, 1e-3)
    assert np.median(errors) < median


TEXTURE = """
<materialx version="1.39">
  <image name="i" type="color3"><input name="file" type="filename" value="a.png"/></image>
  <gltf_pbr name="s" type="surfaceshader">
    <input name="base_color" type="color3" nodename="i"/>
    <input name="metallic" type="float" value="0.25"/>
    <input name="normal" type="vector3" nodename="n"/>
  </gltf_pbr>
  <normalmap name="n" type="vector3"/>
</materialx>
"""


def test_textures_are_refused_or_their_defaults_taken(tmp_path):
    (tmp_path / "a.mtlx").write_text(TEXTURE)
    with pytest.raises(FormatError, match="s: normal: is not read: only the surface's own"):
        nacre.load(tmp_path / "a.mtlx")
    found = nacre.load(tmp_path / "a.mtlx", opaque_part=True)
    assert found.values["baseColorFactor"] == (1.0, 1.0, 1.0)
    assert found.values["metallicFactor"] == 0.25
    assert found.notes == (
        "normal, a normal map, is left out.",
        "base_color is a texture (a.png); (1, 1, 1) is taken instead.",
    )


def test_a_tangent_that_varies_is_left_out(tmp_path):
    surface = (
        '<gltf_pbr name="s" type="surfaceshader"><input name="tangent" nodename="t"/></gltf_pbr>'
    )
    text = f'<materialx version="1.39">{surface}<image name="t" type="vector3"/></materialx>'
    (tmp_path / "a.mtlx").write_text(text)
    with pytest.raises(FormatError, match=r"s: tangent: is not a tangent .*; make it one, or read"):
        nacre.load(tmp_path / "a.mtlx")
    (note,) = nacre.load(tmp_path / "a.mtlx", opaque_part=True).notes
    assert note.startswith("tangent is not a tangent")


SEVERAL = """
<materialx version="1.39" colorspace="acescg">
  <gltf_pbr name="a" type="surfaceshader"/>
  <surfacematerial name="A" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="a"/>
  </surfacematerial>
  <disney_principled name="b" type="surfaceshader"/>
  <open_pbr_surface name="unused" type="surfaceshader"/>
  <surfacematerial name="B" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="b"/>
  </surfacematerial>
</materialx>
"""


def test_one_of_several_materials_is_chosen(tmp_path):
    path = tmp_path / "a.mtlx"
    path.write_text(SEVERAL)
    assert nacre.formats.materials_in(path) == ("A", "B")
    assert type(nacre.load(path, "A")) is Gltf
    assert type(nacre.load(path, "2")) is Disney
    assert nacre.load(path, "B").name == "B"
    with pytest.raises(FormatError, match="holds 2 materials; give a name or a number"):
        nacre.load(path)
    with pytest.raises(FormatError, match="has no material 'C'"):
        nacre.load(path, "C")


def test_colors_beyond_rec_709_are_kept_and_shown_from_zero_on(tmp_path):
    green = '<input name="base_color" type="color3" value="0, 1, 0" colorspace="acescg"/>'
    surface = f'<open_pbr_surface name="s" type="surfaceshader">{green}</open_pbr_surface>'
    (tmp_path / "a.mtlx").write_text(f'<materialx version="1.39">{surface}</materialx>')
    found = nacre.load(tmp_path / "a.mtlx")
    red, full, blue = found.values["base_color"]
    assert red < -0.5
    assert full > 1.1
    assert blue < -0.1
    clamped = type(found)(**{**found.values, "base_color": (0.0, full, 0.0)})
    wi, wo = (np.array(w) for w in zip(*_directions(20), strict=True))
    np.testing.assert_array_equal(found.eval(wi, wo), clamped.eval(wi, wo))
    nacre.save(found, tmp_path / "b.mtlx")
    assert nacre.load(tmp_path / "b.mtlx").values == found.values


def test_a_coat_over_a_bright_color_stays_finite(tmp_path):
    values = {"base_color": (1.7, 3.9, 1.0), "coat_weight": 1.0}
    found = loaded(tmp_path, "open_pbr_surface", values)
    wi, wo = (np.array(w) for w in zip(*_directions(50), strict=True))
    f = found.eval(wi, wo)
    assert (np.isfinite(f) & (f >= 0.0)).all()
    assert (f[:, 1] > 0.1).all()


def test_gltf_files_get_colors_that_they_may_have(tmp_path):
    found = loaded(tmp_path, "gltf_pbr", {"base_color": (-0.5, 1.2, 0.5)})
    nacre.save(found, tmp_path / "a.glb")
    assert nacre.load(tmp_path / "a.glb").values["baseColorFactor"] == (0.0, 1.0, 0.5)


def test_notes_go_with_the_file(tmp_path):
    found = loaded(tmp_path, "standard_surface", {"transmission": 1.0}, opaque_part=True)
    for name in ("b.mtlx", "b.usda"):
        nacre.save(found, tmp_path / name)
        assert nacre.load(tmp_path / name).notes == found.notes
        assert "Transmission is left out (transmission is 1)." in (tmp_path / name).read_text()
