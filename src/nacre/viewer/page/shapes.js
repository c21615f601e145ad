// Meshes with normals and tangents, as {vertices, indices, columns, rows}: position, normal,
// tangent of each vertex, of a grid of so many cells, row by row.

export function grid(columns, rows, point) {
  const vertices = new Float32Array((columns + 1) * (rows + 1) * 9);
  for (let j = 0, k = 0; j <= rows; j++)
    for (let i = 0; i <= columns; i++, k += 9) vertices.set(frame(point, i / columns, j / rows), k);
  return { vertices, indices: triangles(columns, rows), columns, rows };
}

export function triangles(columns, rows) {
  const indices = [];
  for (let j = 0; j < rows; j++)
    for (let i = 0; i < columns; i++) {
      const a = j * (columns + 1) + i, b = a + columns + 1;
      indices.push(a, a + 1, b, a + 1, b + 1, b);
    }
  return Uint32Array.from(indices);
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

export const TURN = 2 * Math.PI;

// A point turned about x, its top toward the viewer.
export function leaned([x, y, z], angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return [x, c * y - s * z, s * y + c * z];
}

const joined = (meshes) => {
  const starts = meshes.map((_, k) => meshes.slice(0, k).reduce((sum, each) => sum + each.vertices.length / 9, 0));
  return {
    vertices: Float32Array.from(meshes.flatMap((each) => [...each.vertices])),
    indices: Uint32Array.from(meshes.flatMap((each, k) => [...each.indices].map((i) => i + starts[k]))),
  };
};

// From 0 at -1 to 1 at 1, with two continuous derivatives.
function step(x) {
  const t = Math.min(Math.max((x + 1) / 2, 0), 1);
  return t * t * t * (t * (6 * t - 15) + 10);
}

// A ball with a groove around its tilted axis, held by a ring.
export const RADIUS = 0.84;
export const GROOVE = [1.08, 1.34];
const EDGE = 0.035, DEPTH = 0.13;

// Around the origin.
export function ball(u, v) {
  const theta = Math.PI * (1 - Math.min(Math.max(v, 1e-4), 1 - 1e-4)), phi = TURN * u;
  const open = step((theta - GROOVE[0]) / EDGE) - step((theta - GROOVE[1]) / EDGE), r = RADIUS * (1 - DEPTH * open);
  const [x, y, z] = leaned([r * Math.sin(theta) * Math.sin(phi), r * Math.cos(theta), r * Math.sin(theta) * Math.cos(phi)], 0.6);
  const c = Math.cos(0.42), s = Math.sin(0.42);
  return [c * x - s * z, y, s * x + c * z];
}

const raised = ([x, y, z]) => [x, y + 0.1, z];

export function turnedKnot(t) {
  const radius = 0.58 + 0.22 * Math.cos(3 * t);
  return [radius * Math.cos(2 * t), 0.3 * Math.sin(3 * t), radius * Math.sin(2 * t)];
}

// The tube along it.
export function tube(u, v) {
  const t = TURN * u, ahead = 1e-3;
  const forward = unit(minus(turnedKnot(t + ahead), turnedKnot(t - ahead)));
  const side = unit(cross(forward, [0, 1, 0])), up = cross(side, forward), phi = -TURN * v;
  return turnedKnot(t).map((x, k) => x + 0.16 * (Math.cos(phi) * side[k] + Math.sin(phi) * up[k]));
}

// A square cloth over a round table: what lies beyond its edge hangs down in folds.
const TABLE = 0.46, BEND = 0.05, FOLDS = 8;

export function cloth(u, v) {
  const x = 1.9 * (u - 0.5), z = 1.9 * (0.5 - v), r = Math.hypot(x, z), phi = Math.atan2(z, x);
  const fall = BEND * Math.log1p(Math.exp((r - TABLE) / BEND));
  const out = r - fall + 0.22 * fall + 0.15 * fall * Math.cos(FOLDS * phi + 0.6 * Math.sin(2 * phi));
  return [out * Math.cos(phi), 0.3 - 0.92 * fall, out * Math.sin(phi)].map((a) => 1.3 * a);
}

export const SHAPES = {
  ball: () => joined([
    grid(192, 384, (u, v) => leaned(raised(ball(u, v)), 0.12)),
    grid(128, 32, (u, v) => {
      const phi = TURN * u, theta = -TURN * v, out = 0.52 + 0.1 * Math.cos(theta);
      return leaned([out * Math.sin(phi), 0.1 * Math.sin(theta) - 0.74, out * Math.cos(phi)], 0.12);
    }),
  ]),
  cloth: () => grid(200, 200, (u, v) => leaned(cloth(u, v), 0.5)),
  knot: () => grid(384, 32, (u, v) => leaned(tube(u, v), 0.5)),
};
