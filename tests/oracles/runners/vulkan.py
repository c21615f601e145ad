"""WGSL as compute shaders of Vulkan: on Mesa's lavapipe where there is no graphics card."""

from __future__ import annotations

import functools
import importlib.util
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import FEW
from tests.oracles.shaders import Pass, ShaderRunner

GROUP = 64  # pairs a workgroup
MAX_GROUPS = 65535  # along a dimension

_MAIN = """
@group(0) @binding(0) var<storage, read> pairs_a: array<f32>;
@group(0) @binding(1) var<storage, read> pairs_b: array<f32>;
@group(0) @binding(2) var<storage, read_write> results: array<vec4f>;

@compute @workgroup_size({group})
fn compute_all(
    @builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u
) {{
    let i = id.x + id.y * groups.x * {group}u;
    if (i >= arrayLength(&results)) {{
        return;
    }}
    let a = vec3f(pairs_a[3u * i], pairs_a[3u * i + 1u], pairs_a[3u * i + 2u]);
    let b = vec3f(pairs_b[3u * i], pairs_b[3u * i + 1u], pairs_b[3u * i + 2u]);
    results[i] = {call};
}}
"""

_LOOP = """
fn repeated(start: vec3f, b: vec3f) -> vec4f {{
    var a = start;
    var total = vec3f(0.0);
    for (var i = 0; i < {count}; i++) {{
        a = vec3f(0.8 * a.x - 0.6 * a.y, 0.6 * a.x + 0.8 * a.y, a.z);
        total += {call};
    }}
    return vec4f(total, 0.0);
}}
"""


class VulkanRunner(ShaderRunner):
    """Compute shaders, translated and checked by wgpu."""

    target = "wgsl"
    title = "Vulkan (wgpu)"
    materials = FEW
    vector, loop = "vec4f", _LOOP

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        if importlib.util.find_spec("wgpu") is None:
            return "wgpu"
        try:
            vulkan_device()
        except Exception as error:  # the library of the system that is missing shows in many ways
            words = " ".join(str(error).split())
            return f"a driver of Vulkan (Debian: mesa-vulkan-drivers; {words})"
        return None

    def compiled(self, source: str, call: str, a: Weights, b: Weights) -> Pass:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        return ComputePass(source + _MAIN.format(call=call, group=GROUP), a, b)


@functools.cache
def vulkan_device() -> Any:
    """The one device of this process."""
    import wgpu
    from wgpu.backends.wgpu_native.extras import set_instance_extras

    set_instance_extras(backends=["Vulkan"])
    return wgpu.gpu.request_adapter_sync().request_device_sync()


class ComputePass(Pass):
    """A compute shader for groups of :data:`GROUP` pairs, as WGSL or SPIR-V.

    It finds the numbers of the vectors at bindings 0 and 1, and puts four numbers a pair at 2.
    """

    def __init__(
        self, code: str | bytes, a: Weights, b: Weights, entry: str = "compute_all"
    ) -> None:
        from wgpu import BufferUsage, GPUError

        device = vulkan_device()
        self._groups = -(-len(a) // GROUP)
        try:
            stage = {"module": device.create_shader_module(code=code), "entry_point": entry}
            self._pipeline = device.create_compute_pipeline(layout="auto", compute=stage)
        except GPUError as error:
            raise RuntimeError(str(error)) from error
        inputs = [
            device.create_buffer_with_data(
                data=np.ascontiguousarray(vectors, np.float32), usage=BufferUsage.STORAGE
            )
            for vectors in (a, b)
        ]
        self._results = device.create_buffer(
            size=16 * len(a), usage=BufferUsage.STORAGE | BufferUsage.COPY_SRC
        )
        self._bindings = device.create_bind_group(
            layout=self._pipeline.get_bind_group_layout(0),
            entries=[
                {"binding": binding, "resource": {"buffer": buffer}}
                for binding, buffer in enumerate((*inputs, self._results))
            ],
        )

    def execute(self) -> None:
        device = vulkan_device()
        encoder = device.create_command_encoder()
        compute = encoder.begin_compute_pass()
        compute.set_pipeline(self._pipeline)
        compute.set_bind_group(0, self._bindings)
        rows = -(-self._groups // MAX_GROUPS)
        compute.dispatch_workgroups(min(self._groups, MAX_GROUPS), rows)
        compute.end()
        device.queue.submit([encoder.finish()])
        device.queue.read_buffer(self._results, size=16)  # waits

    def read(self) -> Weights:
        results = vulkan_device().queue.read_buffer(self._results)
        return np.frombuffer(results, np.float32).reshape(-1, 4)
