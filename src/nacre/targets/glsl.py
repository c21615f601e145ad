"""GLSL: functions for ES 3.00 (WebGL2) and for 330 and later."""

from __future__ import annotations

from collections.abc import Mapping

from nacre.io.ktx2 import Pixels
from nacre.targets.circular import CIRCULAR
from nacre.targets.source import Language
from nacre.targets.textures.source import Dialect, TextureSourceTarget


class GlslLanguage(Language):
    """GLSL; the program that includes the functions states its version."""

    packed = False  # as fast on graphics cards, and up to twice as fast on processors
    expanded = CIRCULAR

    def opening(self) -> tuple[str, ...]:
        return "", "#ifdef GL_ES", "precision highp float;  // mediump has too few bits", "#endif"


def _types(count: int, kind: str) -> str:
    if count == 1:
        return {"f": "float", "i": "int", "u": "uint"}[kind]
    return f"{'i' if kind == 'i' else ''}vec{count}"


def _textures(name: str, arrays: Mapping[str, Pixels]) -> list[str]:
    lines = ["#ifdef GL_ES", "precision highp int;", "#endif"]
    for each, pixels in arrays.items():
        kind = "sampler2DArray" if pixels.ndim == 4 else "sampler2D"
        lines.append(f"uniform highp {kind} {name}_{each};")
    return lines


class Glsl(TextureSourceTarget):
    title = "GLSL functions for OpenGL 3.3, OpenGL ES 3, Vulkan and WebGL2"
    language, suffix = GlslLanguage(), ".glsl"
    dialect = Dialect(
        _types,
        fetch="texelFetch({texture}, ivec3(at, layer), 0)",
        array="textureLod({texture}, vec3(at, float(layer)), 0.0)",
        picture="textureLod({texture}, at, {level})",
        textures=_textures,
        functions={"fract": "fract", "mix": "mix"},
    )
