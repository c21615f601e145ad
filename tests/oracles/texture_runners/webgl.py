"""GLSL ES 3.00 in Chromium's WebGL2; see :mod:`tests.oracles.runners.browser`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runners import browser
from tests.oracles.texture_runner import FUNCTIONS, GLSL_MAIN, TextureRunner, arrays, call, source
from tests.oracles.textures import Points

_WIDTH = 512
_HEAD = """#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D points_a, points_b, points_c;
out vec4 result;
"""


def scripts(name: str) -> dict[str, bytes | Path]:
    """A script of this folder, and what scripts share."""
    return {
        **browser.scripts("shared.js", "gl.js"),
        name: (Path(__file__).parent / name).read_bytes(),
    }


def halves(files: Mapping[str, bytes]) -> tuple[dict[str, Weights], dict[str, dict[str, int]]]:
    """Pixels of arrays, two to a number of 32 bits, and their shapes."""
    data, shapes = {}, {}
    for name, pixels in arrays(files).items():
        *layers, height, width, channels = pixels.shape
        shapes[name] = {
            "width": width, "height": height, "layers": layers[0] if layers else 0,
            "channels": channels, "bits": 16,
        }  # fmt: skip
        flat = pixels.ravel()
        data[name] = np.append(flat, np.zeros(flat.size % 2, np.float16)).view(np.float32)
    return data, shapes


class WebGl(TextureRunner):
    """WebGL2, on SwiftShader."""

    target = "glsl"
    title = "Chromium (WebGL2)"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return browser.missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        values = browser.floats(_draw("run", files, name, function, points)).reshape(-1, 4)
        return values[: len(points.wi), : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return len(points.wi) / float(_draw("seconds", files, name, "eval", points))


def _draw(job: str, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Any:
    """What a job of `webgl.js` returns."""
    height = -(-len(points.wi) // _WIDTH)
    data, shapes = halves(files)
    for key, vectors in (("a", points.wi), ("b", points.wo), ("c", points.place)):
        pixels = np.zeros((height * _WIDTH, 4), np.float32)
        pixels[:, :3] = np.resize(vectors, (height * _WIDTH, 3))
        data[f"points_{key}"] = pixels
        shapes[f"points_{key}"] = {
            "width": _WIDTH, "height": height, "layers": 0, "channels": 4, "bits": 32,
        }  # fmt: skip
    task = {
        "fragment": _HEAD + source(files) + GLSL_MAIN % call(name, function, "vec4"),
        "width": _WIDTH, "height": height, "textures": shapes, "draws": 3,
    }  # fmt: skip
    return browser.compute(scripts("webgl.js"), "webgl.js", job, task, data)
