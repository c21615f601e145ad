"""Runners of shaders, on functions written by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.geometry import rotate, split
from tests.measured.support import hemisphere
from tests.oracles import shaders
from tests.oracles.runners.opengl import OpenGlRunner
from tests.oracles.runners.vulkan import VulkanRunner
from tests.oracles.shaders import ShaderRunner
from tests.targets.support import needs

RUNNERS: dict[str, ShaderRunner] = {"glsl": OpenGlRunner(), "wgsl": VulkanRunner()}

GGX = {
    "glsl": """
vec3 by_hand_eval(vec3 wi, vec3 wo) {
    if (wi.z <= 0.0 || wo.z <= 0.0) return vec3(0.0);
    vec3 h = normalize(wi + wo);
    float a2 = 0.3 * 0.3;
    float slope = h.z * h.z * (a2 - 1.0) + 1.0;
    float d = a2 / (3.14159265 * slope * slope);
    float v = 0.5 / (wi.z * sqrt(wo.z * wo.z * (1.0 - a2) + a2)
                   + wo.z * sqrt(wi.z * wi.z * (1.0 - a2) + a2));
    vec3 f0 = vec3(0.9, 0.6, 0.3);
    vec3 f = f0 + (1.0 - f0) * pow(1.0 - dot(wi, h), 5.0);
    return vec3(0.1, 0.2, 0.3) / 3.14159265 + f * d * v;
}
float by_hand_pdf(vec3 wi, vec3 wo) { return wi.z / 3.14159265; }
vec4 by_hand_sample(vec3 wo, vec3 u) { return vec4(u.zyx, wo.z); }
""",
    "wgsl": """
fn by_hand_eval(wi: vec3f, wo: vec3f) -> vec3f {
    if (wi.z <= 0.0 || wo.z <= 0.0) { return vec3f(0.0); }
    let h = normalize(wi + wo);
    let a2 = 0.3 * 0.3;
    let slope = h.z * h.z * (a2 - 1.0) + 1.0;
    let d = a2 / (3.14159265 * slope * slope);
    let v = 0.5 / (wi.z * sqrt(wo.z * wo.z * (1.0 - a2) + a2)
                 + wo.z * sqrt(wi.z * wi.z * (1.0 - a2) + a2));
    let f0 = vec3f(0.9, 0.6, 0.3);
    let f = f0 + (1.0 - f0) * pow(1.0 - dot(wi, h), 5.0);
    return vec3f(0.1, 0.2, 0.3) / 3.14159265 + f * d * v;
}
fn by_hand_pdf(wi: vec3f, wo: vec3f) -> f32 { return wi.z / 3.14159265; }
fn by_hand_sample(wo: vec3f, u: vec3f) -> vec4f { return vec4f(u.zyx, wo.z); }
""",
}
"""Roughness 0.3, with the masking of Heitz 2014 in the form of Lagarde 2014."""


@pytest.fixture(params=RUNNERS)
def runner(request: pytest.FixtureRequest) -> ShaderRunner:
    found = RUNNERS[request.param]
    needs(found.missing())
    return found


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    wi, wo = hemisphere(random, count), hemisphere(random, count)
    wi[::7] *= -1.0
    return wi, wo


@pytest.mark.parametrize("count", [1, 1500, 100_001])
def test_a_shader_gives_the_numbers_of_the_formula(runner: ShaderRunner, count: int) -> None:
    wi, wo = pairs(count)
    files = {"by_hand": GGX[runner.target].encode()}
    ggx = Ggx(diffuse=(0.1, 0.2, 0.3), specular=(0.9, 0.6, 0.3), roughness=0.3)
    expected = ggx.eval(wi.astype(np.float64), wo.astype(np.float64))
    found = runner.run(files, "by_hand", "eval", wi, wo)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)
    found = runner.run(files, "by_hand", "pdf", wi, wo)
    np.testing.assert_allclose(found, wi[:, 2] / math.pi, rtol=1e-6)
    found = runner.run(files, "by_hand", "sample", wo, wi)
    np.testing.assert_array_equal(found, np.c_[wi[:, ::-1], wo[:, 2]])
    assert {found.dtype, wi.dtype} == {np.dtype(np.float32)}


def test_an_error_holds_the_log_of_the_compiler(runner: ShaderRunner) -> None:
    files = {"by_hand": GGX[runner.target].replace("normalize", "normalized").encode()}
    with pytest.raises(RuntimeError, match=r"normalized"):
        runner.run(files, "by_hand", "eval", *pairs(10))


def test_the_rate_counts_evaluations(runner: ShaderRunner, monkeypatch) -> None:
    """The shader that is timed sums the results of as many directions as are counted."""
    timed = []

    def best_rate(call, count):
        call()
        timed.append((call.__self__.read(), count))
        return 1.0

    monkeypatch.setattr(shaders, "best_rate", best_rate)
    wi, wo = pairs(100)
    assert runner.rate({"by_hand": GGX[runner.target].encode()}, "by_hand", wi, wo) == 1.0
    ((total, count),) = timed
    angle = math.atan2(0.6, 0.8) * np.arange(1, count // 100 + 1)
    turned = np.stack([np.stack(rotate(split(wi), x), axis=-1) for x in angle])
    expected = Ggx(diffuse=(0.1, 0.2, 0.3), specular=(0.9, 0.6, 0.3), roughness=0.3).eval(
        turned, wo.astype(np.float64)
    )
    np.testing.assert_allclose(total[:, :3], expected.sum(axis=0), rtol=1e-4)
