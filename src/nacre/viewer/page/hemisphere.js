// Values over the hemisphere as a surface: the farther from the middle, the higher.

import { DISPLAYED } from "./shaders.js";
import { triangles } from "./shapes.js";
import { HEAD, WHOLE } from "./webgl.js";

const OUT = 160, AROUND = 128; // steps from the mirror direction to the horizon, and around
const FINER = 5; // logarithm of the last step over the first
const LOWEST = 2e-3; // cosine
const SCALE = 0.9; // of the picture's half
const PIVOT = [0, 0, 0.3]; // about this point the picture turns
const GROUND = 0.0103; // what the picture shows around shapes, linear
// Color, half of the width, dashes.
const RAYS = {
  light: [[1, 0.66, 0.13], 0.008, 0],
  mirror: [[0.35, 0.35, 0.35], 0.005, 18],
  view: [[0.75, 0.75, 0.75], 0.005, 0],
};

// Seen from above the plane, x to the right: columns.
const TILT = 0.5;
const BASE = [1, 0, 0, 0, Math.sin(TILT), -Math.cos(TILT), 0, Math.cos(TILT), Math.sin(TILT)];

// Directions on a grid about the mirror direction, dense there, that ends at the horizon; and the
// integral of values at them times the cosine. Angles are of the mirror direction.
export function nodes(theta, phi) {
  const [s, c] = [Math.sin(theta), Math.cos(theta)], [sine, cosine] = [Math.sin(phi), Math.cos(phi)];
  const directions = new Float32Array(3 * (OUT + 1) * (AROUND + 1)), areas = new Float64Array((OUT + 1) * (AROUND + 1));
  for (let j = 0, k = 0; j <= AROUND; j++) {
    const psi = (2 * Math.PI * j) / AROUND, [a, b] = [Math.cos(psi), Math.sin(psi)];
    const horizon = Math.atan2(c, -s * a);
    for (let i = 0; i <= OUT; i++, k++) {
      const grown = Math.exp((FINER * i) / OUT), angle = (horizon * (grown - 1)) / (Math.exp(FINER) - 1);
      const [p, q] = [Math.cos(angle), Math.sin(angle)], low = p * s - q * a * c, z = p * c + q * a * s;
      const w = [low * cosine - q * b * sine, low * sine + q * b * cosine, Math.max(z, LOWEST)], length = Math.hypot(...w);
      directions.set(w.map((x) => x / length), 3 * k);
      const rate = (horizon * FINER * grown) / OUT / (Math.exp(FINER) - 1), ends = i === 0 || i === OUT ? 0.5 : 1;
      areas[k] = j === AROUND ? 0 : ends * rate * q * Math.max(z, 0) * ((2 * Math.PI) / AROUND);
    }
  }
  const albedo = (rgb) => [0, 1, 2].map((channel) => areas.reduce((sum, area, k) => sum + area * rgb[3 * k + channel], 0));
  return { directions, albedo };
}

const PLACED = `
uniform vec3 pivot;
uniform float scale;
vec4 placed(vec3 p) { return vec4((p - pivot).xy * scale, -0.25 * (p - pivot).z, 1.0); }`;

const SURFACE = `${HEAD}${PLACED}
layout(location = 0) in vec3 direction;
layout(location = 1) in vec4 radii;
layout(location = 2) in vec3 tint;
uniform mat3 turn;
uniform vec4 pick;
out vec3 p, c;
void main() {
  p = turn * direction * dot(pick, radii);
  c = tint;
  gl_Position = placed(p);
}`;

const SHADED = `${HEAD}
in vec3 p, c;
out vec4 color;
void main() {
  vec3 n = cross(dFdx(p), dFdy(p));
  float lit = abs(dot(n, vec3(-0.32, 0.48, 0.82))) * inversesqrt(max(dot(n, n), 1e-30));
  color = vec4(c * (0.08 + 0.72 * lit * lit), 1.0);
}`;

// The plane of the surface: rings, spokes, and its x axis.
const PLANE = `${HEAD}${PLACED}
uniform mat3 turn;
out vec2 q;
void main() {
  q = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = placed(turn * vec3(q, 0.0));
}`;

const GRID = `${HEAD}
in vec2 q;
out vec4 color;
void main() {
  float r = length(q), spoke = abs(sin(atan(q.y, q.x) * 6.0)) / 6.0 * r;
  bool axis = abs(q.y) < 0.006 && q.x > 0.0;
  if (r > 1.004 || (!axis && abs(fract(r * 4.0 + 0.5) - 0.5) > 0.016 && (spoke > 0.0025 || r < 0.25))) discard;
  color = vec4(vec3(axis ? 0.3 : 0.06), 1.0);
}`;

// A ray from the middle, as wide from wherever it is seen.
const RAY = `${HEAD}${PLACED}
uniform vec3 end;
uniform float width;
out float along;
void main() {
  along = float(gl_VertexID >> 1);
  vec2 way = normalize(end.xy + vec2(1e-6, 0.0));
  vec3 p = end * along + vec3(-way.y, way.x, 0.0) * width * (float(gl_VertexID & 1) * 2.0 - 1.0);
  gl_Position = placed(p);
}`;

const RAY_COLOR = `${HEAD}
in float along;
uniform vec3 tint;
uniform float dashes;
out vec4 color;
void main() {
  if (dashes > 0.0 && fract(along * dashes) > 0.5) discard;
  color = vec4(tint, 1.0);
}`;

// Four points of the picture for each pixel.
const SMALLER = `${HEAD}
uniform sampler2D points;
out vec4 color;
${DISPLAYED}
void main() {
  ivec2 at = 2 * ivec2(gl_FragCoord.xy);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; k++) sum += displayed(texelFetch(points, at + ivec2(k & 1, k >> 1), 0).rgb);
  color = vec4(0.25 * sum, 1.0);
}`;

const ALL = [true, true, true];
const PICKS = [[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];

export class Hemisphere {
  constructor(renderer) {
    this.renderer = renderer;
  }

  // The surface of values, three for each direction; with one radius for luminance, or one a channel.
  shape(directions, values, scale, channels) {
    const count = directions.length / 3, vertices = new Float32Array(10 * count);
    const bright = (k) => 0.2126 * values[k] + 0.7152 * values[k + 1] + 0.0722 * values[k + 2];
    const high = (k) => (channels ? Math.max(values[k], values[k + 1], values[k + 2]) : bright(k));
    let peak = 0;
    for (let k = 0; k < 3 * count; k += 3) peak = Math.max(peak, high(k));
    const radius = (value) => (peak > 0 ? scale.of(Math.min(Math.max(value, 0) / peak, 1)) : 0);
    for (let k = 0; k < count; k++) {
      const rgb = values.subarray(3 * k, 3 * k + 3), highest = Math.max(...rgb, 1e-30);
      const tint = channels ? [1, 1, 1] : rgb.map((x) => Math.max(x, 0) / highest);
      vertices.set([...directions.subarray(3 * k, 3 * k + 3), radius(bright(3 * k)), ...rgb.map(radius), ...tint], 10 * k);
    }
    this.passes = channels ? PICKS.map((pick, c) => [ALL.map((_, k) => k === c), pick]) : [[ALL, [1, 0, 0, 0]]];
    const { renderer, renderer: { gl } } = this;
    this.mesh ??= renderer.mesh({ vertices, indices: triangles(OUT, AROUND) }, [3, 4, 3]);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.mesh.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.DYNAMIC_DRAW);
  }

  // Where a direction is seen, from -1 to 1, the third number toward us.
  seen(turn, w) {
    return rotated(turn, rotated(BASE, w.map((x, k) => x - PIVOT[k]))).map((x) => x * SCALE);
  }

  // Draw on the canvas, turned; gives where the light is seen.
  paint(turn, rays) {
    const { renderer, renderer: { gl } } = this, size = renderer.size.map((length) => 2 * length);
    if (`${this.target?.size}` !== `${size}`) {
      if (this.target) renderer.free(this.target);
      this.target = renderer.target(1, size, true);
    }
    const whole = [0, 3, 6].flatMap((k) => rotated(turn, BASE.slice(k, k + 3)));
    const values = { turn: whole, pivot: rotated(whole, PIVOT), scale: SCALE };
    for (const [mask, pick] of this.passes) {
      gl.colorMask(...mask, true);
      renderer.begin(this.target, [GROUND, GROUND, GROUND, 1]);
      renderer.meshed(renderer.program(SURFACE, SHADED), { ...values, pick }, this.mesh);
      renderer.use(renderer.program(PLANE, GRID), values);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      for (const [name, [tint, thick, dashes]] of Object.entries(RAYS)) {
        const end = rotated(whole, rays[name]);
        renderer.use(renderer.program(RAY, RAY_COLOR), { ...values, end, tint, width: thick, dashes });
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      }
    }
    gl.colorMask(true, true, true, true);
    renderer.fill(null, renderer.program(WHOLE, SMALLER), { points: this.target.textures[0] });
    return this.seen(turn, rays.light);
  }
}

// A matrix of columns times a vector.
const rotated = (m, [x, y, z]) => [0, 1, 2].map((k) => m[k] * x + m[3 + k] * y + m[6 + k] * z);
