// Shaders of the renderer: points of a shape, and what is shown. Light on them is in lit.js.

import { HEAD } from "./webgl.js";

// What vertices of shapes have; see shapes.js.
export const VERTEX = `
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tangent;`;

// A shape's points, seen from +z without perspective.
export const POINTS = `${HEAD}${VERTEX}
uniform mat3 turn;
uniform vec2 shift;
uniform float scale;
out vec3 n, t, p;
void main() {
  n = turn * normal;
  t = turn * tangent;
  p = turn * position;
  gl_Position = vec4(p.xy * scale + shift, -0.25 * p.z, 1.0);
}`;

const FOUND = `
layout(location = 0) out vec4 normal;
layout(location = 1) out vec4 tangent;
layout(location = 2) out vec4 point;
void found(vec3 n, vec3 t, vec3 p) {
  normal = vec4(n, 1.0);
  tangent = vec4(normalize(t - n * dot(n, t)), 1.0);
  point = vec4(p, 1.0);
}`;

// The fourth number of a normal tells what is seen: a material, or a stage's base.
export const FRAMES = `${HEAD}${FOUND}
in vec3 n, t, p;
uniform float kind;
void main() {
  found(normalize(gl_FrontFacing ? n : -n), t, p);
  normal.w = kind;
}`;

// The same of the unit sphere, exactly.
export const SPHERE = `${HEAD}${FOUND}
uniform mat3 turn;
uniform vec2 shift, size;
uniform float scale;
void main() {
  vec2 at = (gl_FragCoord.xy / size * 2.0 - 1.0 - shift) / scale;
  float squared = dot(at, at);
  if (squared >= 1.0) discard;
  vec3 n = vec3(at, sqrt(1.0 - squared)), t = cross(turn[1], n);
  if (dot(t, t) < 1e-12) t = turn[0];
  found(n, t, n);
}`;

// A mean radiance as screens take it: exposed, clipped, with the transfer function of IEC 61966-2-1.
export const DISPLAYED = `
vec3 displayed(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

// A sum as it is shown, over the ground, as far as that is opaque. With "film", highlights roll off
// instead of being clipped: the tone curve that Khronos made for products ("PBR Neutral", 2024), which
// leaves colors below 0.8 as they are.
export const PRESENTED = `
${DISPLAYED}
uniform float exposure, count, backing;
uniform vec3 ground;
uniform bool film;
vec3 filmed(vec3 c) {
  float low = min(c.r, min(c.g, c.b)), offset = low < 0.08 ? low - 6.25 * low * low : 0.04;
  c -= offset;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float rolled = 1.0 - 0.0576 / (peak - 0.52);
  return mix(c * (rolled / peak), vec3(rolled), 1.0 - 1.0 / (0.15 * (peak - rolled) + 1.0));
}
vec4 presented(vec4 sum) {
  vec3 c = sum.rgb / max(sum.a, 1.0) * exposure;
  return mix(vec4(ground, 1.0) * backing, vec4(displayed(film ? filmed(c) : c), 1.0), min(sum.a / max(count, 1.0), 1.0));
}`;

export const SHOWN = `${HEAD}
${PRESENTED}
uniform sampler2D sums, gains;
out vec4 color;
void main() {
  vec4 sum = texelFetch(sums, ivec2(gl_FragCoord.xy), 0);
  color = presented(vec4(sum.rgb * texelFetch(gains, ivec2(0), 0).r, sum.a));
}`;

// Reflectance at pairs of directions that textures hold, and something more.
export const VALUES = (material, more) => `${HEAD}
${material}
uniform sampler2D toward, from;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 wi = texelFetch(toward, at, 0).xyz, wo = texelFetch(from, at, 0).xyz;
  color = vec4(material_eval(wi, wo), ${more});
}`;
