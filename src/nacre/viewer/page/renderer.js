// Pictures of shapes in materials: direct light of an environment and of a lamp, without shadows; or on
// a stage, where simple bodies cast some (see stage.js).
//
// Each frame draws the shape's points anew, moved by part of a pixel, and adds some directions of
// light for each. Sums are kept in single precision until something changes. A material is
// {glsl, textures}: functions material_eval, material_sample and material_pdf, and the textures that
// they fetch from, by name.

import { tables } from "./light.js";
import { LIT } from "./lit.js";
import { pixelsOf } from "./maps.js";
import { Meter } from "./meter.js";
import { moved } from "./sequence.js";
import { FRAMES, POINTS, SHOWN, SPHERE, VALUES, VERTEX } from "./shaders.js";
import { SHAPES } from "./shapes.js";
import { Smoothing } from "./smooth.js";
import { PAPER, standing } from "./stage.js";
import { BASE, MATERIAL, STAGE_POINTS } from "./stage_shaders.js";
import { Context, WHOLE } from "./webgl.js";

const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];

export const SCALE = 0.97; // of shapes, which fit the unit sphere

const SHOWING = ["exposure", "ground", "film"]; // what changes no sums

export class Renderer extends Context {
  constructor(canvas) {
    super(canvas);
    this.shapes = new Map();
    this.pictures = [];
    this.meter = new Meter(this);
    this.smoothing = new Smoothing(this);
    this.pairs = 2;
    this.scene = {
      shape: "sphere", turn: [1, 0, 0, 0, 1, 0, 0, 0, 1], rotation: 0, surroundings: 1,
      lamp: [-0.5, 0.5, Math.SQRT1_2, 0], irradiance: [0, 0, 0], exposure: 1, ground: [0.1, 0.1, 0.1], backing: 1, still: false,
      stage: false, film: false,
    };
    this.resize(canvas.width, canvas.height);
  }

  resize(width, height) {
    Object.assign(this.canvas, { width, height });
    this.stale = true; // the canvas is empty now
    for (const target of [this.points, ...this.pictures.flatMap((each) => each.sums)]) if (target) this.free(target);
    this.size = [width, height];
    this.points = this.target(3, this.size, true);
    for (const picture of this.pictures) picture.sums = this.pair();
    this.restart();
  }

  pair() {
    return [0, 1].map(() => this.target(1, this.size));
  }

  restart() {
    this.frames = this.drawn = 0;
  }

  // Change the scene: {shape, turn (3 x 3, columns), rotation, surroundings, lamp, irradiance, exposure,
  // ground, backing (its opacity), still (points stay at the middles of pixels), stage, film}.
  change(scene) {
    Object.assign(this.scene, scene);
    this.stale = true;
    if (Object.keys(scene).some((name) => !SHOWING.includes(name))) this.restart();
  }

  // Light the scene by an environment of the page, whose parts are `bytes`.
  light(map, bytes) {
    const { width, height } = map;
    const { texels, toward, radiance, edge, floor } = tables(pixelsOf(bytes(map.part), map), width, height);
    for (const texture of Object.values(this.environment ?? {})) this.gl.deleteTexture(texture);
    this.environment = {
      texels: this.texture([width, height], texels),
      toward: this.texture([edge, edge], toward),
      radiance: this.texture([edge, edge], radiance),
    };
    this.floor = floor.map((each) => (PAPER * each) / Math.PI);
    this.paper = 0.2126 * this.floor[0] + 0.7152 * this.floor[1] + 0.0722 * this.floor[2];
    this.meter.forget();
    this.restart();
  }

  // Draw these materials from now on, each in a picture of its own.
  show(...materials) {
    const programs = materials.map(({ glsl }) => this.program(WHOLE, LIT(glsl)));
    while (this.pictures.length > materials.length) this.pictures.pop().sums.forEach((each) => this.free(each));
    while (this.pictures.length < materials.length) this.pictures.push({ sums: this.pair() });
    this.pictures.forEach((picture, k) =>
      Object.assign(picture, { program: programs[k], textures: materials[k].textures ?? {} }));
    this.restart();
  }

  frame() {
    const { turn, lamp, irradiance, rotation, surroundings, stage } = this.scene, shift = this.shift(this.frames);
    const around = stage ? this.staged(shift) : { staged: false, eye: [0, 0, 1, 0] };
    if (!stage) this.place({ turn, shift, scale: SCALE });
    const [normals, tangents, points] = this.points.textures;
    const pairs = this.frames ? this.pairs : 1;
    for (const picture of this.pictures) {
      picture.latest = this.added(picture.sums, this.frames, picture.program, {
        normals, tangents, points, ...this.environment, ...picture.textures, ...around,
        drawn: this.drawn, pairs, spin: [Math.cos(rotation), Math.sin(rotation)], lamp, irradiance, surroundings,
      });
    }
    this.frames += 1;
    this.drawn += pairs;
  }

  // By how much a frame's points are moved, in halves of the picture.
  shift(frame) {
    return moved(this.scene.still ? 0 : frame).map((x, k) => (2 * x) / this.size[k]);
  }

  // Draw a frame with a program that adds it to what is `before`; returns which of the two sums has it.
  added(sums, frame, program, values) {
    const [before, after] = frame % 2 ? sums : [...sums].reverse();
    if (!frame) this.clear(before);
    this.fill(after, program, { before: before.textures[0], ...values });
    return after;
  }

  // Draw the points of the stage; returns what else its light depends on.
  staged(shift) {
    const { mesh, base, values } = standing(this.scene, this.size, this.floor), { shape } = this.scene;
    const program = this.program(STAGE_POINTS(VERTEX), FRAMES);
    this.begin(this.points);
    this.meshed(program, { ...values, shift, kind: MATERIAL }, this.shape(`staged ${shape}`, mesh));
    if (base) this.meshed(program, { ...values, shift, turn: UPRIGHT, kind: BASE }, this.shape(`base of ${shape}`, base));
    return { ...values, shift, staged: true };
  }

  // A mesh by name, made when it is first asked for.
  shape(name, mesh) {
    if (!this.shapes.has(name)) this.shapes.set(name, this.mesh(mesh(), [3, 3, 3]));
    return this.shapes.get(name);
  }

  // Draw the points of the shape; the sphere's are exact.
  place(values) {
    const { shape } = this.scene;
    if (shape === "sphere") {
      this.clear(this.points);
      this.fill(this.points, this.program(WHOLE, SPHERE), { ...values, size: this.size });
      return;
    }
    this.begin(this.points);
    this.meshed(this.program(POINTS, FRAMES), { ...values, kind: MATERIAL }, this.shape(shape, SHAPES[shape]));
  }

  // Show a sum on the canvas, which is then no longer stale; `count` is its sum where it is opaque. On a
  // stage it is exposed as it suits the material, and smoothed while it needs that.
  present(sum = this.pictures[0].latest, count = this.drawn) {
    const { exposure, ground, backing, film, stage } = this.scene;
    this.stale = false;
    const gains = stage ? this.meter.of(this.pictures[0], this.environment, this.paper) : this.meter.one;
    const shown = stage ? this.smoothing.of(sum, this.points.textures[0], count, { exposure, gains }) : sum;
    this.fill(null, this.program(WHOLE, SHOWN), { sums: shown.textures[0], gains, exposure, ground, backing, film, count });
  }

  // Whether everything before the last `mark` is drawn.
  done() {
    const { gl } = this;
    if (this.fence) {
      if (gl.clientWaitSync(this.fence, gl.SYNC_FLUSH_COMMANDS_BIT, 0) === gl.TIMEOUT_EXPIRED) return false;
      gl.deleteSync(this.fence);
      this.fence = null;
    }
    return true;
  }

  mark() {
    this.fence ??= this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  }

  // Sums of radiance and of directions of a picture, four numbers a pixel, the lowest row first.
  sums(picture = this.pictures[0]) {
    return this.read(picture.latest);
  }

  // Reflectance and `more`, the density of samples, four numbers a pair, of directions with `each`
  // numbers.
  values({ glsl, textures = {} }, wi, wo, more = "material_pdf(wi, wo)", each = 3) {
    const count = wi.length / each, width = Math.min(count, 1024), height = Math.ceil(count / width);
    const held = [wi, wo].map((w) => {
      const padded = new Float32Array(4 * width * height);
      for (let k = 0; k < count; k++) for (let c = 0; c < 3; c++) padded[4 * k + c] = w[each * k + c];
      return this.texture([width, height], padded);
    });
    const target = this.target(1, [width, height]);
    this.fill(target, this.program(WHOLE, VALUES(glsl, more)), { toward: held[0], from: held[1], ...textures });
    const found = this.read(target).subarray(0, 4 * count);
    this.free(target);
    held.forEach((texture) => this.gl.deleteTexture(texture));
    return found;
  }
}
