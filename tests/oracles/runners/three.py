"""Modules for three.js as its pages run them, with either renderer."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW, Runner
from tests.oracles.runners import browser

PAGE = Path(__file__).parents[1] / "page"
INSTALLED = Path(sys.prefix) / "three" / "node_modules" / "three"  # by scripts/setup.py
_WIDTH = 1024
_COMPONENTS = {"eval": 3, "sample": 4, "pdf": 1}


def missing() -> str | None:
    """What pages with three.js need and this machine does not have."""
    return browser.missing() or (None if INSTALLED.is_dir() else "three.js (make tools, with npm)")


def page() -> dict[str, bytes | Path]:
    """Files of a page that imports `three` and `three/webgpu`."""
    shown = {name: (PAGE / name).read_bytes() for name in ("index.html", "scene.js")}
    return {"three": INSTALLED, **shown, **browser.scripts("shared.js", "three.js")}


class _ThreeRunner(Runner):
    """A page in which one of the two renderers draws a quad of values."""

    target = "three"
    materials = FEW
    renderer: ClassVar[str]

    def missing(self) -> str | None:
        return missing()

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        values = browser.floats(self._draw("run", files, function, a, b))
        values = values.reshape(-1, 4)[: len(a), : _COMPONENTS[function]]
        return values[:, 0] if function == "pdf" else values

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return self._draw("rate", files, "eval", a, b)

    def _draw(
        self, job: str, files: Mapping[str, bytes], function: str, a: Weights, b: Weights
    ) -> Any:
        (module,) = files.values()
        height = -(-len(a) // _WIDTH)
        size = {"width": _WIDTH, "height": height}
        argument = {"renderer": self.renderer, "call": function, "draws": 5, **size}
        data = {"first": _texels(a, height), "second": _texels(b, height)}
        return browser.compute({**page(), "material.js": module}, "three.js", job, argument, data)


class ThreeWebGl(_ThreeRunner):
    """three.js on WebGL2."""

    title = "three.js (WebGL2)"
    renderer = "webgl"


class ThreeWebGpu(_ThreeRunner):
    """three.js on WebGPU."""

    title = "three.js (WebGPU)"
    renderer = "webgpu"


def _texels(vectors: Weights, height: int) -> Weights:
    """The vectors as rows of a texture; behind the last one it is up."""
    texels = np.tile(np.float32([0, 0, 1, 0]), (height * _WIDTH, 1))
    texels[: len(vectors), :3] = vectors
    return texels
