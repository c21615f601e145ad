// Light from all around, and directions that follow it.
//
// Maps are as nacre's: +y is up; columns are centered at (i + 1/2) / width of the azimuth
// atan2(x, -z), rows lie at j / (height - 1) of the polar angle, poles included. Directions are drawn
// by the inverse of the distribution of light over texels at the points of an additive recurrence,
// so that any run of them covers the light evenly.

import { FIRST, SECOND } from "./sequence.js";

const EDGE = 256; // directions along an edge of their texture
const FLOOR = 0.02; // of mean light in every texel

// {texels, toward, radiance, edge, floor}: RGBA with the density over solid angle as alpha; directions with
// their densities; the light from each; and the irradiance of level ground.
export function tables(pixels, width, height) {
  const edges = Float64Array.from({ length: height + 1 }, (_, j) =>
    Math.cos((Math.PI * Math.min(Math.max(j - 0.5, 0), height - 1)) / (height - 1)));
  const angles = Float64Array.from({ length: height }, (_, j) => ((edges[j] - edges[j + 1]) * 2 * Math.PI) / width);
  const count = width * height;
  // What is shone by a texel and its neighbors, which shine into it between their centers.
  const across = new Float64Array(count), parts = new Float64Array(count), bright = new Float64Array(width + 2);
  for (let row = 0; row < height; row++) {
    const start = row * width;
    for (let i = 0, k = 3 * start; i < width; i++, k += 3) bright[i + 1] = 0.2126 * pixels[k] + 0.7152 * pixels[k + 1] + 0.0722 * pixels[k + 2];
    bright[0] = bright[width];
    bright[width + 1] = bright[1];
    for (let i = 0; i < width; i++) across[start + i] = 0.25 * bright[i] + 0.5 * bright[i + 1] + 0.25 * bright[i + 2];
  }
  for (let row = 0; row < height; row++) {
    const start = row * width, above = Math.max(row - 1, 0) * width, below = Math.min(row + 1, height - 1) * width;
    for (let i = 0; i < width; i++) parts[start + i] = 0.25 * across[above + i] + 0.5 * across[start + i] + 0.25 * across[below + i];
  }
  const mean = parts.reduce((sum, part, k) => sum + part * angles[Math.floor(k / width)], 0) / (4 * Math.PI);
  for (let k = 0; k < count; k++) parts[k] = (parts[k] + FLOOR * Math.max(mean, 1e-9)) * angles[Math.floor(k / width)];
  const rows = new Float64Array(height + 1), columns = new Float64Array(height * (width + 1));
  for (let j = 0; j < height; j++) {
    const start = j * (width + 1);
    for (let i = 0; i < width; i++) columns[start + i + 1] = columns[start + i] + parts[j * width + i];
    rows[j + 1] = rows[j] + columns[start + width];
  }
  const total = rows[height], texels = new Float32Array(4 * count);
  for (let k = 0; k < count; k++) {
    for (let c = 0; c < 3; c++) texels[4 * k + c] = pixels[3 * k + c];
    texels[4 * k + 3] = parts[k] / total / angles[Math.floor(k / width)];
  }
  const toward = new Float32Array(4 * EDGE * EDGE), radiance = new Float32Array(4 * EDGE * EDGE);
  for (let k = 0; k < EDGE * EDGE; k++) {
    const [j, v] = place(rows, 0, height, ((0.5 + k * FIRST) % 1) * total);
    const start = j * (width + 1);
    const [i, u] = place(columns, start, start + width, ((0.5 + k * SECOND) % 1) * columns[start + width]);
    const column = i - start, y = edges[j] + (edges[j + 1] - edges[j]) * v;
    const phi = (2 * Math.PI * (column + u)) / width, r = Math.sqrt(Math.max(1 - y * y, 0));
    toward.set([r * Math.sin(phi), y, -r * Math.cos(phi), texels[4 * (j * width + column) + 3]], 4 * k);
    radiance.set(between(pixels, width, height, column + u - 0.5, (Math.acos(y) / Math.PI) * (height - 1)), 4 * k);
  }
  const floor = [0, 1, 2].map((c) => {
    let sum = 0;
    for (let k = 0; k < count; k++) {
      const row = Math.floor(k / width);
      sum += pixels[3 * k + c] * angles[row] * Math.max(Math.cos((Math.PI * row) / (height - 1)), 0);
    }
    return sum;
  });
  return { texels, toward, radiance, edge: EDGE, floor };
}

// Which cell of running sums from `low` to `high` holds a value, and where in it.
function place(sums, low, high, value) {
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sums[middle] <= value) low = middle;
    else high = middle;
  }
  return [low, Math.min((value - sums[low]) / (sums[low + 1] - sums[low]), 1 - 1e-9)];
}

// Bilinear, around and down.
function between(pixels, width, height, x, y) {
  const i = Math.floor(x), j = Math.min(Math.floor(y), height - 2), u = x - i, v = y - j;
  const at = (a, b, c) => pixels[3 * ((j + b) * width + ((((i + a) % width) + width) % width)) + c];
  return [0, 1, 2].map((c) =>
    (1 - v) * ((1 - u) * at(0, 0, c) + u * at(1, 0, c)) + v * ((1 - u) * at(0, 1, c) + u * at(1, 1, c)));
}
