"""GLSL as fragment shaders of OpenGL: on Mesa's llvmpipe where there is no graphics card."""

from __future__ import annotations

import functools
import importlib
import importlib.util
from contextlib import suppress
from typing import Any, ClassVar

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW
from tests.oracles.shaders import Pass, ShaderRunner

_WIDTH = 1024  # pairs are the pixels of a picture of this width

_TRIANGLE = """
void main() {
    vec2 corner = vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1);
    gl_Position = vec4(corner, 0.0, 1.0);
}
"""
"""A vertex shader that covers the picture with one triangle."""

_PAIRS = """
uniform sampler2D pairs_a;
uniform sampler2D pairs_b;
out vec4 result;
"""

_MAIN = """
void main() {{
    vec3 a = texelFetch(pairs_a, ivec2(gl_FragCoord.xy), 0).xyz;
    vec3 b = texelFetch(pairs_b, ivec2(gl_FragCoord.xy), 0).xyz;
    result = {call};
}}
"""

_LOOP = """
vec4 repeated(vec3 a, vec3 b) {{
    vec3 total = vec3(0.0);
    for (int i = 0; i < {count}; i++) {{
        a = vec3(0.8 * a.x - 0.6 * a.y, 0.6 * a.x + 0.8 * a.y, a.z);
        total += {call};
    }}
    return vec4(total, 0.0);
}}
"""


def missing() -> str | None:
    """What has to be installed before fragment shaders run; None where nothing is."""
    if importlib.util.find_spec("moderngl") is None:
        return "moderngl"
    try:
        context()
    except Exception as error:  # the library of the system that is missing shows in many ways
        return f"OpenGL 4.1 with EGL (Debian: libegl1, libgl1; {error})"
    return None


@functools.cache
def context() -> Any:
    """The one context of this process, of OpenGL 4.1 or newer."""
    import moderngl

    with suppress(ImportError):  # of PyTorch for CUDA: loaded after Mesa's libLLVM, it crashes
        importlib.import_module("triton")
    found = moderngl.create_context(standalone=True, backend="egl", require=410)
    found.gc_mode = "auto"  # what Python drops is deleted
    return found


class FragmentPass(Pass):
    """A fragment shader that computes `call` of the vectors `a` and `b` of each pixel.

    RuntimeError says what does not compile.
    """

    def __init__(self, version: str, source: str, call: str, a: Weights, b: Weights) -> None:
        gl, self._count = context(), len(a)
        size = _WIDTH, -(-len(a) // _WIDTH)
        fragment = f"#version {version}\n" + _PAIRS + source + _MAIN.format(call=call)
        try:
            program = gl.program(
                vertex_shader=f"#version {version}\n" + _TRIANGLE, fragment_shader=fragment
            )
        except Exception as error:  # moderngl's own kind
            raise RuntimeError(str(error)) from error
        self._inputs = []
        for unit, (name, vectors) in enumerate((("pairs_a", a), ("pairs_b", b))):
            pixels = np.resize(vectors.astype(np.float32), (size[0] * size[1], 3))
            self._inputs.append(gl.texture(size, 3, pixels.tobytes(), dtype="f4"))
            if name in program:  # a shader may ignore a vector
                program[name] = unit
        self._result = gl.texture(size, 4, dtype="f4")
        self._picture = gl.framebuffer([self._result])
        self._triangle = gl.vertex_array(program, [])

    def execute(self) -> None:
        self._picture.use()
        for unit, texture in enumerate(self._inputs):
            texture.use(unit)
        self._triangle.render(vertices=3)
        context().finish()

    def read(self) -> Weights:
        return np.frombuffer(self._result.read(), np.float32).reshape(-1, 4)[: self._count]


class OpenGlRunner(ShaderRunner):
    """GLSL 3.30 core."""

    target = "glsl"
    title = "OpenGL 3.3"
    materials = FEW
    version: ClassVar[str] = "330 core"
    vector, loop = "vec4", _LOOP

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        return missing()

    def compiled(self, source: str, call: str, a: Weights, b: Weights) -> Pass:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        return FragmentPass(self.version, source, call, a, b)
