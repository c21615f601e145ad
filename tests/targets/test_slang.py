"""What slangc makes of exported modules. Metal and CUDA are compiled only."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.geometry import join, split
from nacre.neural import NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.targets import TARGETS, identifier
from tests.oracles.pairs import pairs
from tests.oracles.runners import slang
from tests.targets.support import needs
from tests.tiers import tiered

SIZES = 6, 9, 6, 3


@cache
def network() -> Brdf:
    random = np.random.default_rng(0)
    layers = [
        Layer(random.normal(size=(i, o)) / np.sqrt(i), 0.1 * random.normal(size=o))
        for i, o in itertools.pairwise(SIZES)
    ]
    return NeuralBrdf(layers, inputs="enhanced")


def module(name: str) -> Mapping[str, bytes]:
    return TARGETS["slang"]().files(network(), name)


@pytest.fixture
def slangc() -> None:
    if slang.slangc() is None:
        pytest.skip("slangc is not installed (pip install slangtorch)")


@pytest.fixture
def runner() -> None:
    needs(slang.Slang().missing())


@pytest.mark.parametrize(
    "target", tiered(["cuda", "glsl", "hlsl", "metal", "wgsl"], ["cuda", "metal"])
)
@pytest.mark.usefixtures("slangc")
def test_slangc_compiles_the_functions_without_loops_and_arrays(
    target: str, tmp_path: Path
) -> None:
    text = slang.shader("m", {"all": " + ".join(slang.VALUES.values())})
    made = slang.compiled(tmp_path, module("m"), text, target, "all").read_text()
    code = made[re.search(r"\bm_(eval|sample|pdf)", made).start() :]  # after the prelude of CUDA
    assert all(f"m_{function}" in code for function in slang.VALUES)
    assert not re.search(r"\b(for|while|loop)\b|\w\[\d+\w*\]", code)


@pytest.mark.parametrize("name", tiered(["float", "exp", "texture", "v6"], ["float"]))
@pytest.mark.usefixtures("slangc")
def test_names_of_the_language_are_names_of_materials(name: str, tmp_path: Path) -> None:
    assert identifier(name) == name
    text = slang.shader(name, {"eval": "float4(max(exp({name}_eval(a[0].xyz, b[0].xyz)), 0.0), 0)"})
    assert slang.compiled(tmp_path, module(name), text, "wgsl").stat().st_size


DERIVATIVES = """
float4 backward(float3 wi, float3 wo)
{
    var light = diffPair(wi);
    var view = diffPair(wo);
    bwd_diff(m_eval)(light, view, float3(1.0, 0.0, 0.0));
    return float4(light.d, 0.0);
}
"""


@pytest.mark.usefixtures("runner")
def test_derivatives_are_those_of_finite_differences() -> None:
    values = {
        "forward": "float4(fwd_diff(m_eval)(diffPair(a[id.x].xyz, float3(0.0, 0.0, 1.0)), "
        "diffPair(b[id.x].xyz, float3(0.0))).d, 0.0)",
        "backward": "backward(a[id.x].xyz, b[id.x].xyz)",
    }
    library = slang.built(module("m"), slang.shader("m", values) + DERIVATIVES)
    wi, wo = (w[1:4096:2] for w in pairs(10_000))  # not near the mirror direction, nor special
    inside = (wi[:, 2] > 0.1) & (wo[:, 2] > 0.1)
    wi, wo = wi[inside], wo[inside]
    forward, backward = (slang.Call(library, entry, wi, wo) for entry in values)
    forward()
    backward()
    steps = 1e-6 * np.eye(3)
    expected = np.stack([_slope(wi.astype(np.float64), wo, step) for step in steps], axis=1) / 2e-6
    close = {"rtol": 1e-3, "atol": 1e-3}
    np.testing.assert_allclose(forward.result[:, :3], expected[:, 2], **close)
    np.testing.assert_allclose(backward.result[:, :3], expected[..., 0], **close)


def _slope(wi: Floats, wo: Floats, step: Floats) -> Floats:
    """Difference of f_r between two steps either way, shape (n, 3)."""
    view = split(wo.astype(np.float64))
    high, low = (join(network().eval_components(split(wi + s), view)) for s in (step, -step))
    return np.maximum(high, 0.0) - np.maximum(low, 0.0)


INTERFACE = """
interface IBsdf
{
    float3 eval(float3 wi, float3 wo);
    float4 sample(float3 wo, float3 u);
    float pdf(float3 wi, float3 wo);
}
extension m_material : IBsdf {}
float4 contribution<B : IBsdf>(B bsdf, float3 wo, float3 u)
{
    let drawn = bsdf.sample(wo, u);
    return float4(bsdf.eval(drawn.xyz, wo), bsdf.pdf(drawn.xyz, wo));
}
"""


@pytest.mark.usefixtures("runner")
def test_the_struct_takes_on_an_interface() -> None:
    values = {"call": "contribution(m_material(), a[id.x].xyz, b[id.x].xyz)", **slang.VALUES}
    library = slang.built(module("m"), slang.shader("m", values) + INTERFACE)
    random = np.random.default_rng(0)
    wo, u = pairs(200)[1], random.random((200, 3), np.float32)
    call, sample = (slang.Call(library, entry, wo, u) for entry in ("call", "sample"))
    call()
    sample()
    wi, density = sample.result[:, :3], sample.result[:, 3]
    expected = network().eval(wi.astype(np.float64), wo.astype(np.float64))
    np.testing.assert_allclose(call.result[:, :3], expected, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(call.result[:, 3], density, rtol=1e-3, atol=1e-5)
