"""WGSL: functions for WebGPU."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from nacre.compile.trace import FLOAT, INDEX, MASK
from nacre.io.ktx2 import Pixels
from nacre.targets.circular import CIRCULAR
from nacre.targets.source import Language
from nacre.targets.textures.source import Dialect, TextureSourceTarget


class WgslLanguage(Language):
    types: ClassVar = {FLOAT: "f32", INDEX: "i32", MASK: "bool"}
    vectors = "vec{}f"
    packed = False  # as in GLSL
    expanded = CIRCULAR
    operations: ClassVar = {
        **Language.operations,
        "where": "select({2}, {1}, {0})",
        "arctan2": "atan2({0}, {1})",
    }

    def literal(self, value: float) -> str:
        return f"{super().literal(value)}f"

    def declaration(self, kind: str, name: str, value: str) -> str:
        return f"let {name} = {value};"

    def parameter(self, kind: str, name: str) -> str:
        return f"{name}: {kind}"

    def head(self, kind: str, name: str, parameters: str) -> str:
        return f"fn {name}({parameters}) -> {kind}"


def _types(count: int, kind: str) -> str:
    if count == 1:
        return {"f": "f32", "i": "i32", "u": "u32"}[kind]
    return f"vec{count}{kind}"


def _textures(name: str, arrays: Mapping[str, Pixels]) -> list[str]:
    kinds = [f"{name}_sampler: sampler"]
    for each, pixels in arrays.items():
        kinds.append(f"{name}_{each}: texture_2d{'_array' if pixels.ndim == 4 else ''}<f32>")
    note = "// Group and bindings may be any others."
    return [note, *(f"@group(1) @binding({k}) var {kind};" for k, kind in enumerate(kinds))]


class Wgsl(TextureSourceTarget):
    title = "WGSL functions for WebGPU"
    language, suffix = WgslLanguage(), ".wgsl"
    dialect = Dialect(
        _types,
        fetch="textureLoad({texture}, at, layer, 0)",
        array="textureSampleLevel({texture}, {name}_sampler, at, layer, 0.0)",
        picture="textureSampleLevel({texture}, {name}_sampler, at, {level})",
        textures=_textures,
        functions={"fract": "fract", "mix": "mix"},
        let="let",
        var="var",
    )
