// Pictures of textures on surfaces in the light of a lamp.
//
// A texture is sums of weights, which vary from texel to texel, times functions of light and view, which
// vary slowly along a surface: vertices have the functions, pixels only read weights. Each frame is
// moved by part of a pixel, and added to those before until something changes.

import { summed, unfolded } from "./cosines.js";
import { EDGE, LAID } from "./laid.js";
import { SCALE } from "./renderer.js";
import { ADDED, TEXELS, VERTICES } from "./texture_shaders.js";
import { WHOLE } from "./webgl.js";

const PAUSE = 30; // milliseconds of work after which the page may draw and answer

export class Textured {
  // `context` is the page's renderer; `formulas` the GLSL that shaders of textures call.
  constructor(context, formulas) {
    Object.assign(this, { context, formulas, shapes: new Map(), frames: 0 });
    this.view = { shape: "plane", repeats: 1, zoom: 1.3, depth: 1, tilt: 30 };
  }

  // Take a texture to the graphics card: {facts, scales, levels, weights, functions, relief}. `progress`
  // is called with the fraction done; the page goes on in between.
  async loaded(facts, bytes, progress = () => {}) {
    const { lumas, chromas, resolution, width, height, scales, parts } = facts, count = lumas + chromas;
    const levels = [[width, height]];
    while (Math.max(...levels.at(-1)) > 1) levels.push(levels.at(-1).map((size) => Math.max(size >> 1, 1)));
    const edge = resolution * resolution, functions = new Uint8Array(count * edge * edge), drawn = { low: [], step: [] };
    let last = performance.now();
    await unfolded(bytes(parts.functions), scales.functions.step, resolution, async (found, k, low, step) => {
      functions.set(found, k * edge * edge);
      drawn.low.push(low);
      drawn.step.push(step);
      if (performance.now() - last < PAUSE) return;
      progress((k + 1) / count);
      await new Promise((done) => setTimeout(done));
      last = performance.now();
    });
    const weights = summed(bytes(parts.weights), count + chromas, levels);
    return {
      facts, scales: { weights: scales.weights, functions: drawn }, levels: levels.length,
      weights: this.layers(weights, count + chromas, levels, 16),
      functions: this.layers(functions, count, [[edge, edge]], 4),
      relief: this.relief(facts.relief, bytes),
    };
  }

  // A texture array of bytes, which are given number by number, the levels of each one after the other.
  // A pixel holds 4 of them, which are filtered, or 16, which are fetched.
  layers(values, count, levels, each) {
    const { context, context: { gl } } = this, size = values.length / count, depth = Math.ceil(count / each);
    const filtered = each === 4, format = filtered ? gl.RGBA8 : gl.RGBA32UI;
    const texture = context.storage(gl.TEXTURE_2D_ARRAY, format, [...levels[0], depth], { levels: levels.length, filtered });
    let start = 0;
    levels.forEach(([width, height], level) => {
      const texels = width * height, mixed = new Uint8Array(texels * depth * each);
      for (let k = 0; k < count; k++) {
        const from = k * size + start, to = Math.floor(k / each) * each * texels + (k % each);
        for (let j = 0; j < texels; j++) mixed[to + each * j] = values[from + j];
      }
      const layout = filtered ? [gl.RGBA, gl.UNSIGNED_BYTE, mixed] : [gl.RGBA_INTEGER, gl.UNSIGNED_INT, new Uint32Array(mixed.buffer)];
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, level, 0, 0, 0, width, height, depth, ...layout);
      start += texels;
    });
    return texture;
  }

  // Heights of half floats; a flat field where there are none.
  relief(facts, bytes) {
    const { context, context: { gl } } = this, size = facts ? [facts.width, facts.height] : [1, 1];
    const values = facts ? new Uint16Array(bytes(facts.part).buffer) : new Uint16Array(1);
    const texture = context.storage(gl.TEXTURE_2D, gl.R16F, size, { filtered: true });
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ...size, gl.RED, gl.HALF_FLOAT, values);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, axis, gl.REPEAT);
    return texture;
  }

  show(texture) {
    Object.assign(this, { texture, frames: 0 });
  }

  // Change {shape, repeats (over the plane's width), zoom, depth (of heights, 1 as they are),
  // tilt (degrees by which the top leans back)}.
  change(view) {
    Object.assign(this.view, view);
    this.frames = 0;
  }

  shape() {
    const { shape } = this.view;
    if (!this.shapes.has(shape)) {
      const { columns, rows, extent, closed, ...mesh } = LAID[shape]();
      this.shapes.set(shape, { ...this.context.mesh(mesh, [3, 3, 3]), cells: [columns, rows], extent, closed });
    }
    return this.shapes.get(shape);
  }

  // How often the texture lies along both edges of a shape.
  repeats({ extent: [width, height], closed }, aspect) {
    const wanted = (this.view.repeats * width) / EDGE;
    const across = closed ? Math.max(Math.round(wanted), 1) : wanted;
    return [across, (across * height * aspect) / width];
  }

  frame() {
    const { context, texture: { facts, scales, levels, weights, functions, relief }, view, formulas } = this;
    const { gl, scene, size } = context, shape = this.shape(), aspect = facts.width / facts.height;
    if (`${this.size}` !== `${size}`) this.resize(size);
    const program = context.program(VERTICES(facts, formulas), TEXELS(facts, formulas));
    const { bottom, top } = facts.relief ?? { bottom: 0, top: 0 };
    const values = {
      turn: leant(scene.turn, (view.tilt * Math.PI) / 180), shift: context.shift(this.frames), scale: SCALE * view.zoom,
      cells: shape.cells, repeats: this.repeats(shape, aspect), lamp: scene.lamp, irradiance: scene.irradiance,
      functions, weights, levels, relief, aspect, field: [bottom * view.depth, top * view.depth, view.depth],
      function_low: scales.functions.low, function_step: scales.functions.step,
      weight_low: scales.weights.low, weight_step: scales.weights.step,
    };
    context.begin(this.one);
    gl.enable(gl.CULL_FACE);
    for (const [side, hidden] of [[1, gl.BACK], [-1, gl.FRONT]]) {
      gl.cullFace(hidden);
      context.meshed(program, { ...values, side }, shape);
    }
    gl.disable(gl.CULL_FACE);
    const one = this.one.textures[0];
    this.latest = context.added(this.sums, this.frames, context.program(WHOLE, ADDED), { one });
    this.frames += 1;
  }

  resize(size) {
    const { context } = this;
    if (this.size) [this.one, ...this.sums].forEach((target) => context.free(target));
    Object.assign(this, { size: [...size], one: context.target(1, size, true), sums: context.pair(), frames: 0 });
  }
}

// A turn, column by column, of what leans back by an angle in radians.
function leant(turn, angle) {
  const up = turn.slice(3, 6), toward = turn.slice(6), c = Math.cos(angle), s = Math.sin(angle);
  return [...turn.slice(0, 3), ...up.map((y, k) => c * y - s * toward[k]), ...toward.map((z, k) => s * up[k] + c * z)];
}
