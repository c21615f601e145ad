"""Documents of the OpenPBR and MaterialX projects, read a second time with regular expressions."""

from __future__ import annotations

import re

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from tests.data import list_data, require_data
from tests.oracles.runners.materialx import OpenGl
from tests.oracles.surface_shader import SurfaceShader

FILES = [
    f"{folder}/{name}" for folder in ("openpbr", "materialx")
    for name in list_data(f"field/{folder}", "*.mtlx")
]  # fmt: skip
AP1_TO_709 = np.array(
    (
        (1.705050992658, -0.130256417507, -0.024003356805),
        (-0.621792120657, 1.140804736575, -0.128968976065),
        (-0.083258872001, -0.010548319068, 1.15297233287),
    )
)
"""From MaterialX's cmlib_ng.mtlx, for rows."""

EFFECTS = {
    "transmission_weight": "transmission",
    "transmission": "transmission",
    "specTrans": "transmission",
    "subsurface_weight": "subsurface scattering",
    "subsurface": "subsurface scattering",
    "emission_luminance": "emission",
    "emission": "emission",
}
SHARED = {
    "gltf_pbr": {"base_color": "baseColorFactor", "roughness": "roughnessFactor"}
    | {"metallic": "metallicFactor", "clearcoat": "clearcoatFactor"},
    "UsdPreviewSurface": {"diffuseColor": "baseColorFactor", "roughness": "roughnessFactor"}
    | {"metallic": "metallicFactor", "clearcoat": "clearcoatFactor"},
    "disney_principled": {"baseColor": "base_color", "roughness": "roughness"}
    | {"anisotropic": "anisotropic", "clearcoat": "clearcoat"},
    "standard_surface": {"base": "base_weight", "specular_roughness": "specular_roughness"}
    | {"metalness": "base_metalness", "sheen": "fuzz_weight", "sheen_color": "fuzz_color"}
    | {"coat_roughness": "coat_roughness"},
}
"""Inputs that are numbers of nacre's models as they are, where the coat has no color."""


def read_again(text: str) -> tuple[str, dict[str, float | np.ndarray]]:
    """The category of the surface, and its inputs with numbers, in linear Rec. 709."""
    (category, body), *more = re.findall(
        r'<(\w+) name="\w+" type="surfaceshader">(.*?)</\1>', text, re.DOTALL
    )
    assert not more
    found: dict[str, float | np.ndarray] = {}
    for name, kind, value in re.findall(r'name="(\w+)" type="(\w+)"\s+value="([^"]*)"', body):
        numbers = np.array([float({"true": 1, "false": 0}.get(v, v)) for v in value.split(",")])
        if kind == "color3" and 'colorspace="acescg"' in text:
            numbers = numbers @ AP1_TO_709
        found[name] = numbers if len(numbers) == 3 else float(numbers[0])
    return category, found


def beyond(text: str) -> str:
    """What a document has that no opaque surface of one value has, by name; else empty."""
    if "xi:include" in text:
        return "includes another file"
    if "tiledimage" in text:
        return "is a texture"
    given = read_again(text)[1]
    return next((word for name, word in EFFECTS.items() if given.get(name)), "")


@pytest.mark.parametrize("name", FILES)
def test_opaque_ones_are_read_and_others_refused_by_name(name):
    path = require_data("field", *name.split("/"))
    word = beyond(path.read_text())
    if not word:
        assert nacre.load(path).name
        return
    with pytest.raises(FormatError, match=word):
        nacre.load(path)
    if "include" in word:
        with pytest.raises(FormatError, match=word):
            nacre.load(path, opaque_part=True)
        return
    assert any(word in note.lower() for note in nacre.load(path, opaque_part=True).notes)


@pytest.mark.parametrize("name", FILES)
def test_numbers_are_those_of_a_second_reading(name):
    path = require_data("field", *name.split("/"))
    text = path.read_text()
    if beyond(text):
        pytest.skip("is not opaque")
    category, given = read_again(text)
    found = nacre.load(path).values
    checked = 0
    for theirs, value in given.items():
        ours = SHARED.get(category, {}).get(theirs, theirs)
        if ours in found and (category in SHARED) == (theirs in SHARED.get(category, {})):
            np.testing.assert_allclose(found[ours], value, rtol=1e-6, atol=1e-6, err_msg=theirs)
            checked += 1
    assert checked


@pytest.mark.parametrize("name", [name for name in FILES if "/open_pbr_" in name])
def test_surfaces_look_as_materialx_draws_them(name, tmp_path):
    """By MaterialX's GLSL with its color management; roughness that single precision resolves."""
    if problem := OpenGl().missing():
        pytest.skip(f"needs {problem}")
    text = require_data("field", *name.split("/")).read_text()
    if beyond(text) in ("subsurface scattering", "emission"):
        pytest.skip("MaterialX draws what is left out here")
    text = re.sub(
        r'(oughness" type="float" +value=")([0-9.]+)',
        lambda found: f"{found[1]}{max(float(found[2]), 0.15)}",
        text,
    )
    path = tmp_path / "a.mtlx"
    path.write_text(text)
    random = np.random.default_rng(3)
    light = np.array((0.4, 0.3, 0.866)) / np.linalg.norm((0.4, 0.3, 0.866))
    normals = random.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = normals[(normals[:, 2] > 0.1) & (normals @ light > 0.1)]
    tangents = np.cross(normals, random.normal(size=normals.shape))
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    frame = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
    wi, wo = ((frame @ w).astype(np.float32) for w in (light, np.array((0.0, 0.0, 1.0))))
    shown = SurfaceShader(text).radiance({}, light, normals, tangents)
    found = nacre.load(path, opaque_part=True).eval(wi, wo) * wi[:, 2:]
    errors = np.abs(found - shown) / np.maximum(shown, 1e-3)
    assert np.quantile(errors, 0.95) < 1e-4
    assert errors.max() < 5e-3


@pytest.mark.parametrize(
    ("name", "base_color"),
    [
        ("openpbr_acescg/acescg.mtlx", (0.978, 0.788, 0.682)),
        ("openpbr_acescg/acescg_in_gamut.mtlx", (0.978, 0.788, 0.682)),
        ("openpbr_empty_displacement/empty.mtlx", (0.8, 0.8, 0.8)),
    ],
)
def test_small_cases_are_read(name, base_color):
    found = nacre.load(require_data("cases", *name.split("/")))
    np.testing.assert_allclose(found.values["base_color"], base_color, atol=2e-3)
