// Meshes with normals and tangents, as {vertices, indices, columns, rows}: position, normal,
// tangent of each vertex, of a grid of so many cells, row by row.

function grid(columns, rows, point) {
  const vertices = new Float32Array((columns + 1) * (rows + 1) * 9), indices = [];
  for (let j = 0, k = 0; j <= rows; j++)
    for (let i = 0; i <= columns; i++, k += 9) vertices.set(frame(point, i / columns, j / rows), k);
  for (let j = 0; j < rows; j++)
    for (let i = 0; i < columns; i++) {
      const a = j * (columns + 1) + i, b = a + columns + 1;
      indices.push(a, a + 1, b, a + 1, b + 1, b);
    }
  return { vertices, indices: Uint32Array.from(indices), columns, rows };
}

// A point of a surface with its normal and its tangent along u, by differences.
function frame(point, u, v) {
  const step = 1e-4, at = point(u, v);
  const along = minus(point(u + step, v), point(u - step, v));
  const across = minus(point(u, v + step), point(u, v - step));
  const normal = unit(cross(along, across));
  return [...at, ...normal, ...unit(along)];
}

const minus = (a, b) => a.map((x, k) => x - b[k]);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = (a) => {
  const length = Math.hypot(...a) || 1;
  return a.map((x) => x / length);
};

const TURN = 2 * Math.PI;

// A lathe of a profile [radius, height] about +y, its tangent to the east.
const lathe = (profile, columns, rows) =>
  grid(columns, rows, (u, v) => {
    const [radius, height] = profile(v), phi = TURN * u;
    return [radius * Math.sin(phi), height, radius * Math.cos(phi)];
  });

// From the middle of the foot's underside to the top.
const FOOT = [[0, -0.95], [0.45, -0.95], [0.5, -0.93], [0.51, -0.88], [0.48, -0.84], [0.36, -0.8]];
const MIDDLE = 0.14, RADIUS = 0.83;

function ball(v) {
  const along = Math.min(Math.max(v, 1e-4), 1 - 1e-4), feet = FOOT.length - 1;
  if (along < 0.2) {
    const at = (along / 0.2) * feet, k = Math.min(Math.floor(at), feet - 1), part = at - k;
    return FOOT[k].map((x, axis) => x + (FOOT[k + 1][axis] - x) * part);
  }
  const start = Math.PI - Math.asin(0.36 / RADIUS), theta = start * (1 - (along - 0.2) / 0.8);
  const groove = step((theta - 1.08) / 0.05) - step((theta - 1.3) / 0.05);
  const radius = RADIUS * (1 - 0.13 * groove);
  return [radius * Math.sin(theta), MIDDLE + radius * Math.cos(theta)];
}

// From 0 at -1 to 1 at 1.
function step(x) {
  const t = Math.min(Math.max((x + 1) / 2, 0), 1);
  return t * t * t * (t * (6 * t - 15) + 10);
}

function knot(t) {
  const radius = 0.58 + 0.22 * Math.cos(3 * t);
  return [radius * Math.cos(2 * t), 0.3 * Math.sin(3 * t), radius * Math.sin(2 * t)];
}

export const SHAPES = {
  // A ball with a groove around it, on a foot.
  ball: () => lathe(ball, 192, 192),
  knot: () => grid(384, 32, (u, v) => {
    const t = TURN * u, step = 1e-3;
    const forward = unit(minus(knot(t + step), knot(t - step)));
    const side = unit(cross(forward, [0, 1, 0])), up = cross(side, forward), phi = -TURN * v;
    return knot(t).map((x, k) => x + 0.16 * (Math.cos(phi) * side[k] + Math.sin(phi) * up[k]));
  }),
  cloth: () => grid(160, 160, (u, v) => {
    const x = 1.9 * (u - 0.5), z = 1.9 * (0.5 - v), r = Math.hypot(x, z), phi = Math.atan2(z, x);
    const fall = Math.max(r - 0.42, 0);
    const folds = 0.12 * Math.min(fall * 2, 1) * Math.cos(7 * phi);
    return [x * (1 - 0.28 * fall), 0.42 - 0.9 * fall + folds, z * (1 - 0.28 * fall)];
  }),
};

// Folds that hang, deeper toward the hem: a point of a square cloth. Across it goes on as far as the
// cloth is long there, so that a texture is not stretched.
const FOLDS = 3, DEEPEST = 0.06, EDGE = 1.36;
const depthAt = (v) => DEEPEST * (1 - 0.75 * v);

// Lengths along a fold of some depth up to steps of it; all folds are alike.
function lengths(depth, steps = 24) {
  const phase = TURN * FOLDS, found = [0];
  for (let k = 0; k < steps; k++) found.push(found[k] + Math.hypot(1, phase * depth * Math.cos((TURN * (k + 0.5)) / steps)) / steps);
  return found;
}

function folded(u, v) {
  const along = lengths(depthAt(v)), steps = along.length - 1;
  const fold = Math.floor(u * FOLDS), rest = (u * FOLDS - fold) * along[steps];
  let k = 0;
  while (k < steps - 1 && along[k + 1] <= rest) k++;
  const x = (fold + (k + (rest - along[k]) / (along[k + 1] - along[k])) / steps) / FOLDS;
  return [x - 0.5, v - 0.5, depthAt(v) * Math.sin(TURN * FOLDS * x)].map((a) => EDGE * a);
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
