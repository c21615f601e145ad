"""The functions that read an atlas, once for all shading languages.

`@` stands for the name of the material and `_`, `$type` for a type or what declares a variable of
it, other `$name` for a number of the material.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Code:
    """A function: its name, the type of its value, types of its parameters by name, statements."""

    name: str
    kind: str
    parameters: dict[str, str]
    body: str


LEVEL = Code(
    "level",
    "float",
    {"along": "vec2", "across": "vec2"},
    """
    $let_vec2 size = $vec2($width, $height);
    return log2(max(max(length(along * size), length(across * size)), 1.0));
""",
)
"""Of differences of texture coordinates from a pixel to its neighbors."""

_SIZE = Code(
    "size",
    "ivec2",
    {"level": "int"},
    """
    return $ivec2(max($width_i >> $uint(level), 1), max($height_i >> $uint(level), 1));
""",
)

_ORIGIN = Code(
    "origin",
    "ivec2",
    {"level": "int"},
    """
    if (level == 0) {
        return $ivec2(0, 0);
    }
    return $strip;
""",
)

_PLACE = Code(
    "texel_place",
    "vec2",
    {"uv": "vec2", "level": "int"},
    """
    return $fract(uv) * $vec2(@size(level)) - 0.5;
""",
)

_CORNERS = Code(
    "corners",
    "ivec4",
    {"uv": "vec2", "level": "int"},
    """
    $let_ivec2 size = @size(level);
    $let_ivec2 low = $ivec2(floor(@texel_place(uv, level)));
    $let_ivec2 start = @origin(level);
    $let_ivec2 one = start + (low + size) % size;
    $let_ivec2 other = start + (low + $ivec2(1, 1)) % size;
    return $ivec4(one.x, other.x, one.y, other.y);
""",
)
"""Columns and rows in the atlas of the four texels around a point of a texture that repeats."""

_FRACTIONS = Code(
    "fractions",
    "vec4",
    {"uv": "vec2", "level": "int"},
    """
    $let_vec2 after = $fract(@texel_place(uv, level));
    $let_vec2 before = 1.0 - after;
    return $vec4(before.x * before.y, after.x * before.y, before.x * after.y, after.x * after.y);
""",
)

_PRODUCTS = Code(
    "products",
    "vec4",
    {"corners": "ivec4", "layer": "int", "functions": "vec4"},
    """
    return $vec4(
        dot(@weights_at(corners.xz, layer), functions),
        dot(@weights_at(corners.yz, layer), functions),
        dot(@weights_at(corners.xw, layer), functions),
        dot(@weights_at(corners.yw, layer), functions));
""",
)
"""Of each texel, four weights times four functions."""

_FUNCTIONS = Code(
    "functions_at",
    "vec4",
    {"tile": "vec2", "between": "vec2", "layer": "int"},
    """
    $let_vec4 upper = $mix(@tile_at(tile, layer),
        @tile_at(tile + $vec2($tile, 0.0), layer), between.x);
    $let_vec4 lower = $mix(@tile_at(tile + $vec2(0.0, $tile), layer),
        @tile_at(tile + $vec2($tile, $tile), layer), between.x);
    return $mix(upper, lower, between.y);
""",
)
"""Functions of a layer: between views by the sampler, between lights here."""

_MEAN = Code(
    "mean",
    "vec3",
    {"fractions": "vec4", "luma": "vec4", "difference": "vec4", "total": "vec4"},
    """
    return fractions.x * @joined($vec3(luma.x, difference.x, total.x))
        + fractions.y * @joined($vec3(luma.y, difference.y, total.y))
        + fractions.z * @joined($vec3(luma.z, difference.z, total.z))
        + fractions.w * @joined($vec3(luma.w, difference.w, total.w));
""",
)
"""Reflectance of four texels: functions stand for roots of it, so that texels are mixed last."""

EVAL = Code(
    "eval",
    "vec3",
    {"uv": "vec2", "level": "float", "wi": "vec3", "wo": "vec3"},
    """
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
""",
)

PDF = Code(
    "pdf",
    "float",
    {"uv": "vec2", "wi": "vec3", "wo": "vec3"},
    """
    return @lobe_pdf(@lobe_at(uv), wi, wo);
""",
)

SAMPLE = Code(
    "sample",
    "vec4",
    {"uv": "vec2", "wo": "vec3", "u": "vec3"},
    """
    return @lobe_sample(@lobe_at(uv), wo, u);
""",
)

READING = (
    LEVEL, _SIZE, _ORIGIN, _PLACE, _CORNERS, _FRACTIONS, _PRODUCTS, _FUNCTIONS, _MEAN, EVAL, PDF,
    SAMPLE,
)  # fmt: skip
"""All functions of every atlas, in the order in which they use each other."""

PARALLAX = Code(
    "parallax",
    "vec2",
    {"uv": "vec2", "wo": "vec3"},
    """
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
""",
)
"""Where the ray that would meet the plane meets the field (see render/textures/relief.py)."""
