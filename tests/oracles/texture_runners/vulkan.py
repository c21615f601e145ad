"""WGSL as compute shaders of Vulkan; see :mod:`tests.oracles.runners.vulkan`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import best_rate
from tests.oracles.runners.vulkan import VulkanRunner, vulkan_device
from tests.oracles.texture_runner import FUNCTIONS, TextureRunner, arrays, call, source
from tests.oracles.textures import Points

GROUP = 64  # points of a workgroup
MAIN = """
@group(0) @binding(0) var<storage, read> points: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> results: array<vec4f>;

@compute @workgroup_size(%(group)d)
fn compute_all(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i >= arrayLength(&results)) {
        return;
    }
    let a = points[3u * i].xyz;
    let b = points[3u * i + 1u].xyz;
    let c = points[3u * i + 2u].xyz;
    results[i] = %(call)s;
}
"""


def packed(points: Points) -> Weights:
    """What the shader reads: of each point three vectors of four numbers, shape (n, 12)."""
    vectors = np.zeros((len(points.wi), 3, 4), np.float32)
    vectors[:, :, :3] = np.stack([points.wi, points.wo, points.place], axis=1)
    return vectors.reshape(-1, 12)


class Vulkan(TextureRunner):
    """Compute shaders through wgpu; Mesa's lavapipe where there is no graphics card."""

    target = "wgsl"
    title = "Vulkan (wgpu)"

    def missing(self) -> str | None:
        """See :class:`TextureRunner`."""
        return VulkanRunner().missing()

    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """See :class:`TextureRunner`."""
        found = _dispatch(files, name, function, points)()
        return found[:, : FUNCTIONS[function][1]]

    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """See :class:`TextureRunner`."""
        return best_rate(_dispatch(files, name, "eval", points), len(points.wi))


def _dispatch(
    files: Mapping[str, bytes], name: str, function: str, points: Points
) -> Callable[[], Weights]:
    """What computes a function of points and reads the result."""
    from wgpu import BufferUsage, GPUError, ShaderStage

    gpu, count = vulkan_device(), len(points.wi)
    inputs = gpu.create_buffer_with_data(data=packed(points), usage=BufferUsage.STORAGE)
    results = gpu.create_buffer(size=16 * count, usage=BufferUsage.STORAGE | BufferUsage.COPY_SRC)
    linear = {"mag_filter": "linear", "min_filter": "linear"}
    sampler = gpu.create_sampler(**linear, address_mode_u="repeat", address_mode_v="repeat")
    views = [_texture(pixels) for pixels in arrays(files).values()]
    kinds = [
        {"sampler": {"type": "filtering"}},
        *({"texture": {"sample_type": "float", "view_dimension": of}} for _, of in views),
    ]
    storage = [{"buffer": {"type": kind}} for kind in ("read-only-storage", "storage")]
    layouts = [
        gpu.create_bind_group_layout(
            entries=[
                {"binding": k, "visibility": ShaderStage.COMPUTE, **each}
                for k, each in enumerate(group)
            ]
        )
        for group in (storage, kinds)
    ]
    resources: list[list[Any]] = [
        [{"buffer": inputs}, {"buffer": results}],
        [sampler, *(view for view, _ in views)],
    ]
    groups = [
        gpu.create_bind_group(
            layout=layout, entries=[{"binding": k, "resource": r} for k, r in enumerate(group)]
        )
        for layout, group in zip(layouts, resources, strict=True)
    ]
    code = source(files) + MAIN % {"group": GROUP, "call": call(name, function, "vec4f")}
    try:
        module = gpu.create_shader_module(code=code)
        pipeline = gpu.create_compute_pipeline(
            layout=gpu.create_pipeline_layout(bind_group_layouts=layouts),
            compute={"module": module, "entry_point": "compute_all"},
        )
    except GPUError as error:
        raise RuntimeError(str(error)) from error

    def execute() -> Weights:
        encoder = gpu.create_command_encoder()
        compute = encoder.begin_compute_pass()
        compute.set_pipeline(pipeline)
        for index, group in enumerate(groups):
            compute.set_bind_group(index, group)
        compute.dispatch_workgroups(-(-count // GROUP))
        compute.end()
        gpu.queue.submit([encoder.finish()])
        return np.frombuffer(gpu.queue.read_buffer(results), np.float32).reshape(-1, 4)

    return execute


def _texture(pixels: Weights) -> tuple[Any, str]:
    """A view of a texture with these pixels, and of how many dimensions it is."""
    from wgpu import TextureUsage

    layered = pixels if pixels.ndim == 4 else pixels[None]
    layers, height, width, channels = layered.shape
    texture = vulkan_device().create_texture(
        size=(width, height, layers),
        format="rgba16float" if channels == 4 else "r16float",
        usage=TextureUsage.TEXTURE_BINDING | TextureUsage.COPY_DST,
    )
    vulkan_device().queue.write_texture(
        {"texture": texture},
        np.ascontiguousarray(layered),
        {"bytes_per_row": 2 * width * channels, "rows_per_image": height},
        (width, height, layers),
    )
    dimension = "2d-array" if pixels.ndim == 4 else "2d"
    return texture.create_view(dimension=dimension), dimension
