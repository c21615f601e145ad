"""WGSL in Chromium's WebGPU; see :mod:`tests.oracles.runners.browser`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nacre.array import Weights
from tests.oracles.runners import browser
from tests.oracles.texture_runner import FUNCTIONS, TextureRunner, call, source
from tests.oracles.texture_runners.vulkan import GROUP, MAIN, packed
from tests.oracles.texture_runners.webgl import halves, scripts
from tests.oracles.textures import Points


class WebGpu(TextureRunner):
    """WebGPU, on SwiftShader."""

    target = "wgsl"
    title = "Chromium (WebGPU)"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return browser.missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        values = browser.floats(_dispatch("run", files, name, function, points)).reshape(-1, 4)
        return values[:, : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return len(points.wi) / float(_dispatch("seconds", files, name, "eval", points))


def _dispatch(
    job: str, files: Mapping[str, bytes], name: str, function: str, points: Points
) -> Any:
    """What a job of `webgpu.js` returns."""
    data, shapes = halves(files)
    numbers = {"group": GROUP, "call": call(name, function, "vec4f")}
    task = {
        "code": source(files) + MAIN % numbers, "count": len(points.wi), "group": GROUP,
        "textures": shapes, "draws": 3,
    }  # fmt: skip
    data["points"] = packed(points)
    return browser.compute(scripts("webgpu.js"), "webgpu.js", job, task, data)
