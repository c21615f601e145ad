// What textures lie on.

import { TURN, grid } from "./shapes.js";

export const EDGE = 1.36; // of the plane

// Folds that hang, deeper toward the hem: a point of a square cloth. Across it goes on as far as the
// cloth is long there, so that a texture is not stretched.
const FOLDS = 3, DEEPEST = 0.05;
const depthAt = (v) => DEEPEST * (1 - 0.75 * v);

// Lengths along a fold of some depth up to steps of it; all folds are alike.
function lengths(depth, steps = 24) {
  const phase = TURN * FOLDS, found = [0];
  for (let k = 0; k < steps; k++) found.push(found[k] + Math.hypot(1, phase * depth * Math.cos((TURN * (k + 0.5)) / steps)) / steps);
  return found;
}

// Seen a little from the side and from below, where the hem shows the folds.
function aside([x, y, z]) {
  const [c, s, d, t] = [-0.4, 0.22].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]), near = c * z - s * x;
  return [c * x + s * z, d * y - t * near, d * near + t * y];
}

function folded(u, v) {
  const along = lengths(depthAt(v)), steps = along.length - 1;
  const fold = Math.floor(u * FOLDS), rest = (u * FOLDS - fold) * along[steps];
  let k = 0;
  while (k < steps - 1 && along[k + 1] <= rest) k++;
  const x = (fold + (k + (rest - along[k]) / (along[k + 1] - along[k])) / steps) / FOLDS;
  return aside([x - 0.5, v - 0.5, depthAt(v) * Math.sin(TURN * FOLDS * x)].map((a) => EDGE * a));
}

// What textures lie on, seen from the front: a grid with `extent`, its width and height as it lies flat;
// `closed` where it meets itself, so that a texture has to go around a whole number of times.
export const LAID = {
  plane: () => ({ ...grid(48, 48, (u, v) => [EDGE * (u - 0.5), EDGE * (v - 0.5), 0]), extent: [EDGE, EDGE] }),
  cylinder: () => ({
    ...grid(96, 12, (u, v) => [0.6 * Math.sin(TURN * (u - 0.5)), 1.5 * (v - 0.5), 0.6 * Math.cos(TURN * (u - 0.5))]),
    extent: [0.6 * TURN, 1.5], closed: true,
  }),
  cloth: () => ({ ...grid(160, 40, folded), extent: [EDGE * lengths(depthAt(0.5)).at(-1), EDGE] }),
};
