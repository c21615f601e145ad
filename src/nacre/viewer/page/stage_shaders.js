// Shaders of the stage: its points, what stands in the way of light, and light on the ground.

import { HEAD } from "./webgl.js";
import { BODIES, FLOOR, PAPER } from "./stage.js";

// What a pixel shows, beside the ground.
export const MATERIAL = 1;
export const BASE = 2;

// Points of the stage, in perspective.
export const STAGE_POINTS = (vertex) => `${HEAD}${vertex}
uniform mat3 turn, view;
uniform vec4 eye;
uniform vec2 focal, shift;
out vec3 n, t, p;
void main() {
  n = turn * normal;
  t = turn * tangent;
  p = turn * position;
  vec3 seen = (p - eye.xyz) * view;
  gl_Position = vec4(seen.xy * focal - seen.z * shift, -1.01 * seen.z - 2.01, -seen.z);
}`;

// Light that reaches points of a stage: what is in its way, and what the ground and the base send.
// "seen" gives the light of the surroundings alone.
export const STAGE = `
uniform bool staged;
uniform mat3 view;
uniform vec4 eye;         // where the viewer is, or toward it where the fourth number is 0
uniform vec2 focal, shift;
uniform vec4 bodies[${BODIES}];  // spheres: centers and radii
uniform int bodied;       // how many there are
uniform vec2 base;        // radius and top of a cylinder on the ground
uniform vec3 groove;      // its axis; it lies between two cosines, of which the first is 2 where there is none
uniform vec2 edges;
uniform vec3 paper;       // radiance of the ground where nothing stands

const float FLOOR = ${FLOOR.toFixed(4)}, PAPER = ${PAPER.toFixed(4)}, PLASTIC = 0.03;

bool behind_sphere(vec3 p, vec3 w, vec4 body) {
  vec3 from = p - body.xyz;
  float b = dot(from, w), q = dot(from, from) - body.w * body.w;
  return b < 0.0 && q > 0.0 && b * b > q;
}

bool behind_base(vec3 p, vec3 w) {
  if (base.x <= 0.0) return false;
  float a = dot(w.xz, w.xz), b = dot(p.xz, w.xz), q = dot(p.xz, p.xz) - base.x * base.x;
  if (w.y < 0.0 && p.y > base.y) {
    vec2 at = p.xz + w.xz * ((base.y - p.y) / w.y);
    if (dot(at, at) < base.x * base.x) return true;
  }
  if (q <= 0.0 || b >= 0.0 || b * b <= a * q) return false;
  float y = p.y - w.y * (b + sqrt(b * b - a * q)) / a;
  return y > FLOOR && y < base.y;
}

bool behind_something(vec3 p, vec3 w) {
  for (int k = 0; k < bodied; k++) if (behind_sphere(p, w, bodies[k])) return true;
  return behind_base(p, w);
}

// Whether light that leaves the shape in a direction meets the walls of its groove.
bool in_groove(vec3 p, vec3 w) {
  float q = 1.0 - dot(p, p);
  if (edges.x > 1.0 || q < 0.03) return false;
  float b = dot(p, w), height = dot(p + w * (sqrt(b * b + q) - b), groove);
  return height > edges.x || height < edges.y;
}

// How bright the paper is at a place beside the shape: the part of an even sky that its body and the
// base leave free, about; and how it darkens into the distance.
float open_sky(vec2 at) {
  float squared = dot(at, at), far = squared + FLOOR * FLOOR, hidden = 0.0;
  if (bodied == 1) hidden = -FLOOR / (far * sqrt(far));
  else if (base.x > 0.0) hidden = 0.5 * exp(-max(sqrt(squared) - base.x, 0.0) / max(base.y - FLOOR, 0.05));
  return 1.0 - min(hidden, 0.9);
}

// Of the base: dull black plastic.
float plastic(vec3 n, vec3 wi, vec3 wo) {
  vec3 h = normalize(wi + wo);
  float c = dot(n, h), d = c * c * (0.08 - 1.0) + 1.0, fresnel = 0.04 + 0.96 * pow(1.0 - dot(wi, h), 5.0);
  return PLASTIC / 3.14159265 + 0.08 * fresnel / (3.14159265 * d * d * 4.0 * max(dot(wi, h), 0.1) * max(max(dot(n, wi), dot(n, wo)), 0.2));
}

float distant(float away) {
  return mix(1.0, 0.5, smoothstep(1.0, 14.0, away));
}

// Light toward a point of the shape from a direction whose light without the stage is "sky".
vec3 arriving(vec3 p, vec3 w, vec3 sky) {
  if (!staged) return sky;
  if (in_groove(p, w)) return vec3(0.0);
  if (w.y < 0.0) {
    if (behind_base(p, w)) return 0.1 * paper;
    vec2 at = p.xz + w.xz * ((FLOOR - p.y) / w.y);
    float away = length(at);
    return mix(paper * open_sky(at), sky, smoothstep(2.0, 12.0, away));
  }
  return sky;
}

// Through the middle of a pixel.
vec3 sight(vec2 at, vec2 size) {
  return normalize(view * vec3((at / size * 2.0 - 1.0 - shift) / focal, -1.0));
}`;
