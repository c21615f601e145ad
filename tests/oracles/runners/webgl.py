"""GLSL as browsers run it: ES 3.00 in WebGL2."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import Runner
from tests.oracles.runners import browser

_WIDTH = 1024
_SCRIPTS = browser.scripts("shared.js", "gl.js", "webgl.js")
_HEAD = """#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
"""
_PAIRS = """
uniform sampler2D first, second;
out vec4 result;

void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 a = texelFetch(first, texel, 0).xyz, b = texelFetch(second, texel, 0).xyz;
  result = %s;
}
"""
_FRAME = """
out vec4 color;

void main() {
  vec3 point = vec3(gl_FragCoord.xy / 256.0 - 1.0, 0.0);
  vec3 wi = normalize(vec3(1.0, 1.0, 2.0) - point), wo = normalize(vec3(0.0, 0.0, 2.0) - point);
  color = vec4(pow(%s_eval(wi, wo) * wi.z * 3.0, vec3(1.0 / 2.2)), 1.0);
}
"""
_RESULTS = {
    "eval": ("vec4({}_eval(a, b), 0.0)", 3),
    "sample": ("{}_sample(a, b)", 4),
    "pdf": ("vec4({}_pdf(a, b), vec3(0.0))", 1),
}
"""What a texel of the result is, and how many of its components count."""
_COARSE = re.compile(r"\b(mediump|lowp)\s+(float|u?int|[iu]?vec\d|mat\d|\w*sampler\w+)\b")


class WebGl(Runner):
    """Chromium's WebGL2, on SwiftShader."""

    target = "glsl"
    title = "Chromium (WebGL2)"

    def missing(self) -> str | None:
        return browser.missing()

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        components = _RESULTS[function][1]
        values = browser.floats(_draw("run", files, name, function, a, b))
        values = values.reshape(-1, 4)[: len(a), :components]
        return values[:, 0] if function == "pdf" else values

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return _draw("rate", files, name, "eval", a, b)

    def frame(self, files: Mapping[str, bytes], name: str) -> float:
        """Seconds that 512 x 512 pixels of a plane take, under one light."""
        fragment = _HEAD + _source(files) + _FRAME % name
        argument = {"fragment": fragment, "draws": 15}
        return browser.compute(_SCRIPTS, "webgl.js", "frame", argument, {})


def _draw(
    job: str, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
) -> Any:
    """What a job of `webgl.js` returns of a function of these pairs."""
    height = -(-len(a) // _WIDTH)
    fragment = _HEAD + _source(files) + _PAIRS % _RESULTS[function][0].format(name)
    data = {"first": _texels(a, height), "second": _texels(b, height)}
    argument = {"fragment": fragment, "width": _WIDTH, "height": height, "draws": 5}
    return browser.compute(_SCRIPTS, "webgl.js", job, argument, data)


def _texels(vectors: Weights, height: int) -> Weights:
    """The vectors as rows of a texture; behind the last one it is up."""
    texels = np.tile(np.float32([0, 0, 1]), (height * _WIDTH, 1))
    texels[: len(vectors)] = vectors
    return texels


def _source(files: Mapping[str, bytes]) -> str:
    """The functions; refused where they ask for less than 32 bits a number."""
    (source,) = (body.decode() for path, body in files.items() if path.endswith(".glsl"))
    if found := _COARSE.search(source):
        raise RuntimeError(f"the exported GLSL asks for {found[1]}, which is too coarse")
    return source
