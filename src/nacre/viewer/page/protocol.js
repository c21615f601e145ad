// The points and directions at which nacre compare measures: its sphere under its directional light,
// and pairs of directions uniform in Rusinkiewicz angles.

import { angularErrors, pictureErrors } from "./errors.js";
import { Flip } from "./flip.js";

const SIZE = 128, MARGIN = 0.03; // pixels along an edge; what stays free around the sphere
const STATE = 35399562948360463058890781895381311971n, INCREMENT = 87136372517582989555478159403783844777n;
const LIGHT = [-0.5, 0.5, Math.SQRT1_2]; // toward it; its irradiance is pi
const PAIRS = 100000;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// {pixels, lit, wi, wo}: pixels that the sphere covers, those with light, and the directions there;
// the lowest row first, as the renderer reads pictures.
function sphere() {
  const pixels = [], lit = [], wi = [], wo = [];
  const place = (k) => (((k + 0.5) * 2) / SIZE - 1) / (1 - MARGIN);
  for (let j = 0; j < SIZE; j++)
    for (let i = 0; i < SIZE; i++) {
      const x = place(i), y = place(j), squared = 1 - x * x - y * y;
      if (!(squared > 0)) continue;
      pixels.push(j * SIZE + i);
      const n = [x, y, Math.sqrt(squared)].map(Math.fround), across = Math.hypot(n[0], n[2]);
      const t = [n[2] / across, 0, -n[0] / across];
      const b = [n[1] * t[2], n[2] * t[0] - n[0] * t[2], -n[1] * t[0]];
      if (!(dot(n, LIGHT) > 0)) continue;
      lit.push(j * SIZE + i);
      wi.push(dot(t, LIGHT), dot(b, LIGHT), dot(n, LIGHT));
      wo.push(t[2], b[2], n[2]);
    }
  return { pixels, lit, wi: Float32Array.from(wi), wo: Float32Array.from(wo) };
}

// The first numbers in [0, 1) of NumPy's default generator with the seed 0 (PCG-XSL-RR of O'Neill 2014),
// which nacre compare draws.
function random(count) {
  const low = (1n << 64n) - 1n, numbers = new Float32Array(count);
  let state = STATE;
  for (let k = 0; k < count; k += 2) {
    state = BigInt.asUintN(128, state * 47026247687942121848144207491837523525n + INCREMENT);
    const mixed = (state >> 64n) ^ (state & low), by = state >> 122n;
    const bits = BigInt.asUintN(64, (mixed >> by) | (mixed << (64n - by)));
    [Number(bits & 0xffffffffn), Number(bits >> 32n)].forEach((x, half) => (numbers[k + half] = (x >>> 8) / 2 ** 24));
  }
  return numbers;
}

// Pairs of directions, both above the horizon.
function pairs() {
  const numbers = random(4 * PAIRS), wi = [], wo = [];
  for (let k = 0; k < PAIRS; k++) {
    const u = [0, 1, 2, 3].map((row) => numbers[row * PAIRS + k]);
    const [cosine, sine] = [Math.cos((u[0] * Math.PI) / 2), Math.sin((u[0] * Math.PI) / 2)];
    const [c, s] = [Math.cos(2 * Math.PI * u[1]), Math.sin(2 * Math.PI * u[1])], radius = Math.sin((u[2] * Math.PI) / 2);
    const d = [radius * Math.cos(2 * Math.PI * u[3]), radius * Math.sin(2 * Math.PI * u[3]), Math.cos((u[2] * Math.PI) / 2)];
    const [a, b] = [d, [-d[0], -d[1], d[2]]].map((v) => {
      const x = cosine * v[0] + sine * v[2];
      return [c * x - s * v[1], s * x + c * v[1], cosine * v[2] - sine * v[0]];
    });
    if (a[2] > 0 && b[2] > 0) [a, b].forEach((w, of) => (of ? wo : wi).push(...w));
  }
  return { wi: Float32Array.from(wi), wo: Float32Array.from(wo) };
}

export class Protocol {
  constructor(renderer) {
    Object.assign(this, { renderer, held: new Map() });
  }

  // {sphere, angles}: errors of the second material against the first.
  errors(truth, other) {
    this.places ??= { sphere: sphere(), pairs: pairs() };
    const both = [truth, other], found = both.map((each) => this.held.get(each) ?? this.values(each));
    this.held = new Map(both.map((each, k) => [each, found[k]]));
    const { renderer, places } = this, { gl } = renderer;
    const pictures = found.map(({ picture }) => renderer.texture([SIZE, SIZE], picture));
    const flip = new Flip(renderer, [SIZE, SIZE]);
    flip.update(pictures, 1, 1);
    const { toned, map } = flip.read();
    flip.free();
    pictures.forEach((texture) => gl.deleteTexture(texture));
    return {
      sphere: pictureErrors(toned, map, [SIZE, SIZE]),
      angles: angularErrors(found.map(({ angles }) => angles), places.pairs.wi),
    };
  }

  // A material's sphere, four numbers a pixel of which the fourth is 1 on it, and its values at pairs,
  // where the fourth is 1 at those that are valid.
  values(material) {
    const { renderer, places } = this, { pixels, lit, wi, wo } = places.sphere;
    const picture = new Float32Array(4 * SIZE * SIZE), values = renderer.values(material, wi, wo);
    for (const pixel of pixels) picture[4 * pixel + 3] = 1;
    lit.forEach((pixel, k) => {
      for (let c = 0; c < 3; c++) picture[4 * pixel + c] = values[4 * k + c] * wi[3 * k + 2] * Math.PI;
    });
    return { picture, angles: renderer.values(material, places.pairs.wi, places.pairs.wo, material.known ?? "1.0") };
  }
}
