"""Files of BRDF Explorer are read, and compile in the versions of GLSL that it ever used."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic import AnisotropicGgx
from nacre.targets import TARGETS
from tests.measured.support import hemisphere
from tests.oracles.runners import opengl
from tests.oracles.runners.brdf_explorer import BrdfExplorerRunner, shader
from tests.targets.support import needs

MATERIAL = AnisotropicGgx(
    diffuse=(0.1, 0.2, 0.3),
    specular=(0.5, 0.4, 0.3),
    roughness_x=0.2,
    roughness_y=0.5,
    angle=0.4,
    name="brushed */ #define BRDF\n::end shader",
)

PHONG = """analytic

# As the files of BRDF Explorer are.
::begin parameters
float n 1 1000 20
color tint .8 .7 .1
bool squared 0
::end parameters

::begin shader

float power(float x, float n)
{
    #define nothing of this line is seen
    return pow(x, n);
}

vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y)
{
    return tint * power(max(0.0, dot(N, normalize(L + V))), squared ? 2.0 * n : n);
}
::end shader
"""


@pytest.fixture(autouse=True)
def _opengl() -> None:
    needs(opengl.missing())


def text() -> str:
    (content,) = TARGETS["brdf"]().files(MATERIAL, "brushed").values()
    return content.decode()


def directions(count: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    return hemisphere(random, count), hemisphere(random, count)


@pytest.mark.parametrize("version", ["130", "410"])
def test_the_material_is_seen_in_any_frame(version: str) -> None:
    wi, wo = directions(10_000)
    rotation, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    x, y, n = (f"vec3({', '.join(map(str, axis))})" for axis in rotation.T)
    light, view = ((w @ rotation.T).astype(np.float32) for w in (wi, wo))
    drawn = opengl.FragmentPass(
        version, shader(text()), f"vec4(BRDF(a, b, {n}, {x}, {y}), 0.0)", light, view
    )
    drawn.execute()
    expected = MATERIAL.eval(wi.astype(np.float64), wo.astype(np.float64))
    np.testing.assert_allclose(drawn.read()[:, :3], expected, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("version", ["130", "410"])
def test_vertex_shaders_of_plots_take_it_too(version: str) -> None:
    wi, wo = directions(1000)
    gl = opengl.context()
    program = gl.program(
        vertex_shader=f"""#version {version}
        in vec3 light, view;
        out vec3 color;
        {shader(text())}
        void main() {{
            color = BRDF(light, view, vec3(0, 0, 1), vec3(1, 0, 0), vec3(0, 1, 0));
            gl_Position = vec4(color, 1.0);
        }}""",
        varyings=["color"],
    )
    points = gl.vertex_array(program, gl.buffer(np.hstack([wi, wo]).tobytes()), "light", "view")
    colors = gl.buffer(reserve=12 * len(wi))
    points.transform(colors, vertices=len(wi))
    found = np.frombuffer(colors.read(), np.float32).reshape(-1, 3)
    expected = MATERIAL.eval(wi.astype(np.float64), wo.astype(np.float64))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


def test_no_line_of_the_shader_is_lost() -> None:
    body = text().split("::begin shader\n")[1].split("::end shader\n")[0]
    assert shader(text()).split() == body.split()


def test_a_file_as_people_write_them_is_read() -> None:
    body = shader(PHONG)
    assert "uniform float n;\nuniform vec3 tint;\nuniform bool squared;" in body
    assert "nothing of this line" not in body
    wi, wo = directions(100)
    runner = BrdfExplorerRunner()
    # Uniforms are 0 where nobody sets them.
    assert (runner.run({"phong.brdf": PHONG.encode()}, "phong", "eval", wi, wo) == 0.0).all()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("analytic", "synthetic", "no type of BRDF"),
        ("::end parameters", "", "in section parameters"),
        ("::end shader", "::end parameters", "in section 'shader'"),
        ("bool squared", "int squared", "no type of a parameter"),
        ("return tint", "return shade", "shade"),
    ],
)
def test_what_the_viewer_would_not_load_is_refused(old: str, new: str, words: str) -> None:
    content = PHONG.replace(old, new).encode()
    with pytest.raises(RuntimeError, match=words):
        BrdfExplorerRunner().run({"phong.brdf": content}, "phong", "eval", *directions(10))
