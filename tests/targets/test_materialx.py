"""MaterialX nodes: valid, written by every generator, and right in any frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.brdf import Brdf
from nacre.targets import TARGETS, identifier
from tests.oracles.materials import material
from tests.oracles.pairs import pairs
from tests.oracles.runner import reference, worst_error
from tests.oracles.runners import materialx
from tests.targets.support import needs
from tests.targets.test_source import HOSTILE

mx = pytest.importorskip("MaterialX")


def document(folder: Path, name: str, brdf: Brdf | None = None):
    """The document of an exported material, with the definitions of MaterialX."""
    stem = identifier(name)
    named = (brdf or material("ggx")).replaced(name=name, source={"terms": name})
    exported = TARGETS["materialx"]().files(named, stem)
    for file, content in exported.items():
        (folder / file).write_bytes(content)
    made = mx.createDocument()
    made.setDataLibrary(materialx.library())
    mx.readFromXmlFile(made, str(folder / f"{stem}.mtlx"))
    return made, made.getNode(stem)


@pytest.mark.parametrize("name", ["brushed metal", "normal", *HOSTILE])
def test_documents_are_valid_whatever_the_name(name: str, tmp_path: Path) -> None:
    made, node = document(tmp_path, name)
    assert made.validate() == (True, "")
    assert node.getCategory() == "surfacematerial"
    for suffix in ("reflectance", "sample", "pdf"):
        definition = made.getNodeDef(f"ND_{identifier(name)}_{suffix}")
        for target, ending in (("genglsl", "glsl"), ("genosl", "osl")):
            implementation = definition.getImplementation(target)
            source = (tmp_path / implementation.getAttribute("file")).read_text()
            assert implementation.getAttribute("file").endswith(ending)
            assert source.count(f"void {implementation.getAttribute('function')}(") == 1


@pytest.mark.parametrize(
    "generator",
    ["GenGlsl.Glsl", "GenGlsl.Essl", "GenGlsl.Vk", "GenGlsl.Wgsl", "GenMsl.Msl", "GenSlang.Slang",
     "GenOsl.Osl"],
)  # fmt: skip
def test_every_generator_writes_the_material(generator: str, tmp_path: Path) -> None:
    made, node = document(tmp_path, "gloss")
    (source,) = materialx.generated(generator, made, node, ("pixel",))
    assert source.count("gloss_reflectance_node(") == 2  # defined and called


def test_nodes_of_two_kinds_stand_in_one_shader(tmp_path: Path) -> None:
    """Weighted by its density, as an estimate of what is reflected would be."""
    made, _ = document(tmp_path, "gloss")
    graph = made.addNodeGraph("estimate")
    density = graph.addNode("gloss_pdf", "density", "float")
    reflectance = graph.addNode("gloss_reflectance", "reflectance", "color3")
    weight = graph.addNode("divide", "weight", "color3")
    weight.addInput("in1", "color3").setConnectedNode(reflectance)
    weight.addInput("in2", "float").setConnectedNode(density)
    shown = graph.addOutput("shown", "color3")
    shown.setConnectedNode(weight)
    needs_opengl()
    sources = materialx.generated("GenGlsl.Glsl", made, shown, ("vertex", "pixel"))
    frame = {"i_normal": np.array([[0, 0, 1]]), "i_tangent": np.array([[1, 0, 0]])}
    found = materialx.drawing(sources, frame, {})()
    brdf, up = material("ggx"), np.array([[0.0, 0.0, 1.0]])
    expected = brdf.eval(up, up) / brdf.pdf(up, up)
    np.testing.assert_allclose(found[:, :3], expected, rtol=1e-3)


def test_the_material_is_right_in_any_frame(tmp_path: Path) -> None:
    needs_opengl()
    brdf = material("anisotropic")
    made, node = document(tmp_path, "gloss", brdf)
    sources = materialx.generated("GenGlsl.Glsl", made, node, ("vertex", "pixel"))
    random = np.random.default_rng(0)
    normal = random.normal(size=(500, 3))
    along = random.normal(size=(500, 3))
    eye = np.array([0.4, -0.3, 2.0])
    found = materialx.drawing(
        sources, {"i_normal": normal, "i_tangent": along}, {"u_viewPosition": eye}
    )()
    z = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    x = along - (along * z).sum(1, keepdims=True) * z
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frame = np.stack([x, np.cross(z, x), z], axis=1)
    light = np.array([0.4, 0.6, 0.7]) / np.linalg.norm([0.4, 0.6, 0.7])
    view = eye - materialx.positions(500)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    wi, wo = frame @ light, np.einsum("nij,nj->ni", frame, view)
    expected = 3.0 * brdf.eval(wi, wo) * np.maximum(wi[:, 2:], 0.0)
    assert (expected > 0.0).any(axis=1).sum() > 100
    np.testing.assert_allclose(found[:, :3], expected, rtol=2e-3, atol=2e-3)


def test_shaders_of_opengl_es_say_what_numpy_says() -> None:
    class OpenGlEs(materialx.OpenGl):
        generator = "GenGlsl.Essl"

    needs_opengl()
    brdf = material("ggx")
    exported = TARGETS["materialx"]().files(brdf, "gloss")
    directions = pairs(10_000)
    found = OpenGlEs().run(exported, "gloss", "eval", *directions)
    assert worst_error(found, reference(brdf, "eval", *directions)) <= 1.0


def needs_opengl() -> None:
    """Skip where no OpenGL runs."""
    needs(materialx.OpenGl().missing())
