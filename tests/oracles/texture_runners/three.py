"""Modules for three.js, of textures, as its pages run them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats, Weights
from tests.oracles.runners import browser
from tests.oracles.runners.three import missing, page
from tests.oracles.texture_runner import FUNCTIONS, TextureRunner, call
from tests.oracles.textures import Points

_WIDTH = 512


class ThreeWebGl(TextureRunner):
    """Functions in a shader of three.js, on arrays that the module loads."""

    target = "three"
    title = "three.js (WebGL2)"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        values = browser.floats(_quad("run", files, name, function, points)).reshape(-1, 4)
        return values[: len(points.wi), : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return len(points.wi) / float(_quad("seconds", files, name, "eval", points))


def plane(
    files: Mapping[str, bytes], name: str, renderer: str, size: tuple[int, int], **options: Any
) -> Floats:
    """A plane that wears the material of a module and fills a picture, from above: linear values,
    shape (height, width, 4).

    Parameters
    ----------
    renderer
        "webgl", "webgpu", or "fallback", which is the renderer of WebGPU on WebGL2.
    size
        Of the picture, width first.
    options
        `repeat`, of the texture; `light`, the direction to a light of irradiance 1, or none;
        `environment`, radiance of the surroundings, or none; `samples` of them.
    """
    found = browser.floats(_plane("picture", files, name, renderer, size, options))
    return found.reshape(size[1], size[0], 4)


def frame(
    files: Mapping[str, bytes], name: str, renderer: str, size: tuple[int, int], **options: Any
) -> float:
    """Seconds that such a picture takes."""
    return float(_plane("frame", files, name, renderer, size, options))


def _plane(
    job: str,
    files: Mapping[str, bytes],
    name: str,
    renderer: str,
    size: tuple[int, int],
    options: Mapping[str, Any],
) -> Any:
    width, height = size
    task = {
        "module": f"/{name}.js", "renderer": renderer, "width": width, "height": height,
        "draws": 3, **options,
    }  # fmt: skip
    return browser.compute(_page(files), "run-texture.js", job, task)


def _page(files: Mapping[str, bytes]) -> dict[str, bytes | Path]:
    script = Path(__file__).with_name("three.js").read_bytes()
    return {**page(), **files, "run-texture.js": script}


def _quad(job: str, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Any:
    """What a job of `three.js` returns of a function of points."""
    height = -(-len(points.wi) // _WIDTH)
    data = {}
    for key, vectors in (("a", points.wi), ("b", points.wo), ("c", points.place)):
        data[f"points_{key}"] = np.zeros((height * _WIDTH, 4), np.float32)
        data[f"points_{key}"][:, :3] = np.resize(vectors, (height * _WIDTH, 3))
    task = {
        "module": f"/{name}.js", "call": call(f"{name}_at", function, "vec4"),
        "width": _WIDTH, "height": height, "draws": 3,
    }  # fmt: skip
    return browser.compute(_page(files), "run-texture.js", job, task, data)
