"""The Mitsuba plugins: values, densities, and the places where they are used."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
import nacre.mitsuba
from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.measuring.virtual import MitsubaBrdf
from nacre.mitsuba.network import first_in_buffer
from nacre.neural.nbrdf import NeuralBrdf
from nacre.neural.network import NetworkBrdf
from nacre.numerics.mlp import Layer
from tests.data import require_data
from tests.sampling.mixtures import MIXTURES
from tests.tiers import tiered
from tests.variants import by_precision

from .reflectances import (
    ENHANCED,
    NAMES,
    RECIPROCAL,
    TURNED,
    Constant,
    Tilted,
    interaction,
    network,
    reflectance,
    sphere_scene,
)
from .textures.made import FlatCodec, latent

Pairs = tuple[np.ndarray, np.ndarray]


@pytest.mark.parametrize("name", tiered(NAMES, NAMES[::3]))
def test01_eval_and_pdf_are_those_of_the_reflectance(
    rgb: Any, directions: Pairs, name: str
) -> None:
    brdf, (wi, wo) = reflectance(name), directions
    bsdf, context = nacre.mitsuba.bsdf(brdf), rgb.BSDFContext()
    si, light = interaction(rgb, wo), rgb.Vector3f(np.ascontiguousarray(wi.T))
    value, density = bsdf.eval_pdf(context, si, light)
    expected = brdf.eval(wi, wo) * np.maximum(wi[:, 2:], 0.0)
    np.testing.assert_allclose(np.array(value).T, expected, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(np.array(density), brdf.pdf(wi, wo), rtol=1e-3, atol=1e-5)
    np.testing.assert_array_equal(np.array(bsdf.eval(context, si, light)), np.array(value))
    np.testing.assert_array_equal(np.array(bsdf.pdf(context, si, light)), np.array(density))
    dark = (wi[:, 2] <= 0) | (wo[:, 2] <= 0)
    assert dark.any()
    assert not np.array(value).T[dark].any()
    assert not np.array(density)[dark].any()


@pytest.mark.parametrize("name", tiered(NAMES, NAMES[::3]))
def test02_weight_is_eval_over_pdf(rgb: Any, directions: Pairs, name: str) -> None:
    bsdf, context = nacre.mitsuba.bsdf(reflectance(name)), rgb.BSDFContext()
    si = interaction(rgb, directions[1])
    u = np.random.default_rng(0).random((3, len(directions[1]))).astype(np.float32)
    sample, weight = bsdf.sample(context, si, rgb.Float(u[0]), rgb.Point2f(u[1:]))
    value, density = bsdf.eval_pdf(context, si, sample.wo)
    pdf = np.array(sample.pdf)
    # A sharp lobe in float32 loses digits on the way from the half vector to wi and back.
    np.testing.assert_allclose(pdf, np.array(density), rtol=2e-3, atol=1e-6)
    np.testing.assert_allclose(np.array(weight) * pdf, np.array(value), rtol=1e-3, atol=1e-5)
    dark = (directions[1][:, 2] <= 0) | (np.array(sample.wo)[2] <= 0)
    assert not pdf[dark].any()
    assert not np.array(weight).T[dark].any()


def test06_white_furnace(rgb: Any) -> None:
    scene = rgb.load_dict(sphere_scene(rgb, nacre.mitsuba.bsdf(Constant(1.0)), size=8))
    image = np.array(rgb.render(scene, spp=4096, seed=3))
    np.testing.assert_allclose(image, 1.0, atol=0.03)
    np.testing.assert_allclose(image.mean(), 1.0, atol=2e-3)


def row(mi: Any, bsdfs: list[Any]) -> Any:
    """An image of spheres side by side, a block of 8 columns each."""
    look = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 8 * len(bsdfs), "height": 8, "rfilter": {"type": "box"}}
    half = len(bsdfs) - 1.0
    spheres = {
        f"sphere{i}": {"type": "sphere", "center": [2.0 * i - half, 0, 0], "bsdf": bsdf}
        for i, bsdf in enumerate(bsdfs)
    }
    scale = mi.ScalarTransform4f().scale([half + 1.0, half + 1.0, 1.0])
    sensor = {"type": "orthographic", "to_world": look @ scale, "film": film}
    integrator = {"type": "path", "max_depth": 3}
    sky = {"type": "constant"}
    scene = {"type": "scene", "integrator": integrator, "sensor": sensor, "sky": sky, **spheres}
    return np.array(mi.render(mi.load_dict(scene), spp=64, seed=5))


def test07_ten_materials_in_one_scene(rgb: Any) -> None:
    brdfs: list[Brdf] = [network(i) for i in range(7)]
    brdfs += [Constant(0.1 * i) for i in range(2, 5)]
    modes = ["cooperative" if i in (1, 4) else "literals" for i in range(10)]
    bsdfs = [nacre.mitsuba.bsdf(b, weights=m) for b, m in zip(brdfs, modes, strict=True)]
    together = row(rgb, bsdfs)
    blocks = together.reshape(8, 10, 8, 3).mean((0, 2))
    assert len(np.unique(blocks.round(3), axis=0)) == 10
    for index in (0, 4, 9):
        alone = row(rgb, [bsdfs[index]] * 10)
        columns = slice(8 * index + 2, 8 * index + 6)
        # Neighbors light each other at the rims only; the middle sees the sky.
        np.testing.assert_allclose(
            together[2:6, columns].mean(), alone[2:6, columns].mean(), rtol=0.02
        )


def test08_two_sides(rgb: Any) -> None:
    def seen_from(z: float, bsdf: Any) -> float:
        camera = rgb.ScalarTransform4f().look_at([0, 0, z], [0, 0, 0], [0, 1, 0])
        film = {"type": "hdrfilm", "width": 4, "height": 4}
        sensor = {"type": "perspective", "fov": 10, "to_world": camera, "film": film}
        shape = {"type": "rectangle", "bsdf": bsdf}
        scene = {"type": "scene", "integrator": {"type": "path"}, "sensor": sensor, "s": shape}
        scene["sky"] = {"type": "constant"}
        return float(np.array(rgb.render(rgb.load_dict(scene), spp=512)).mean())

    bsdf = nacre.mitsuba.bsdf(network(1))
    assert seen_from(-3.0, bsdf) == 0.0
    both = {"type": "twosided", "bsdf": bsdf}
    assert seen_from(3.0, bsdf) > 0.1
    assert seen_from(-3.0, both) == pytest.approx(seen_from(3.0, bsdf), rel=0.02)


def test09_blend_is_the_mean(rgb: Any, directions: Pairs) -> None:
    first, second = nacre.mitsuba.bsdf(network(1)), nacre.mitsuba.bsdf(Constant(0.4))
    blend = rgb.load_dict({"type": "blendbsdf", "weight": 0.5, "a": first, "b": second})
    si = interaction(rgb, directions[1])
    light = rgb.Vector3f(np.ascontiguousarray(directions[0].T))
    parts = [b.eval_pdf(rgb.BSDFContext(), si, light) for b in (first, second, blend)]
    for one, two, mean in zip(*parts, strict=True):
        expected = 0.5 * (np.array(one) + np.array(two))
        np.testing.assert_allclose(np.array(mean), expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("plugin", ["nbrdf", "brdf"])
def test10_scenes_in_xml_find_files_beside_them(rgb: Any, tmp_path: Path, plugin: str) -> None:
    brdf = network(4)
    nacre.save(brdf, tmp_path / "material.safetensors")
    (tmp_path / "scene.xml").write_text(
        f"""<scene version="3.0.0">
        <integrator type="path"/>
        <shape type="sphere">
            <bsdf type="{plugin}"><string name="filename" value="material.safetensors"/></bsdf>
        </shape></scene>"""
    )
    scene = rgb.load_file(str(tmp_path / "scene.xml"))
    loaded = scene.shapes()[0].bsdf()
    assert type(brdf).__name__ in str(loaded)
    wi, wo = np.array([[0.6, 0.0, 0.8]], np.float32), np.array([[0.0, 0.6, 0.8]], np.float32)
    si, light = interaction(rgb, wo), rgb.Vector3f(*wi[0].tolist())
    found = np.array(loaded.eval(rgb.BSDFContext(), si, light)).T
    np.testing.assert_allclose(found, 0.8 * brdf.eval(wi, wo), rtol=1e-4)


@pytest.mark.parametrize("integrator", tiered(["path", "prb"], ["prb"]))
def test11_gradients_are_finite_differences(rgb: Any, integrator: str) -> None:
    import drjit as dr

    bsdf = nacre.mitsuba.bsdf(network(1), weights="cooperative")
    scene = rgb.load_dict(
        sphere_scene(rgb, bsdf, size=8, integrator={"type": integrator, "max_depth": 3})
    )
    params = rgb.traverse(scene)
    (key,) = (key for key in params.keys() if key.endswith("weights"))  # noqa: SIM118
    start = np.array(params[key])

    def loss(values: Any) -> Any:
        params[key] = rgb.Float(values)
        params.update()
        image = rgb.render(scene, params, spp=16, seed=2)
        return dr.mean(image * image, axis=None)

    values = rgb.Float(start)
    dr.enable_grad(values)
    dr.backward(loss(values))
    gradient = np.array(dr.grad(values))
    assert np.isfinite(gradient).all()
    step = 5e-3
    largest = np.argsort(-np.abs(gradient))[[0, 5, 20, 60]]
    for index in largest:
        shift = step * (np.arange(len(start)) == index)
        high, low = (np.array(loss(start + s)).item() for s in (shift, -shift))
        assert gradient[index] == pytest.approx(
            (high - low) / (2 * step), rel=by_precision(0.03, 0.1)
        )


@pytest.mark.parametrize("name", RECIPROCAL)
@pytest.mark.parametrize("weights", ["literals", "cooperative"])
def test_physical_networks_are_reciprocal_within_rounding(
    rgb: Any, directions: Pairs, name: str, weights: str
) -> None:
    wi, wo = directions
    bsdf = nacre.mitsuba.bsdf(reflectance(name), weights=weights)
    there, back = (
        np.array(
            bsdf.eval(
                rgb.BSDFContext(), interaction(rgb, b), rgb.Vector3f(np.ascontiguousarray(a.T))
            )
        ).T
        / a[:, 2:]
        for a, b in ((wi, wo), (wo, wi))
    )
    above = (wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3)
    assert above.sum() > 100
    np.testing.assert_allclose(there[above], back[above], rtol=2e-6)


@pytest.mark.parametrize("options", [{}, ENHANCED, TURNED, {"inputs": "reciprocal"}])
@pytest.mark.parametrize(
    ("precision", "tolerance"), [("single", by_precision(1e-4)), ("half", 2e-2)]
)
def test12_cooperative_weights_change_without_recompiling(
    rgb: Any, directions: Pairs, precision: str, tolerance: float, options: Any
) -> None:
    wi, wo = directions
    si, light = interaction(rgb, wo), rgb.Vector3f(np.ascontiguousarray(wi.T))
    first, second = (network(seed, **options) for seed in (1, 2))
    bsdf = nacre.mitsuba.bsdf(first, weights="cooperative", precision=precision)
    other = nacre.mitsuba.bsdf(second, weights="cooperative", precision=precision)
    params = rgb.traverse(bsdf)
    params["weights"] = rgb.traverse(other)["weights"]
    params.update()
    for brdf in (second, bsdf.material()):
        found = np.array(bsdf.eval(rgb.BSDFContext(), si, light)).T
        expected = brdf.eval(wi, wo) * np.maximum(wi[:, 2:], 0)
        np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance)
    for found_layer, layer in zip(bsdf.material().layers, second.layers, strict=True):
        np.testing.assert_allclose(found_layer.weights, layer.weights, atol=tolerance)
        np.testing.assert_allclose(found_layer.biases, layer.biases, atol=tolerance)


def test26_large_networks_and_codes_share_kernels(rgb: Any) -> None:
    import drjit as dr

    class Family(NetworkBrdf):
        """A network with the first layer of another."""

        inputs = "paper"

        def __init__(self, base: NeuralBrdf, own: NeuralBrdf) -> None:
            super().__init__(sampler=own.sampler)
            self.layers = [base.layers[0], *own.layers[1:]]
            self.shared_layers = 1

        def from_outputs(self, values: Any) -> Any:
            return tuple(0.1 * v * v for v in values)

    up, wi = np.array([[0.0, 0.0, 1.0]], np.float32), rgb.Vector3f(0.6, 0.0, 0.8)
    si, base = interaction(rgb, up), network(1)
    samplers = [MIXTURES["two lobes"]] * 2
    hits = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for seed, sampler in zip((2, 3), samplers, strict=True):
            brdf = Family(base, network(seed).replaced(sampler=sampler))
            bsdf = nacre.mitsuba.bsdf(brdf)
            dr.kernel_history_clear()
            value, density = bsdf.eval_pdf(rgb.BSDFContext(), si, wi)
            dr.eval(value, density)
            hits.append([k["hash"] for k in dr.kernel_history([dr.KernelType.JIT])])
            expected = 0.8 * brdf.eval(np.array([0.6, 0.0, 0.8]), up)
            np.testing.assert_allclose(np.array(value).T, expected, rtol=by_precision(1e-4))
            np.testing.assert_allclose(
                np.array(density), brdf.pdf(np.array([0.6, 0.0, 0.8]), up), rtol=1e-3
            )
    assert hits[0] == hits[1]


@pytest.mark.parametrize(("width", "start"), [(21, 3), (64, 3), (200, 0)])
def test27_weights_are_literals_up_to_a_number(width: int, start: int) -> None:
    random = np.random.default_rng(0)
    sizes = (6, width, width, 3)
    layers = [
        Layer(random.normal(size=pair).astype(np.float32), np.zeros(pair[1], np.float32))
        for pair in itertools.pairwise(sizes)
    ]
    brdf = NeuralBrdf(layers)
    assert first_in_buffer(brdf, "auto") == start
    assert first_in_buffer(brdf, "literals") == 3
    assert first_in_buffer(brdf, "cooperative") == 0


def test28_a_material_of_mitsuba_is_rendered_as_itself(rgb: Any) -> None:
    brdf = MitsubaBrdf({"type": "roughplastic"})
    assert not brdf.traceable
    assert nacre.mitsuba.bsdf(brdf) is brdf.bsdf


def test29_what_cannot_be_sampled_is_refused(rgb: Any) -> None:
    with pytest.raises(nacre.NacreError, match="constant: has no sampler"):
        nacre.mitsuba.bsdf(Constant(0.5).replaced(sampler=None))


def test13_scalar(scalar: Any) -> None:
    brdf, wi, wo = network(1), np.array([[0.6, 0.0, 0.8]]), np.array([[0.0, -0.6, 0.8]])
    bsdf, context = nacre.mitsuba.bsdf(brdf), scalar.BSDFContext()
    si = scalar.SurfaceInteraction3f()
    si.wi = scalar.Vector3f(wo[0].tolist())
    value, density = bsdf.eval_pdf(context, si, scalar.Vector3f(wi[0].tolist()))
    np.testing.assert_allclose(np.array(value), 0.8 * brdf.eval(wi, wo)[0], rtol=1e-5)
    assert density == pytest.approx(float(brdf.pdf(wi, wo)[0]), rel=1e-5)
    assert bsdf.pdf(context, si, scalar.Vector3f(0.0, 0.0, -1.0)) == 0.0
    scene = scalar.load_dict(sphere_scene(scalar, bsdf, size=4))
    image = np.array(scalar.render(scene, spp=4))
    assert np.isfinite(image).all()
    assert image.min() > 0.0
    with pytest.raises(nacre.NacreError, match="JIT variant"):
        nacre.mitsuba.bsdf(brdf, weights="cooperative")


def test14_mono_is_luminance(mono: Any) -> None:
    wi, wo = np.array([[0.6, 0.0, 0.8]], np.float32), np.array([[0.0, 0.0, 1.0]], np.float32)
    brdf = network(1)
    si, light = interaction(mono, wo), mono.Vector3f(*wi[0].tolist())
    found = np.array(nacre.mitsuba.bsdf(brdf).eval(mono.BSDFContext(), si, light)).item()
    assert found == pytest.approx(0.8 * luminance(tuple(brdf.eval(wi, wo)[0])), rel=1e-4)


def test15_polarized_is_depolarizing(polarized: Any) -> None:
    mi, wo = polarized, np.array([[0.0, 0.0, 1.0]], np.float32)
    si, light = interaction(mi, wo), mi.Vector3f(0.6, 0.0, 0.8)
    value = nacre.mitsuba.bsdf(Constant(0.5)).eval(mi.BSDFContext(), si, light)
    found = np.array(value).reshape(4, 4)
    expected = np.zeros((4, 4))
    expected[0, 0] = 0.5 / np.pi * 0.8
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test16_only_asked_components(rgb: Any) -> None:
    bsdf = nacre.mitsuba.bsdf(Constant(0.5))
    si = interaction(rgb, np.array([[0.0, 0.0, 1.0]], np.float32))
    assert bsdf.component_count() == 1
    assert rgb.has_flag(bsdf.flags(), rgb.BSDFFlags.GlossyReflection)
    assert not rgb.has_flag(bsdf.flags(), rgb.BSDFFlags.Anisotropic)
    anisotropic = nacre.mitsuba.bsdf(network(1, isotropic=False))
    assert rgb.has_flag(anisotropic.flags(), rgb.BSDFFlags.Anisotropic)
    up = rgb.Vector3f(0.0, 0.0, 1.0)
    other, diffuse = rgb.BSDFContext(), rgb.BSDFContext()
    other.component = 1
    diffuse.type_mask = rgb.BSDFFlags.DiffuseReflection
    for context in (other, diffuse):
        assert not np.array(bsdf.eval(context, si, up)).any()
        assert not np.array(bsdf.pdf(context, si, up)).any()
        sample, weight = bsdf.sample(context, si, 0.5, rgb.Point2f(0.5, 0.5))
        assert not np.array(weight).any()
        assert not np.array(sample.pdf).any()


def test17_inactive_lanes_are_dark(rgb: Any) -> None:
    bsdf = nacre.mitsuba.bsdf(Constant(0.5))
    si = interaction(rgb, np.tile(np.float32([0, 0, 1]), (2, 1)))
    active = rgb.Bool([True, False])
    context, up = rgb.BSDFContext(), rgb.Vector3f(0.0, 0.0, 1.0)
    value, density = bsdf.eval_pdf(context, si, up, active)
    sample, weight = bsdf.sample(context, si, 0.5, rgb.Point2f(0.5, 0.5), active)
    for found in (density, sample.pdf, value.x, weight.x):
        assert (np.array(found) > 0).tolist() == [True, False]


def test18_following_light_swaps_the_directions(rgb: Any) -> None:
    brdf = Tilted(0.5)
    a, b = np.array([[0.6, 0.0, 0.8]], np.float32), np.array([[0.0, 0.0, 1.0]], np.float32)
    bsdf, si, light = nacre.mitsuba.bsdf(brdf), interaction(rgb, a), rgb.Vector3f(0.0, 0.0, 1.0)
    sight, follow = rgb.BSDFContext(), rgb.BSDFContext(rgb.TransportMode.Importance)
    for context, expected in ((sight, brdf.eval(b, a)), (follow, brdf.eval(a, b))):
        found = np.array(bsdf.eval(context, si, light)).T
        np.testing.assert_allclose(found, expected, rtol=1e-5)


@pytest.mark.parametrize("mode", ["literals", "cooperative"])
def test19_albedo_for_denoisers(rgb: Any, mode: str) -> None:
    aov = {"type": "aov", "aovs": "albedo:albedo", "img": {"type": "path"}}
    brdf = Constant(0.2, 0.5, 0.8) if mode == "literals" else network(1)
    bsdf = nacre.mitsuba.bsdf(brdf, weights=mode)
    scene = rgb.load_dict(sphere_scene(rgb, bsdf, size=4, integrator=aov))
    image = np.array(rgb.render(scene, spp=4))
    expected = nacre.mitsuba.adapter.albedo(brdf)
    np.testing.assert_allclose(
        image[1:3, 1:3, -3:], np.broadcast_to(expected, (2, 2, 3)), rtol=0.01
    )
    np.testing.assert_allclose(nacre.mitsuba.adapter.albedo(Constant(0.7)), 0.7, rtol=1e-4)


def test20_what_cannot_be_is_refused(rgb: Any, tmp_path: Path) -> None:
    with pytest.raises(nacre.NacreError, match="for networks, not Constant"):
        nacre.mitsuba.bsdf(Constant(0.5), weights="cooperative")
    with pytest.raises(nacre.NacreError, match="auto, literals, cooperative; got 'textures'"):
        nacre.mitsuba.bsdf(network(1), weights="textures")
    with pytest.raises(nacre.NacreError, match="cooperative weights"):
        nacre.mitsuba.bsdf(network(1), precision="half")
    with pytest.raises(RuntimeError, match="'filename'"):
        rgb.load_dict({"type": "brdf"})
    with pytest.raises(RuntimeError, match=r"absent\.safetensors: no such file"):
        rgb.load_dict({"type": "nbrdf", "filename": str(tmp_path / "absent.safetensors")})
    table = require_data("rgl", "paper_white_rgb.bsdf")
    with pytest.raises(RuntimeError, match="use the plugin brdf"):
        rgb.load_dict({"type": "nbrdf", "filename": str(table)})


def test25_what_was_refused_is_not_rendered_with(rgb: Any) -> None:
    with pytest.raises(nacre.NacreError) as first:
        nacre.mitsuba.bsdf(network(1), weights="textures")
    codes = latent(np.ones((2, 2, 3)), FlatCodec())
    with pytest.raises(nacre.NacreError) as second:
        nacre.mitsuba.bsdf(codes, resolution=40, memory=8)
    assert first.tb is not None
    assert second.tb is not None  # both keep what was begun, as notebooks do
    image = np.array(rgb.render(rgb.load_dict(sphere_scene(rgb, {"type": "diffuse"})), spp=1))
    assert image.max() > 0.1


def test21_registers_once_for_every_variant(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    nacre.save(network(1), tmp_path / "a.safetensors")
    code = """
import sys, nacre.mitsuba
assert not {"mitsuba", "drjit"} & set(sys.modules)
nacre.mitsuba.register()
import mitsuba as mi
assert mi.variant() is None
for variant in ("scalar_rgb", "llvm_ad_rgb", "scalar_rgb", "llvm_ad_rgb"):
    mi.set_variant(variant)
    nacre.mitsuba.register()
    for plugin in ("nbrdf", "brdf"):
        mi.load_dict({"type": plugin, "filename": "a.safetensors"})
assert nacre.mitsuba.mitsuba("scalar_rgb").variant() == "llvm_ad_rgb"
assert "scipy" not in sys.modules
"""
    if nacre.mitsuba.llvm.prepare() is None:
        pytest.skip("needs an LLVM that Dr.Jit can use")
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONWARNINGS": "error"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
