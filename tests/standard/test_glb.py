"""glTF files: what other tools say of those that are written, and what is refused by name."""

from __future__ import annotations

import json
import math
import os
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.errors import FormatError
from nacre.formats import load_brdf
from nacre.standard.files import gltf_material
from nacre.standard.files.glb import encode, save
from nacre.standard.files.sphere import sphere
from tests.analytic.materials import EXAMPLES
from tests.oracles import blender
from tests.oracles.gltf_viewers import LAYERS, made
from tests.oracles.runners import gltf

MODEL = EXAMPLES["gltf-anisotropic"]


def content(data: bytes) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    return found


def changed(path: Path, **parts: Any) -> Path:
    """A `.gltf` whose one material has other parts; None leaves one out."""
    material = {**gltf_material.to_json(MODEL), **parts}
    material = {name: part for name, part in material.items() if part is not None}
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "materials": [material]}))
    return path


@pytest.mark.skipif(gltf.missing_validator() is not None, reason="needs gltf-validator and node")
def test_the_khronos_validator_finds_nothing(tmp_path: Path) -> None:
    paths = [tmp_path / f"{place}.glb" for place in range(len(LAYERS))]
    for path, layers in zip(paths, LAYERS.values(), strict=True):
        nacre.save(made(1, layers), path)
    for report, layers in zip(gltf.validate(paths), LAYERS.values(), strict=True):
        issues, info = report["issues"], report["info"]
        assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
        assert info["totalTriangleCount"] == 3968
        assert bool(info.get("extensionsUsed")) == bool(layers)
    broken = paths[0].read_bytes().replace(b'"metallicFactor":0', b'"metallicFactor":9')
    (tmp_path / "broken.glb").write_bytes(broken)
    (report,) = gltf.validate([tmp_path / "broken.glb"])
    assert report["issues"]["numErrors"] > 0


IMPORT = """
import bpy, json, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
(material,) = bpy.data.objects[0].data.materials
node = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
found = {i.name: getattr(i, "default_value", None) for i in node.inputs if not i.is_linked}
print()
print(json.dumps({k: list(v) if hasattr(v, "__len__") else v for k, v in found.items()}))
"""


@pytest.mark.skipif(blender.missing() is not None, reason=f"needs {blender.missing()}")
def test_blender_imports_the_numbers(tmp_path: Path) -> None:
    """All but the film, which its importer leaves out."""
    nacre.save(MODEL, tmp_path / "x.glb")
    done = subprocess.run(
        [os.environ[blender.VARIABLE], "-c", IMPORT, str(tmp_path / "x.glb")],
        env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout.strip().splitlines()[-1])
    expected: dict[str, Any] = {
        "Base Color": [*MODEL.values["baseColorFactor"], 1.0],
        "Metallic": MODEL.values["metallicFactor"],
        "Roughness": MODEL.values["roughnessFactor"],
        "IOR": MODEL.values["ior"],
        "Specular IOR Level": 0.5 * MODEL.values["specularFactor"],
        "Specular Tint": [*MODEL.values["specularColorFactor"], 1.0],
        "Anisotropic": MODEL.values["anisotropyStrength"],
        "Anisotropic Rotation": MODEL.values["anisotropyRotation"] / (2.0 * math.pi),
        "Coat Weight": MODEL.values["clearcoatFactor"],
        "Coat Roughness": MODEL.values["clearcoatRoughnessFactor"],
        "Sheen Roughness": MODEL.values["sheenRoughnessFactor"],
        "Sheen Tint": [*MODEL.values["sheenColorFactor"], 1.0],
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-6), name


@pytest.mark.parametrize("model", ["gltf", "gltf-anisotropic"])
def test_a_material_comes_back_as_it_was(tmp_path: Path, model: str) -> None:
    facts = {"fit": {"views_psnr": 31.5}, "source": {"file": "a.bsdf", "terms": "CC BY 4.0"}}
    brdf = EXAMPLES[model].replaced(name="Gold, brushed", metadata=facts)
    path = tmp_path / "x.glb"
    nacre.save(brdf, path)
    back = load_brdf(path)
    assert type(back) is MODELS[model]
    assert back.values == brdf.values
    assert back.name == brdf.name
    assert back.metadata == facts
    assert path.read_bytes() == encode(brdf)
    assert content(path.read_bytes())["asset"]["copyright"] == "CC BY 4.0"


def test_layers_that_are_off_are_not_written(tmp_path: Path) -> None:
    brdf = made(2, ())
    assert "extensions" not in gltf_material.to_json(brdf)
    nacre.save(brdf, tmp_path / "x.glb")
    back = load_brdf(tmp_path / "x.glb")
    assert type(back) is MODELS["gltf"]
    wi = np.array([[0.3, 0.2, 0.9], [0.6, -0.5, 0.6]])
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    np.testing.assert_allclose(back.eval(wi, wi[::-1]), brdf.eval(wi, wi[::-1]), rtol=1e-6)


@pytest.mark.slow
def test_any_reflectance_is_fitted(tmp_path: Path) -> None:
    gray = MODELS["lambert"](name="gray", diffuse=(0.5, 0.5, 0.5))
    save(gray, tmp_path / "gray.glb")
    back = load_brdf(tmp_path / "gray.glb")
    wi, wo = np.array([0.0, 0.6, 0.8]), np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(back.eval(wi, wo), 0.5 / math.pi, rtol=0.05)
    assert back.metadata["fit"]["views_psnr"] > 35.0


def test_the_sphere_is_closed_and_seen_from_outside() -> None:
    mesh = sphere()
    corners = mesh.positions[mesh.triangles].astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ni,ni->n", area, corners.mean(axis=1)) > 0.0).all()
    volume = np.einsum("ni,ni->n", area, corners[:, 0]).sum() / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * math.pi, rel=0.01)
    assert np.linalg.norm(area, axis=1).sum() / 2.0 == pytest.approx(4.0 * math.pi, rel=0.01)
    uv = mesh.uv[mesh.triangles].astype(np.float64)
    edges, turns = corners[:, 1:] - corners[:, :1], uv[:, 1:] - uv[:, :1]
    along = np.linalg.solve(turns, edges)[:, 0]  # how the position goes with u
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    tangents = mesh.tangents[mesh.triangles].mean(axis=1)[:, :3]
    assert np.einsum("ni,ni->n", along, tangents).min() > 0.97


def test_files_of_other_tools_are_read(tmp_path: Path) -> None:
    """Defaults are the specification's; a rotation by half a turn is none; names choose."""
    path = tmp_path / "x.gltf"
    both = {"anisotropyStrength": 0.5, "anisotropyRotation": 2.0}
    turned = {"name": "turned", "extensions": {"KHR_materials_anisotropy": both}}
    path.write_text(json.dumps({"materials": [{"doubleSided": True, "extras": 1}, turned]}))
    first, second = load_brdf(path, "1"), load_brdf(path, "turned")
    assert first.values["baseColorFactor"] == (1.0, 1.0, 1.0)
    assert first.values["metallicFactor"] == first.values["roughnessFactor"] == 1.0
    assert second.values["anisotropyRotation"] == pytest.approx(2.0 - math.pi)
    with pytest.raises(FormatError, match=r"has no material 'x' among its 2"):
        load_brdf(path, "x")


TEXTURE = {"index": 0}


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"normalTexture": TEXTURE}, "normalTexture'?: is a texture"),
        ({"pbrMetallicRoughness": {"baseColorTexture": TEXTURE}}, "baseColorTexture'?: is a tex"),
        ({"extensions": {"KHR_materials_sheen": {"sheenColorTexture": TEXTURE}}}, "sheenColorTex"),
        ({"extensions": {"KHR_materials_transmission": {}}}, "transmission'?: is not in the model"),
        ({"extensions": {"KHR_materials_ior": {"ior": 0}}}, "ior: 0 is a mode for old materials"),
        ({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}, r"ior must lie in \[1, 5\]"),
        ({"emissiveFactor": [0, 0, 1]}, "emissiveFactor: emits light"),
        ({"alphaMode": "BLEND"}, "alphaMode: 'BLEND': only OPAQUE"),
        ({"pbrMetallicRoughness": {"roughnessFactor": "0.5"}}, "roughnessFactor: takes numbers"),
        ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1]}}, "baseColorFactor: takes 4 numbers"),
        ({"pbrMetallicRoughness": {"shininess": 3}}, "shininess'?: is not in the model"),
        ({"pbrMetallicRoughness": 3}, "pbrMetallicRoughness: is not an object"),
    ],
)
def test_what_the_model_has_not_is_refused_by_name(
    tmp_path: Path, parts: dict[str, Any], words: str
) -> None:
    with pytest.raises(FormatError, match=words) as error:
        load_brdf(changed(tmp_path / "x.gltf", **parts))
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"{tmp_path / 'x.gltf'}: material 1: ")
