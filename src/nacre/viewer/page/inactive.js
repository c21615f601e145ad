// Units of a network that are never active, which exports leave out: see nacre.neural.prune.

import { replayed } from "./trace.js";

const PAIRS = 1 << 16, MARGIN = 0.02;
const MULTIPLIER = 0x2360ed051fc65da44385df649fccf645n, WHOLE = (1n << 128n) - 1n, LOW = (1n << 64n) - 1n;

const seen = new WeakMap(); // the last inputs at the pairs, with their open numbers, by formula

// Layers without the units that stay below zero, with a margin, at all pairs of directions. `held` are the
// page's facts for exports; `recorded` is the formula of the inputs, and `datum` gives its numbers.
export function active(layers, squared, held, recorded, datum) {
  const open = `${recorded.operations.map(([name, place]) => (name === "datum" ? datum(place) : ""))}`;
  if (seen.get(recorded)?.open !== open) seen.set(recorded, { open, at: inputs(held, recorded, datum) });
  const { at } = seen.get(recorded);
  let { values } = at;
  const kept = layers.map(({ weights, biases }) => ({ weights, biases }));
  for (let k = 0; k < layers.length - 1; k++) {
    const { weights, biases } = kept[k], rows = biases.length;
    const sums = Array.from(biases, (bias, j) => values.reduce((sum, x, i) => {
      const weight = weights[i * rows + j];
      for (let p = 0; p < at.count; p++) sum[p] += weight * x[p];
      return sum;
    }, new Float32Array(at.count).fill(bias)));
    const lives = sums.map((sum) => {
      let low = Infinity, high = -Infinity;
      for (const x of sum) {
        if (x < low) low = x;
        if (x > high) high = x;
      }
      return high > -MARGIN * (high - low);
    });
    if (!lives.includes(true)) lives[0] = true;
    const rest = lives.flatMap((lives, j) => (lives ? [j] : [])), after = kept[k + 1], wide = after.biases.length;
    const before = weights.length / rows;
    kept[k] = {
      weights: Float32Array.from({ length: before * rest.length }, (_, n) => weights[Math.floor(n / rest.length) * rows + rest[n % rest.length]]),
      biases: Float32Array.from(rest, (j) => biases[j]),
    };
    kept[k + 1] = { ...after, weights: Float32Array.from(rest.flatMap((j) => Array.from(after.weights.slice(j * wide, (j + 1) * wide)))) };
    values = rest.map((j) => sums[j].map((x) => (x > 0 ? (squared ? x * x : x) : 0)));
  }
  return kept;
}

// Inputs of the network at visible pairs of all three kinds: columns, and how many pairs.
function inputs({ pairs, random }, recorded, datum) {
  const draw = generator(random);
  const four = () => Array.from({ length: 4 }, () => Float32Array.from({ length: PAIRS }, draw));
  const kinds = [evaluated(pairs.angles, four()), evaluated(pairs.cosines, four())], u = four();
  kinds.push([nearHorizon(u[0], u[1]), nearHorizon(u[2], u[3])]);
  const [wi, wo] = [0, 1].map((side) => [0, 1, 2].map((axis) => joined(kinds.map((kind) => kind[side][axis]))));
  const above = [];
  for (let k = 0; k < wi[2].length; k++) if (wi[2][k] > 0 && wo[2][k] > 0) above.push(k);
  const given = [...wi, ...wo].map((column) => Float32Array.from(above, (k) => column[k]));
  const place = recorded.operations.findIndex(([name]) => name === "dense");
  const head = { operations: recorded.operations.slice(0, place), results: [recorded.operations[place][4]] };
  return { values: evaluated(replayed(head, datum), given)[0], count: above.length };
}

// Directions whose cosines are uniform in their logarithm, from 1 down to 10^-4.
function nearHorizon(u, v) {
  const cosine = u.map((x) => 1e-4 ** x), sine = cosine.map((x) => Math.sqrt(Math.max(1 - x * x, 0)));
  return [sine.map((x, k) => x * Math.cos(2 * Math.PI * v[k])), sine.map((x, k) => x * Math.sin(2 * Math.PI * v[k])), cosine];
}

function joined(parts) {
  const found = new Float32Array(parts.reduce((sum, { length }) => sum + length, 0));
  let start = 0;
  for (const part of parts) {
    found.set(part, start);
    start += part.length;
  }
  return found;
}

// Numbers in [0, 1) of NumPy's generator (PCG64, O'Neill 2014) from a state on, in single precision.
function generator([state, increment]) {
  let now = BigInt(state), spare = null;
  const add = BigInt(increment);
  return () => {
    let bits = spare;
    if (spare === null) {
      now = (now * MULTIPLIER + add) & WHOLE;
      const mixed = ((now >> 64n) ^ now) & LOW, turn = now >> 122n;
      const drawn = ((mixed >> turn) | (mixed << (64n - turn))) & LOW;
      bits = Number(drawn & 0xffffffffn);
      spare = Number(drawn >> 32n);
    } else spare = null;
    return (bits >>> 8) / (1 << 24);
  };
}

const FUNCTIONS = {
  add: (a, b) => a + b, sub: (a, b) => a - b, mul: (a, b) => a * b, div: (a, b) => a / b, neg: (a) => -a,
  min: (a, b) => Math.min(a, b), max: (a, b) => Math.max(a, b),
  lt: (a, b) => a < b, le: (a, b) => a <= b, gt: (a, b) => a > b, ge: (a, b) => a >= b, and: (a, b) => a && b, or: (a, b) => a || b,
  where: (test, a, b) => (test ? a : b), sqrt: Math.sqrt, floor: Math.floor, abs: Math.abs, exp: Math.exp, log: Math.log,
};

// Results of operations on columns of numbers.
function evaluated({ operations, results }, given) {
  const values = [], count = given[0].length;
  for (const [name, ...parts] of operations) {
    if (name === "input") values.push(given[parts[0]]);
    else if (name === "number") values.push(new Float32Array(count).fill(parts[0]));
    else {
      const [a, b, c] = parts.map((part) => values[part]), f = FUNCTIONS[name], found = new Float32Array(count);
      for (let k = 0; k < count; k++) found[k] = f(a[k], b?.[k], c?.[k]);
      values.push(found);
    }
  }
  return results.map((result) => result.map((number) => values[number]));
}
