// Shaders of textures: functions of light and view at vertices, weights of them at pixels.

import { VERTEX } from "./shaders.js";
import { HEAD } from "./webgl.js";

// `formulas` hold texture_place(w), where a direction is in the grid of functions, and
// texture_joined(sums), reflectance factors of sums of luma and pairs. Bytes of functions and of weights
// are scaled here, once a vertex: pixels sum what they read.
export const VERTICES = ({ lumas, chromas, resolution }, formulas) => `${HEAD}precision highp sampler2DArray;
${formulas}${VERTEX}
uniform mat3 turn;
uniform vec2 shift, repeats, cells;
uniform float scale, side;  // side: 1 where the front is seen, -1 where the back
uniform vec4 lamp;
uniform sampler2DArray functions;
uniform vec4 function_low[${(lumas + chromas) / 4}], function_step[${(lumas + chromas) / 4}];
uniform vec4 weight_low[${(lumas + 2 * chromas) / 4}], weight_step[${(lumas + 2 * chromas) / 4}];
out vec2 uv;
out vec3 n, p, wo, lowest;
out vec4 luma[${lumas / 4}], first[${chromas / 4}], second[${chromas / 4}];

vec4 function_at(vec2 tile, vec2 between, int k) {
  const float size = ${resolution}.0;
  vec4 near = mix(textureLod(functions, vec3(tile, k) / vec3(size * size, size * size, 1.0), 0.0),
                  textureLod(functions, vec3(tile + vec2(size, 0.0), k) / vec3(size * size, size * size, 1.0), 0.0), between.x);
  vec4 far = mix(textureLod(functions, vec3(tile + vec2(0.0, size), k) / vec3(size * size, size * size, 1.0), 0.0),
                 textureLod(functions, vec3(tile + size, k) / vec3(size * size, size * size, 1.0), 0.0), between.x);
  return function_low[k] + 255.0 * function_step[k] * mix(near, far, between.y);
}

void main() {
  n = side * (turn * normal);
  p = turn * position;
  vec3 t = normalize(turn * tangent), b = cross(n, t);
  vec2 at = vec2(gl_VertexID % (int(cells.x) + 1), gl_VertexID / (int(cells.x) + 1)) / cells;
  uv = vec2(at.x, side > 0.0 ? 1.0 - at.y : at.y) * repeats;
  wo = vec3(t.z, b.z, n.z);
  vec3 wi = normalize(lamp.xyz - lamp.w * p);
  vec2 light = texture_place(vec3(dot(wi, t), dot(wi, b), dot(wi, n)));
  vec2 low = min(floor(light), ${resolution - 2}.0);
  vec2 tile = low * ${resolution}.0 + texture_place(wo) + 0.5;
  lowest = vec3(0.0);
  for (int k = 0; k < ${lumas / 4}; k++) {
    vec4 f = function_at(tile, light - low, k);
    lowest.x += dot(f, weight_low[k]);
    luma[k] = f * weight_step[k];
  }
  for (int k = 0; k < ${chromas / 4}; k++) {
    vec4 f = function_at(tile, light - low, k + ${lumas / 4});
    lowest.yz += vec2(dot(f, weight_low[k + ${lumas / 4}]), dot(f, weight_low[k + ${(lumas + chromas) / 4}]));
    first[k] = f * weight_step[k + ${lumas / 4}];
    second[k] = f * weight_step[k + ${(lumas + chromas) / 4}];
  }
  gl_Position = vec4(p.xy * scale + shift, -0.25 * p.z, 1.0);
}`;

// Four weights of a texel that is read, the k-th of them.
const four = (k) => `four(${"abcdefgh"[k >> 2]}.${"xyzw"[k & 3]})`;
const summed = (start, count, functions) =>
  Array.from({ length: count }, (_, k) => `dot(${four(start + k)}, ${functions}[${k}])`).join(" + ");

// Light of the lamp, and nothing else, from a texture on which a ray meets a field of heights. Functions
// stand for roots of reflectance, so that texels and levels are mixed last.
export const TEXELS = ({ lumas, chromas }, formulas) => `${HEAD}precision highp usampler2DArray;
${formulas}
in vec2 uv;
in vec3 n, p, wo, lowest;
in vec4 luma[${lumas / 4}], first[${chromas / 4}], second[${chromas / 4}];
uniform usampler2DArray weights;
uniform int levels;
uniform sampler2D relief;  // heights over their mean, in widths of the texture
uniform vec3 field;        // the lowest and the highest, times the depth, which is the third
uniform float aspect;      // width over height of the texture
uniform vec4 lamp;
uniform vec3 irradiance;
out vec4 color;

// Where the ray that would meet the plane meets the field, from pixel to pixel of it (Tatarchuk 2006).
vec2 met(vec3 from) {
  if (field.x == field.y) return uv;
  vec2 along = vec2(from.x, -aspect * from.y) / max(from.z, 0.1);
  vec2 pixels = abs(along) * vec2(textureSize(relief, 0)) * (field.y - field.x);
  float forward = (field.y - field.x) / clamp(ceil(max(pixels.x, pixels.y)), 1.0, 256.0);
  float height = field.y, before = 0.0, gap = height - field.z * textureLod(relief, uv + along * height, 0.0).x;
  while (gap > 0.0 && height > field.x) {
    height -= forward;
    before = gap;
    gap = height - field.z * textureLod(relief, uv + along * height, 0.0).x;
  }
  if (before > 0.0) height += forward * gap / min(gap - before, -1e-12);
  return uv + along * height;
}

vec4 four(uint bytes) { return vec4((uvec4(bytes) >> uvec4(0, 8, 16, 24)) & 255u); }

// Reflectance factors of a texel of a level; the texture repeats.
vec3 texel(ivec2 at, ivec2 size, int level) {
  ivec2 here = (at + size) % size;
${Array.from({ length: Math.ceil((lumas + 2 * chromas) / 16) }, (_, k) => `  uvec4 ${"abcdefgh"[k]} = texelFetch(weights, ivec3(here, ${k}), level);`).join("\n")}
  return texture_joined(lowest + vec3(
    ${summed(0, lumas / 4, "luma")},
    ${summed(lumas / 4, chromas / 4, "first")},
    ${summed((lumas + chromas) / 4, chromas / 4, "second")}));
}

vec3 between(vec2 at, int level) {
  ivec2 size = textureSize(weights, level).xy;
  vec2 place = fract(at) * vec2(size) - 0.5, part = fract(place);
  ivec2 low = ivec2(floor(place));
  return mix(mix(texel(low, size, level), texel(low + ivec2(1, 0), size, level), part.x),
             mix(texel(low + ivec2(0, 1), size, level), texel(low + ivec2(1, 1), size, level), part.x), part.y);
}

void main() {
  vec2 size = vec2(textureSize(weights, 0).xy), across = dFdx(uv) * size, down = dFdy(uv) * size;
  float level = clamp(log2(max(length(across), length(down))), 0.0, float(levels - 1));
  vec3 way = lamp.xyz - lamp.w * p;
  float squared = dot(way, way), cosine = dot(normalize(n), way) * inversesqrt(squared);
  color = vec4(0.0, 0.0, 0.0, 1.0);
  if (cosine <= 0.0 || wo.z <= 0.0) return;
  int fine = int(level);
  vec2 at = met(normalize(wo));
  vec3 factor = between(at, fine);
  if (level > float(fine)) factor = mix(factor, between(at, fine + 1), level - float(fine));
  color.rgb = irradiance / mix(1.0, squared, lamp.w) * factor * cosine / 3.14159265358979;
}`;

// A picture more, on the sum of those before.
export const ADDED = `${HEAD}
uniform sampler2D before, one;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  color = texelFetch(before, at, 0) + texelFetch(one, at, 0);
}`;
