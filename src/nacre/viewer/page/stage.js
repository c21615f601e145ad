// A stage for shapes: a base on a paper ground that light falls on, and a camera that looks down at it.
//
// Shapes stand with their origin at the world's. For shadows they are simple bodies: spheres
// (center, radius), and a base (radius, top), which is a cylinder on the ground.

import { GROOVE, RADIUS, TURN, ball, cloth, grid, tube, turnedKnot } from "./shapes.js";

export const FLOOR = -1.12;
export const PAPER = 0.42; // its albedo
export const BODIES = 20; // spheres at most
const BASE = [0.6, -0.88], BEVEL = 0.045;
const TARGET = [0, -0.1, 0], DISTANCE = 7.6, PITCH = 0.2, PITCHES = [0.06, 1.35];
const FIELD = Math.tan(0.19); // of half the picture's smaller edge

const lift = (shape, scale, up) => (u, v) => shape(u, v).map((x, k) => scale * x + (k === 1 ? up : 0));
const KNOT_SCALE = 1.3, KNOT_UP = FLOOR + 0.46 * KNOT_SCALE, LINKS = 20;
const CLOTH_SCALE = 1.2, CLOTH_UP = -0.3;

// {mesh, bodies, base, groove}: the groove is the axis of a ball and cosines of its edges.
export const STAGED = {
  sphere: { mesh: () => grid(112, 56, round), bodies: [[0, 0, 0, 1]], base: BASE },
  ball: {
    mesh: () => grid(112, 96, (u, v) => ball(u, closer(v)).map((x) => x / RADIUS)),
    bodies: [[0, 0, 0, 1]], base: BASE, groove: [...axis(), ...GROOVE.map(Math.cos)],
  },
  cloth: {
    mesh: () => grid(120, 120, lift(cloth, CLOTH_SCALE, CLOTH_UP)),
    bodies: [], base: [0.5, 0.36 * CLOTH_SCALE + CLOTH_UP - 0.03],
  },
  knot: {
    mesh: () => grid(256, 24, lift(tube, KNOT_SCALE, KNOT_UP)),
    bodies: Array.from({ length: LINKS }, (_, k) => {
      const [x, y, z] = turnedKnot((TURN * k) / LINKS);
      return [KNOT_SCALE * x, KNOT_SCALE * y + KNOT_UP, KNOT_SCALE * z, 0.17 * KNOT_SCALE];
    }),
    base: [0, FLOOR],
  },
};

function round(u, v) {
  const theta = Math.PI * (1 - Math.min(Math.max(v, 1e-4), 1 - 1e-4)), phi = TURN * u;
  return [Math.sin(theta) * Math.sin(phi), Math.cos(theta), Math.sin(theta) * Math.cos(phi)];
}

// Rows of the ball's mesh are dense where it bends: software draws few triangles sooner.
function closer(v) {
  const places = [[0, 0], [0.3, 0.55], [0.7, 0.69], [1, 1]], k = v < 0.3 ? 0 : v < 0.7 ? 1 : 2;
  const [[a, from], [b, to]] = [places[k], places[k + 1]];
  return from + ((to - from) * (v - a)) / (b - a);
}

// The pole of the ball's groove.
function axis() {
  return ball(0, 1).map((x) => x / RADIUS);
}

// A cylinder with a rounded edge.
const baseOf = ([radius, top]) => grid(80, 20, (u, v) => {
  const phi = TURN * u, bend = Math.min(Math.max((v - 0.3) / 0.4, 0), 1) * (Math.PI / 2);
  const down = Math.max(0.3 - v, 0) / 0.3, inward = Math.max(v - 0.7, 0) / 0.3;
  const out = (radius - BEVEL + BEVEL * Math.cos(bend)) * (1 - 0.999 * inward);
  const height = top - BEVEL + BEVEL * Math.sin(bend);
  return [out * Math.sin(phi), height + (FLOOR - height) * down, out * Math.cos(phi)];
});

// What the shaders need of a camera, for the scene's `turn` (see turning.js): its place, the columns of
// its axes (right, up, back), how many halves of the picture a unit at distance 1 takes, and how far the
// shape is turned about +y.
export function camera(turn, [width, height]) {
  const pitch = Math.min(Math.max(PITCH + Math.atan2(turn[5], turn[4]), PITCHES[0]), PITCHES[1]);
  const c = Math.cos(pitch), s = Math.sin(pitch), smaller = Math.min(width, height);
  return {
    eye: [TARGET[0], TARGET[1] + DISTANCE * s, TARGET[2] + DISTANCE * c, 1],
    view: [1, 0, 0, 0, c, -s, 0, s, c],
    focal: [width, height].map((length) => smaller / (length * FIELD)),
    turn: [turn[0], 0, -turn[6], 0, 1, 0, turn[6], 0, turn[0]],
  };
}

// What is drawn of a scene on its stage: {mesh, base, values}, functions that make meshes, and what shaders
// need. `floor` is the light of paper where nothing stands.
export function standing({ shape, turn, surroundings }, size, floor) {
  const { bodies, base, groove, mesh } = STAGED[shape], values = camera(turn, size);
  const whole = turned(values.turn, bodies), [x, y, z, ...edges] = groove ?? [0, 1, 0, 2, -2];
  return {
    mesh, base: base[0] ? () => baseOf(base) : null,
    values: {
      ...values, bodies: [...whole.flat(), ...Array(4 * (BODIES - bodies.length)).fill(0)], bodied: bodies.length, base,
      groove: turned(values.turn, [[x, y, z, 0]])[0].slice(0, 3), edges, paper: floor.map((light) => surroundings * light),
    },
  };
}

// Points or directions (their first three numbers) turned by a matrix of columns.
const turned = (m, all) =>
  all.map(([x, y, z, more]) => [...[0, 1, 2].map((k) => m[k] * x + m[3 + k] * y + m[6 + k] * z), more]);

// Where the middle of a staged shape is seen, and how large a unit is there, in halves of the height.
export function middle(turn, size) {
  const { eye, view, focal } = camera(turn, size);
  const along = view[7] * eye[1] + view[8] * eye[2], up = -(view[4] * eye[1] + view[5] * eye[2]);
  return { y: (up / along) * focal[1], radius: focal[1] / along };
}
