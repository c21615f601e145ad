// Scattered samples in a worker: as the table that the page draws, and as samples for a fit. See
// nacre.measured.interpolation and nacre.neural.scattered.

import { halves } from "./halves.js";
import { FileError } from "./tensors.js";

const NODES = [60, 30, 45]; // in theta_h, theta_d and phi_d
const INVALID = 0xbc00; // -1 as a half
const BLOCK = 16, VECTOR = 16, CHUNK = 16384, OWN = 0.5, WEIGHT = 100, FEWEST = 10, LEAST = 1e-3;
const SLICE = 8; // samples of each light that make a scan one of slices

// Samples in the kernel's memory: their addresses, and that of what interpolates them.
function placed(kernel, { count, wi, wo, rgb }) {
  const lights = new Map();
  for (let k = 0; k < count; k++) {
    const light = [Math.hypot(wi[4 * k], wi[4 * k + 1]), wi[4 * k + 2]].map((x) => Math.round(x * 1e4) / 1e4);
    lights.set(`${light}`, light);
  }
  let gap = 0;
  if (lights.size >= 2 && lights.size <= count / SLICE) {
    const ordered = [...lights.values()].sort((a, b) => a[1] - b[1]), far = ordered.slice(1).map((w, k) => Math.hypot(w[0] - ordered[k][0], w[1] - ordered[k][1]));
    gap = Math.max(...ordered.map((_, k) => Math.min(far[k - 1] ?? Infinity, far[k] ?? Infinity)));
  }
  const at = [wi, wo, rgb].map((numbers) => kernel.put(numbers)), scan = kernel.room(kernel.scan_bytes(count));
  kernel.scan_new(scan, ...at, count, gap);
  return { scan, at };
}

// The table of samples, as that of MERL.
export function tabulated(kernel, samples) {
  const { scan } = placed(kernel, samples), count = NODES.reduce((a, b) => a * b), pair = [0, 1].map(() => new Float32Array(4 * count));
  for (let n = 0; n < count; n++) {
    const i = Math.floor(n / (NODES[1] * NODES[2])), j = Math.floor(n / NODES[2]) % NODES[1], k = n % NODES[2];
    const h = ((i / NODES[0]) ** 2 * Math.PI) / 2, t = ((j / NODES[1]) * Math.PI) / 2, p = (k / NODES[2]) * Math.PI;
    const d = [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
    pair.forEach((w, of) => {
      const [x, y] = of ? [-d[0], -d[1]] : d;
      w.set([Math.cos(h) * x + Math.sin(h) * d[2], y, Math.cos(h) * d[2] - Math.sin(h) * x], 4 * n);
    });
  }
  const [wi, wo] = pair.map((w) => kernel.put(w)), rgb = kernel.room(VECTOR * count);
  kernel.scan_evaluate(scan, wi, wo, rgb, count);
  const found = kernel.numbers(rgb, 4 * count), f = new Float32Array(3 * count), missing = [];
  for (let n = 0; n < count; n++)
    if (found[4 * n + 3] && pair.every((w) => w[4 * n + 2] > 1e-6)) f.set(found.subarray(4 * n, 4 * n + 3), 3 * n);
    else missing.push(n);
  const grid = halves(f);
  for (const n of missing) grid.values.fill(INVALID, 3 * n, 3 * n + 3);
  return { kind: "merl", scale: grid.scale, nearest: false, grids: { nodes: { size: [...NODES].reverse(), channels: 3, values: grid.values } } };
}

const chosen = ({ wi, wo, rgb }, indices, flip = 1) => {
  const part = (of, y) => {
    const to = new Float32Array(4 * indices.length);
    indices.forEach((k, n) => to.set([of[4 * k], y * of[4 * k + 1], of[4 * k + 2], of[4 * k + 3]], 4 * n));
    return to;
  };
  return { count: indices.length, wi: part(wi, flip), wo: part(wo, flip), rgb: part(rgb, 1) };
};

const joined = (...parts) => {
  const list = (name) => {
    const to = new Float32Array(4 * parts.reduce((sum, { count }) => sum + count, 0));
    let at = 0;
    for (const part of parts) {
      to.set(part[name], at);
      at += 4 * part.count;
    }
    return to;
  };
  return { count: parts.reduce((sum, { count }) => sum + count, 0), wi: list("wi"), wo: list("wo"), rgb: list("rgb") };
};

const mirrored = (samples) => joined(samples, chosen(samples, Array.from({ length: samples.count }, (_, k) => k), -1));

// Samples between and beyond those of a scan.
function augmented(kernel, own, count, seed, report) {
  const { scan, at } = placed(kernel, own), random = kernel.random(seed, 5), [wi, wo, rgb] = [0, 1, 2].map(() => kernel.room(VECTOR * CHUNK));
  const found = { count, wi: new Float32Array(4 * count), wo: new Float32Array(4 * count), rgb: new Float32Array(4 * count) };
  for (let filled = 0; filled < count; ) {
    const kept = Math.min(kernel.scan_draw(random, at[0], at[1], own.count, wi, wo, CHUNK), count - filled);
    kernel.scan_evaluate(scan, wi, wo, rgb, kept);
    for (const [name, from] of [["wi", wi], ["wo", wo], ["rgb", rgb]]) found[name].set(kernel.numbers(from, 4 * kept), 4 * filled);
    for (let k = filled; k < filled + kept; k++) found.rgb[4 * k + 3] = 1;
    filled += kept;
    report({ sampled: filled / count });
  }
  return { scan, found };
}

// As `draw` in sampling.js, for a scan; and what the network is clamped to and judged by.
export function scattered(kernel, page, recipe, samples) {
  if (samples.count < FEWEST) throw new FileError(`${samples.count} samples are too few to fit a network to; measure at least ${FEWEST}`);
  const { seed } = recipe, order = (stream, count) => {
    const at = kernel.room(4 * count);
    kernel.random_order(kernel.random(seed, stream), at, count);
    return [...kernel.numbers(at, count, Int32Array)];
  };
  const shuffled = order(3, samples.count), out = Math.max(1, Math.round(recipe.held_out * samples.count)), by = (a, b) => a - b;
  const kept = chosen(samples, shuffled.slice(out).sort(by)), truth = chosen(samples, shuffled.slice(0, out).sort(by));
  const own = mirrored(kept), repeats = Math.max(1, Math.round((OWN * recipe.samples) / own.count));
  const { scan, found } = augmented(kernel, kept, Math.max(0, recipe.samples - repeats * own.count), seed, (news) => page.send(news));
  const all = joined(...Array(repeats).fill(own), found);
  const training = Math.ceil(all.count / BLOCK), validation = mirrored(truth), held = Math.ceil(validation.count / BLOCK);
  const length = (training + held) * BLOCK * 10, blocks = kernel.room(4 * length);
  // The last block is filled up by repeating samples from the start.
  const fill = (of, indices, first, count, constant) => {
    const padded = Array.from({ length: count * BLOCK }, (_, k) => indices[k % indices.length]), part = chosen(of, padded);
    const at = [part.wi, part.wo, part.rgb].map((numbers) => kernel.put(numbers));
    kernel.samples_fill(blocks + 640 * first, 0, padded.length, ...at, padded.length, 0, 0, 1, constant);
  };
  fill(all, order(4, all.count), 0, training, WEIGHT);
  fill(validation, Array.from({ length: validation.count }, (_, k) => k), training, held, 0);
  const highest = [0, 1, 2].map((c) => kept.rgb.reduce((most, x, k) => (k % 4 === c ? Math.max(most, x) : most), 0));
  const judge = (evaluate) => judged(kernel, scan, kept, truth, evaluate);
  return { blocks, length, training, held, sizes: [6, ...recipe.hidden, 3], angle: 0, highest, judge };
}

// How well held-out samples are predicted: by `evaluate`, and by the nearest sample.
function judged(kernel, scan, kept, truth, evaluate) {
  const { count } = truth, [wi, wo] = [truth.wi, truth.wo].map((w) => kernel.put(w)), nearest = new Float32Array(4 * count);
  for (let k = 0; k < count; k++) {
    const found = kernel.scan_nearest(scan, wi + VECTOR * k, wo + VECTOR * k);
    nearest.set(kept.rgb.subarray(4 * found, 4 * found + 4), 4 * k);
  }
  const errors = (values) => {
    const all = [];
    for (let k = 0; k < 4 * count; k++)
      if (k % 4 < 3) all.push(Math.abs(Math.max(values[k], 0) - Math.max(truth.rgb[k], 0)) / Math.max(truth.rgb[k], LEAST));
    all.sort((a, b) => a - b);
    const half = all.length >> 1;
    return [all.length % 2 ? all[half] : 0.5 * (all[half - 1] + all[half]), all.reduce((a, b) => a + b) / all.length];
  };
  const [median, mean] = errors(evaluate(wi, wo, count)), [other, others] = errors(nearest);
  return {
    held_out_samples: count, held_out_median_error: median, held_out_mean_error: mean,
    nearest_sample_median_error: other, nearest_sample_mean_error: others,
  };
}

// Weights of a network with one more layer, which keeps f_r at most at the highest values.
export function clamped(weights, sizes, highest) {
  const cap = highest.map((x) => Math.fround(Math.log1p(Math.fround(x)))), rows = sizes.at(-2), last = (rows + 1) * 3, start = weights.length - last;
  const below = Array.from(weights.subarray(start), (x, k) => (k < 3 * rows ? -x : Math.fround(cap[k - 3 * rows] - x)));
  return Float32Array.from([...weights.subarray(0, start), ...below, -1, 0, 0, 0, -1, 0, 0, 0, -1, ...cap]);
}
