"""The functions that read a texture, written once for all shading languages.

In their bodies `@` stands for the name of the material and `_`, `$type` for a type or the keyword
that declares a variable of that type, other `$name` for a number of the material. Comments between
functions are not exported.
"""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Code:
    """A function: its name, the type of its value, types of its parameters by name, statements."""

    name: str
    kind: str
    parameters: dict[str, str]
    body: str


def _functions(text: str) -> tuple[Code, ...]:
    found = re.findall(r"^(\w+) (\w+)\(([^)]*)\) {\n(.*?)\n}$", text, re.MULTILINE | re.DOTALL)
    return tuple(
        Code(name, kind, {each: of for of, each in map(str.split, given.split(", "))}, body)
        for kind, name, given, body in found
    )


LEVEL = _functions("""
// The level of a pixel, from differences of texture coordinates to its neighbors.
float level(vec2 along, vec2 across) {
    $let_vec2 size = $vec2($width, $height);
    return log2(max(max(length(along * size), length(across * size)), 1.0));
}

// Functions of a layer: the sampler interpolates between views, this between lights.
vec4 functions_at(vec2 tile, vec2 between, int layer) {
    $let_vec4 upper = $mix(@tile_at(tile, layer),
        @tile_at(tile + $vec2($tile, 0.0), layer), between.x);
    $let_vec4 lower = $mix(@tile_at(tile + $vec2(0.0, $tile), layer),
        @tile_at(tile + $vec2($tile, $tile), layer), between.x);
    return $mix(upper, lower, between.y);
}
""")
"""The level, and the functions at a pair of directions."""

ATLAS = _functions("""
ivec2 size(int level) {
    return $ivec2(max($width_i >> $uint(level), 1), max($height_i >> $uint(level), 1));
}

ivec2 origin(int level) {
    if (level == 0) {
        return $ivec2(0, 0);
    }
    return $strip;
}

vec2 texel_place(vec2 uv, int level) {
    return $fract(uv) * $vec2(@size(level)) - 0.5;
}

// Columns and rows in the atlas of the four texels around a point; the texture repeats.
ivec4 corners(vec2 uv, int level) {
    $let_ivec2 size = @size(level);
    $let_ivec2 low = $ivec2(floor(@texel_place(uv, level)));
    $let_ivec2 start = @origin(level);
    $let_ivec2 one = start + (low + size) % size;
    $let_ivec2 other = start + (low + $ivec2(1, 1)) % size;
    return $ivec4(one.x, other.x, one.y, other.y);
}

vec4 fractions(vec2 uv, int level) {
    $let_vec2 after = $fract(@texel_place(uv, level));
    $let_vec2 before = 1.0 - after;
    return $vec4(before.x * before.y, after.x * before.y, before.x * after.y, after.x * after.y);
}

// For each texel, four weights times four functions.
vec4 products(ivec4 corners, int layer, vec4 functions) {
    return $vec4(
        dot(@weights_at(corners.xz, layer), functions),
        dot(@weights_at(corners.yz, layer), functions),
        dot(@weights_at(corners.xw, layer), functions),
        dot(@weights_at(corners.yw, layer), functions));
}

// Mean reflectance of four texels: functions give its roots, so that texels are mixed last.
vec3 mean(vec4 fractions, vec4 luma, vec4 difference, vec4 total) {
    return fractions.x * @joined($vec3(luma.x, difference.x, total.x))
        + fractions.y * @joined($vec3(luma.y, difference.y, total.y))
        + fractions.z * @joined($vec3(luma.z, difference.z, total.z))
        + fractions.w * @joined($vec3(luma.w, difference.w, total.w));
}

vec3 eval(vec2 uv, float level, vec3 wi, vec3 wo) {
    if (wi.z <= 0.0 || wo.z <= 0.0) {
        return $vec3(0.0);
    }
    $let_float kept = clamp(level, 0.0, $last);
    $let_int fine = $int(kept);
    $let_float after = kept - $float(fine);
    $let_int coarse = min(fine + 1, $last_i);
    $let_ivec4 here = @corners(uv, fine);
    $let_ivec4 there = @corners(uv, coarse);

    $let_vec2 light = @place(wi);
    $let_vec2 low = min(floor(light), $vec2($most - 1.0));
    $let_vec2 between = light - low;
    $let_vec2 tile = (low * $resolution + @place(wo) + 0.5) * $pixel;

    $var_vec4 luma = $vec4(0.0);
    $var_vec4 difference = $vec4(0.0);
    $var_vec4 total = $vec4(0.0);
    $var_vec4 coarse_luma = $vec4(0.0);
    $var_vec4 coarse_difference = $vec4(0.0);
    $var_vec4 coarse_total = $vec4(0.0);
    for ($var_int k = 0; k < $luma; k++) {
        $let_vec4 functions = @functions_at(tile, between, k);
        luma += @products(here, k, functions);
        if (after > 0.0) {
            coarse_luma += @products(there, k, functions);
        }
    }
    for ($var_int k = $luma; k < $luma + $chroma; k++) {
        $let_vec4 functions = @functions_at(tile, between, k);
        difference += @products(here, k, functions);
        total += @products(here, k + $chroma, functions);
        if (after > 0.0) {
            coarse_difference += @products(there, k, functions);
            coarse_total += @products(there, k + $chroma, functions);
        }
    }
    $var_vec3 factor = @mean(@fractions(uv, fine), luma, difference, total);
    if (after > 0.0) {
        $let_vec4 fractions = @fractions(uv, coarse);
        $let_vec3 other = @mean(fractions, coarse_luma, coarse_difference, coarse_total);
        factor = $mix(factor, other, after);
    }
    return factor * $inverse_pi;
}
""")
"""Reflectance from an atlas; texels are mixed after decoding."""

FILTERED = _functions("""
// Luma and both colors: sums of four numbers times functions.
vec3 sums(vec4 numbers, vec2 tile, vec2 between, int layer) {
    return $vec3(
        dot(numbers, @functions_at(tile, between, layer)),
        dot(numbers, @functions_at(tile, between, layer + 1)),
        dot(numbers, @functions_at(tile, between, layer + 2)));
}

vec3 eval(vec2 uv, float level, vec3 wi, vec3 wo) {
    if (wi.z <= 0.0 || wo.z <= 0.0) {
        return $vec3(0.0);
    }
    $let_vec2 light = @place(wi);
    $let_vec2 low = min(floor(light), $vec2($most - 1.0));
    $let_vec2 between = light - low;
    $let_vec2 tile = (low * $resolution + @place(wo) + 0.5) * $pixel;
    $var_vec3 roots = @functions_at(tile, between, 0).xyz;
$sums
    return @joined(roots) * $inverse_pi;
}
""")
"""Reflectance from numbers that the sampler filters between texels and levels."""

LOBES = _functions("""
float pdf(vec2 uv, vec3 wi, vec3 wo) {
    return @lobe_pdf(@lobe_at(uv), wi, wo);
}

vec4 sample(vec2 uv, vec3 wo, vec3 u) {
    return @lobe_sample(@lobe_at(uv), wo, u);
}
""")

(PARALLAX,) = _functions("""
// Where the ray that would hit the plane hits the field (see mitsuba/textures/relief.py).
vec2 parallax(vec2 uv, vec3 wo) {
    $let_vec2 along = $vec2(wo.x, wo.y * -$aspect) / max(wo.z, 0.1);
    $let_vec2 pixels = abs(along) * $vec2($columns, $rows) * $span;
    $let_float forward = $span / clamp(ceil(max(pixels.x, pixels.y)), 1.0, 256.0);
    $var_float height = $top;
    $var_float before = 0.0;
    $var_float gap = height - @height_at(uv + along * height);
    while (gap > 0.0 && height > $bottom) {
        height -= forward;
        before = gap;
        gap = height - @height_at(uv + along * height);
    }
    if (before > 0.0) {
        height += forward * gap / min(gap - before, -1e-12);
    }
    return uv + along * height;
}
""")
