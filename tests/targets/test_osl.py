"""OSL: its functions as C++ reads them, and its shader where there is a Blender."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from nacre.color import tone_map
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere, smooth_edges
from nacre.targets import TARGETS
from tests.oracles import blender
from tests.oracles.materials import material
from tests.oracles.pairs import numbers, pairs
from tests.oracles.runner import reference, worst_error
from tests.targets.support import needs

_OSL = """
#include <cmath>
#include <cstdio>
using std::abs, std::atan2, std::cos, std::exp, std::floor, std::log, std::sin, std::sqrt;
float min(float a, float b) { return a < b ? a : b; }
float max(float a, float b) { return a > b ? a : b; }
struct vector {
    float c[3];
    vector(float x = 0) : c{x, x, x} {}
    vector(float x, float y, float z) : c{x, y, z} {}
    float operator[](int k) const { return c[k]; }
    vector operator-(vector b) const { return {c[0] - b[0], c[1] - b[1], c[2] - b[2]}; }
};
using color = vector;
vector operator*(float s, vector a) { return {s * a[0], s * a[1], s * a[2]}; }
float dot(vector a, vector b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
vector cross(vector a, vector b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
vector normalize(vector a) { return 1 / sqrt(dot(a, a)) * a; }
"""
"""What the functions use of OSL."""

_MAIN = """
int main() {
    for (float p[9]; fread(p, sizeof p, 1, stdin);) {
        vector a(p[0], p[1], p[2]), b(p[3], p[4], p[5]), u(p[6], p[7], p[8]), wi;
        float pdf;
        vector f = gloss_eval(a, b);
        gloss_sample(b, u, wi, pdf);
        float out[8] = {f[0], f[1], f[2], gloss_pdf(a, b), wi[0], wi[1], wi[2], pdf};
        fwrite(out, sizeof out, 1, stdout);
    }
}
"""


@pytest.mark.parametrize("name", ["glossy", "ggx"])
def test_functions_compute_what_the_material_does(name: str, tmp_path: Path) -> None:
    """Their statements are also statements of C++."""
    if not shutil.which("g++"):
        pytest.skip("g++ is not installed")
    brdf = material(name)
    source = TARGETS["osl"]().files(brdf, "gloss")["gloss.osl"].decode()
    functions = re.sub(r"output (\w+) (\w+)", r"\1 &\2", source.partition("shader gloss_lit")[0])
    (tmp_path / "gloss.cpp").write_text(_OSL + functions + _MAIN)
    program = tmp_path / "gloss"
    options = "-std=c++17", "-fsingle-precision-constant", "-O1"
    subprocess.run(["g++", *options, "-o", program, f"{program}.cpp"], check=True)
    wi, wo = pairs(10_000)
    u = numbers(10_000)
    given = np.concatenate([wi, wo, u], axis=1).tobytes()
    done = subprocess.run([program], input=given, capture_output=True, check=True)
    found = np.frombuffer(done.stdout, np.float32).reshape(-1, 8)
    assert worst_error(found[:, :3], reference(brdf, "eval", wi, wo)) <= 1.0
    assert worst_error(found[:, 3], reference(brdf, "pdf", wi, wo)) <= 1.0
    directions, density = brdf.sample(wo, u)
    np.testing.assert_allclose(found[:, 4:7], directions, atol=1e-3)
    np.testing.assert_allclose(found[:, 7], density, rtol=1e-2, atol=1e-3)


def test_the_shader_lights_a_sphere_as_numpy_does() -> None:
    needs(blender.missing())
    brdf, light, size = material("anisotropic"), DirectionalLight(), 64
    image, _ = render_sphere(brdf, light, size)
    expected, _ = smooth_edges(image, brdf, light)
    exported = TARGETS["osl"]().files(brdf, "gloss")
    found = blender.sphere(exported["gloss.osl"].decode(), size, 64)
    assert found.shape == expected.shape
    error = np.abs(tone_map(found) - tone_map(expected))
    assert error.mean() < 1e-3
