"""Encoded textures in the module of :mod:`nacre.targets.three`: code for both of its renderers.

In three.js v grows upward, as the texture's y does. The place of a pixel on the texture is computed
once, at its start; then functions of a pair of directions are called as for a reflectance.
"""

from __future__ import annotations

import json
from dataclasses import replace
from importlib import resources

from nacre.targets.glsl import Glsl
from nacre.targets.textures.shader_texture import ShaderTexture
from nacre.targets.textures.source import texture_source
from nacre.targets.wgsl import Wgsl

SAMPLES = 8
"""Of the surroundings, per pixel; fewer than for reflectances, which take less time."""

_GLSL = """
vec3 AT_begin(vec2 uv, vec2 along, vec2 across, vec3 wo) {
    vec2 place = vec2(uv.x, 1.0 - uv.y);
    return vec3(PLACE, AT_level(along, across));
}

vec3 NAME_eval(vec3 wi, vec3 wo, vec3 here) {
    return AT_eval(here.xy, here.z, wi, wo);
}

vec4 NAME_sample(vec3 wo, vec3 u, vec3 here) {
    return AT_sample(here.xy, wo, u);
}

vec3 AT_here;

vec3 NAME_eval(vec3 wi, vec3 wo) {
    return NAME_eval(wi, wo, AT_here);
}

vec4 NAME_sample(vec3 wo, vec3 u) {
    return NAME_sample(wo, u, AT_here);
}
"""
_WGSL = """
fn AT_begin(uv: vec2f, along: vec2f, across: vec2f, wo: vec3f) -> vec3f {
    let place = vec2f(uv.x, 1.0 - uv.y);
    return vec3f(PLACE, AT_level(along, across));
}

fn NAME_eval(wi: vec3f, wo: vec3f, here: vec3f) -> vec3f {
    return AT_eval(here.xy, here.z, wi, wo);
}

fn NAME_sample(wo: vec3f, u: vec3f, here: vec3f) -> vec4f {
    return AT_sample(here.xy, wo, u);
}
"""
_NODES = replace(  # three.js declares textures, and a sampler for each
    Wgsl.dialect,
    array=Wgsl.dialect.array.replace("{name}", "{texture}"),
    picture=Wgsl.dialect.picture.replace("{name}", "{texture}"),
    textures=lambda name, arrays: (),
)


def texture_values(atlas: ShaderTexture, name: str) -> dict[str, str]:
    """The template values for a texture, by the names of their places."""
    inner = f"{name}_at"
    place = f"{inner}_parallax(place, wo)" if atlas.heights else "place"
    arrays = {
        f"{inner}_{each}": {
            "file": f"{name}_{each}.ktx2",
            "layers": len(levels[0]) if levels[0].ndim == 4 else 0,
        }
        for each, levels in atlas.textures().items()
    }

    def adapted(text: str) -> str:
        return text.replace("PLACE", place).replace("AT", inner).replace("NAME", name)

    glsl = texture_source(atlas, inner, Glsl.language, Glsl.dialect, ())
    wgsl = texture_source(atlas, inner, Wgsl.language, _NODES, ())
    return {
        "ANISOTROPIC": "true",
        "ARRAYS": json.dumps(arrays),
        "SAMPLES": str(SAMPLES),
        "LOADER": resources.files(__package__).joinpath("loader.js").read_text("utf-8"),
        "BEGIN": f"{inner}_here = {inner}_begin(vUv, dFdx(vUv), dFdy(vUv), wo);",
        "GLSL": glsl + adapted(_GLSL),
        "WGSL": wgsl + adapted(_WGSL),
    }
