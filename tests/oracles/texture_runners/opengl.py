"""GLSL 3.30 on fragment shaders of OpenGL; see :mod:`tests.oracles.runners.opengl`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import best_rate
from tests.oracles.runners.opengl import context, missing
from tests.oracles.texture_runner import FUNCTIONS, GLSL_MAIN, TextureRunner, arrays, call, source
from tests.oracles.textures import Points

_WIDTH = 512
_TRIANGLE = """#version 330 core
void main() {
    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
"""
_HEAD = """#version 330 core
uniform sampler2D points_a, points_b, points_c;
out vec4 result;
"""


class Draw:
    """A picture that a fragment shader draws; units of textures by the names of uniforms."""

    def __init__(self, fragment: str, size: tuple[int, int], textures: Mapping[str, Any]) -> None:
        gl = context()
        try:
            program = gl.program(vertex_shader=_TRIANGLE, fragment_shader=fragment)
        except Exception as error:  # moderngl's own kind
            raise RuntimeError(str(error)) from error
        self._textures = {key: of for key, of in textures.items() if key in program}
        for unit, key in enumerate(self._textures):
            program[key] = unit
        self._result = gl.texture(size, 4, dtype="f4")
        self._picture = gl.framebuffer([self._result])
        self._triangle = gl.vertex_array(program, [])

    def execute(self) -> None:
        """Draw it, and wait until it is there."""
        self._picture.use()
        for unit, texture in enumerate(self._textures.values()):
            texture.use(unit)
        self._triangle.render(vertices=3)
        context().finish()

    def read(self) -> Weights:
        """Pixels, shape (n, 4)."""
        return np.frombuffer(self._result.read(), np.float32).reshape(-1, 4)


def uploaded(files: Mapping[str, bytes]) -> dict[str, Any]:
    """Textures of the files of arrays, which repeat and are filtered linearly."""
    gl, found = context(), {}
    for name, pixels in arrays(files).items():
        *layers, height, width, channels = pixels.shape
        make = gl.texture_array if layers else gl.texture
        size = (width, height, *layers)
        found[name] = make(size, channels, pixels.tobytes(), dtype="f2", alignment=1)
        found[name].filter = gl.LINEAR, gl.LINEAR
    return found


class OpenGl(TextureRunner):
    """Desktop GLSL; Mesa's llvmpipe where there is no graphics card."""

    target = "glsl"
    title = "OpenGL 3.3"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        drawn = _draw(files, name, function, points)
        drawn.execute()
        return drawn.read()[: len(points.wi), : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return best_rate(_draw(files, name, "eval", points).execute, len(points.wi))


def _draw(files: Mapping[str, bytes], name: str, function: str, points: Points) -> Draw:
    height = -(-len(points.wi) // _WIDTH)
    inputs = {}
    for key, vectors in (("a", points.wi), ("b", points.wo), ("c", points.place)):
        pixels = np.resize(vectors, (height * _WIDTH, 3))
        size = _WIDTH, height
        inputs[f"points_{key}"] = context().texture(size, 3, pixels.tobytes(), dtype="f4")
    fragment = _HEAD + source(files) + GLSL_MAIN % call(name, function, "vec4")
    return Draw(fragment, (_WIDTH, height), inputs | uploaded(files))
