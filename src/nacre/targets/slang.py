"""Slang: one module that slangc compiles to HLSL, Metal, CUDA, GLSL, WGSL and C++.

There is no line `module NAME;`: a module's name hides everything with the same name, and materials
may be named like types and functions of the language.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from nacre.brdf import Brdf
from nacre.io.ktx2 import Pixels
from nacre.targets.circular import CIRCULAR
from nacre.targets.source import Language
from nacre.targets.textures.source import Dialect, TextureSourceTarget

_METHODS = """
/// The functions as methods: extension {name}_material : INTERFACE {{}} gives them to generic code.
public struct {name}_material {{
    [Differentiable]
    public float3 eval(float3 wi, float3 wo) {{ return {name}_eval(wi, wo); }}

    [Differentiable]
    public float4 sample(float3 wo, float3 u) {{ return {name}_sample(wo, u); }}

    [Differentiable]
    public float pdf(float3 wi, float3 wo) {{ return {name}_pdf(wi, wo); }}
}}
"""


class SlangLanguage(Language):
    """Slang; bwd_diff and fwd_diff differentiate what it marks."""

    vectors = "float{}"
    expanded = CIRCULAR
    operations: ClassVar = {
        **Language.operations,
        # The operators of C would become branches.
        "where": "select({0}, {1}, {2})", "and": "and({0}, {1})", "or": "or({0}, {1})",
        "arctan2": "atan2({0}, {1})",
        "floor": "(no_diff floor({0}))",  # which has no derivative
    }  # fmt: skip

    def literal(self, value: float) -> str:
        return f"{super().literal(value)}f"

    def opening(self) -> list[str]:
        lines = "Tested: C++, GLSL, HLSL and WGSL by slangc were run; Metal and CUDA only compiled."
        return self.comments(["", lines])

    def head(self, kind: str, name: str, parameters: str) -> str:
        return f"[Differentiable]\npublic {super().head(kind, name, parameters)}"


class _TextureLanguage(SlangLanguage):
    """Functions that read textures, which are not differentiable."""

    def head(self, kind: str, name: str, parameters: str) -> str:
        return f"public {Language.head(self, kind, name, parameters)}"


def _types(count: int, kind: str) -> str:
    name = {"f": "float", "i": "int", "u": "uint"}[kind]
    return f"{name}{count}" if count > 1 else name


def _textures(name: str, arrays: Mapping[str, Pixels]) -> list[str]:
    lines = [f"public SamplerState {name}_sampler;"]
    for each, pixels in arrays.items():
        kind = "Texture2DArray" if pixels.ndim == 4 else "Texture2D"
        lines.append(f"public {kind}<{_types(pixels.shape[-1], 'f')}> {name}_{each};")
    return lines


class Slang(TextureSourceTarget):
    title = "Slang module, for HLSL, Metal, CUDA, GLSL, WGSL and C++ through slangc"
    language, suffix = SlangLanguage(), ".slang"
    texture_language = _TextureLanguage()
    dialect = Dialect(
        _types,
        fetch="{texture}.Load(int4(at, layer, 0))",
        array="{texture}.SampleLevel({name}_sampler, float3(at, float(layer)), 0.0)",
        picture="{texture}.SampleLevel({name}_sampler, at, {level})",
        textures=_textures,
        functions={"fract": "frac", "mix": "lerp"},
    )

    def source(self, brdf: Brdf, name: str) -> str:
        return super().source(brdf, name) + _METHODS.format(name=name)
