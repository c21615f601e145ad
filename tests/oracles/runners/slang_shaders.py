"""GLSL, WGSL and HLSL that slangc makes of the target `slang`, run by OpenGL and Vulkan."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from nacre.array import Weights
from tests.oracles.runners import slang
from tests.oracles.runners.opengl import OpenGlRunner
from tests.oracles.runners.vulkan import GROUP, MAX_GROUPS, ComputePass, VulkanRunner
from tests.oracles.shaders import Pass

_MAIN = """
StructuredBuffer<float> pairs_a;
StructuredBuffer<float> pairs_b;
RWStructuredBuffer<float4> results;

[shader("compute")]
[numthreads({group}, 1, 1)]
void run_all(uint3 id : SV_DispatchThreadID)
{{
    uint count, size, i = id.x + id.y * {row};
    results.GetDimensions(count, size);
    if (i >= count)
        return;
    let a = float3(pairs_a[3 * i], pairs_a[3 * i + 1], pairs_a[3 * i + 2]);
    let b = float3(pairs_b[3 * i], pairs_b[3 * i + 1], pairs_b[3 * i + 2]);
    results[i] = {call};
}}
"""

LOOP = """
float4 repeated(float3 a, float3 b)
{{
    float3 total = float3(0.0);
    for (int i = 0; i < {count}; i++)
    {{
        a = float3(0.8 * a.x - 0.6 * a.y, 0.6 * a.x + 0.8 * a.y, a.z);
        total += {call};
    }}
    return float4(total, 0.0);
}}
"""


def main(call: str) -> str:
    """An entry point `run_all` that finds `call` of each pair `a` and `b` of two buffers."""
    return _MAIN.format(call=call, group=GROUP, row=GROUP * MAX_GROUPS)


class SlangWgsl(VulkanRunner):
    """Compute shaders in Slang."""

    target = "slang"
    title = "WGSL by slangc, Vulkan (wgpu)"
    vector, loop = "float4", LOOP
    language: ClassVar[str] = "wgsl"

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        return slang.missing() or super().missing()

    def compiled(self, source: str, call: str, a: Weights, b: Weights) -> Pass:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        with tempfile.TemporaryDirectory() as folder:
            made = slang.compiled(Path(folder), {}, source + main(call), self.language, "all")
            return ComputePass(self.code(made), a, b, "run_all")

    def code(self, made: Path) -> str | bytes:
        """What Vulkan's runner takes of a file that slangc made."""
        return made.read_text()


class SlangHlsl(SlangWgsl):
    """HLSL, made SPIR-V by another compiler of it."""

    title = "HLSL by slangc, glslang, Vulkan (wgpu)"
    language = "hlsl"

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        if shutil.which("glslangValidator") is None:
            return "glslangValidator (Debian: glslang-tools)"
        return super().missing()

    def code(self, made: Path) -> str | bytes:
        """What Vulkan's runner takes of a file that slangc made."""
        spirv = made.with_suffix(".spv")
        options = ["-D", "-V", "--target-env", "vulkan1.1", "-S", "comp"]
        places = ["--hlsl-iomap", "--shift-uav-binding", "2"]  # after what is only read
        entry = ["-e", "run_all", "--source-entrypoint", "run_all"]
        slang.execute("glslangValidator", *options, *places, *entry, made, "-o", spirv)
        return spirv.read_bytes()


class SlangGlsl(OpenGlRunner):
    """GLSL 4.50 core."""

    target = "slang"
    title = "GLSL by slangc, OpenGL"
    version = "450 core"

    def missing(self) -> str | None:
        """See :class:`tests.oracles.runner.Runner`."""
        return slang.missing() or super().missing()

    def text(self, files: Mapping[str, bytes], name: str, function: str) -> tuple[str, str]:
        """See :class:`tests.oracles.shaders.ShaderRunner`."""
        shader = slang.shader(name, {function: slang.VALUES[function]})
        with tempfile.TemporaryDirectory() as folder:
            made = slang.compiled(Path(folder), files, shader, "glsl", function).read_text()
        # Between the version and the entry point stand buffers, unused here, and functions.
        functions = made.partition("\n")[2].partition("layout(local_size_x")[0]
        return functions, f"{name}_{function}_0(a, b)"
