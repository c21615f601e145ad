"""WGSL as browsers run it: in WebGPU."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nacre.array import Weights
from tests.oracles.runner import Runner
from tests.oracles.runners import browser

_GROUP = 64
_SCRIPTS = browser.scripts("shared.js", "webgpu.js")
_MAIN = """
@group(0) @binding(0) var<storage, read> first: array<f32>;
@group(0) @binding(1) var<storage, read> second: array<f32>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;

@compute @workgroup_size(%(group)d)
fn main(@builtin(global_invocation_id) place: vec3u, @builtin(num_workgroups) groups: vec3u) {
  let i = place.x + place.y * groups.x * %(group)du;
  if (i >= %(count)du) { return; }
  let a = vec3f(first[3 * i], first[3 * i + 1], first[3 * i + 2]);
  let b = vec3f(second[3 * i], second[3 * i + 1], second[3 * i + 2]);
  let value = %(name)s_%(function)s(a, b);
  %(store)s
}
"""
_COMPONENTS = {"eval": 3, "sample": 4, "pdf": 1}


class WebGpu(Runner):
    """Chromium's WebGPU, on SwiftShader."""

    target = "wgsl"
    title = "Chromium (WebGPU)"

    def missing(self) -> str | None:
        return browser.missing()

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        values = browser.floats(_dispatch("run", files, name, function, a, b))
        return values if function == "pdf" else values.reshape(len(a), -1)

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return _dispatch("rate", files, name, "eval", a, b)


def _dispatch(
    job: str, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
) -> Any:
    """What a job of `webgpu.js` returns of a function of these pairs."""
    (source,) = (body.decode() for path, body in files.items() if path.endswith(".wgsl"))
    components = _COMPONENTS[function]
    stores = (f"results[{components} * i + {k}] = value[{k}];" for k in range(components))
    store = " ".join(stores) if components > 1 else "results[i] = value;"
    numbers = {"group": _GROUP, "count": len(a)}
    code = source + _MAIN % (numbers | {"name": name, "function": function, "store": store})
    argument = numbers | {"code": code, "components": components, "draws": 5}
    return browser.compute(_SCRIPTS, "webgpu.js", job, argument, {"first": a, "second": b})
