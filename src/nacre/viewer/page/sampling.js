// Samples of a reflectance for a fit, as nacre.sampling.draw_samples draws them, by a worker that has
// directions evaluated by the page; and lobes that sample a material.

import { FileError } from "./tensors.js";

const CHUNK = 32768, BLOCK = 16, HOPELESS = 64, LOOKED = 32768, VECTOR = 16;
const STEP = 3, WORTH = 0.98; // of angles in degrees; see nacre.neural.axes

// A mixture of lobes for values at the directions that the kernel proposes, which `evaluate` finds.
export async function lobes(kernel, isotropic, evaluate) {
  const points = kernel.lobes_points(), moment = kernel.room(kernel.lobes_bytes()), mixture = kernel.room(8 * 37);
  const [wi, wo, rgb] = [0, 1, 2].map(() => kernel.room(VECTOR * points));
  kernel.lobes_propose(moment, kernel.random(0), wi, wo);
  const values = await evaluate(wi, wo, points);
  kernel.numbers(rgb, values.length).set(values);
  kernel.lobes_fit(moment, rgb, isotropic, mixture);
  return mixture;
}

// How the kernel knows what a network sees of directions.
export const kindOf = ({ inputs }, isotropic) => (inputs === "enhanced" ? 2 : 0) + (isotropic ? 0 : 1);

const digits = (x) => Number(x.toPrecision(4));

// The description of a mixture's numbers as files have it, four digits of each.
export function described([lobes, count, fixed, angle, ...lists]) {
  if (!lobes) return { kind: "cosine" };
  const list = (k) => Array.from({ length: count }, (_, m) => lists[k * count + m]), values = (k) => list(k).map(digits);
  const parts = (k) => list(k).map((x) => digits(Math.round(x * 1e4) / 1e4));
  const lobe = (k) => ({ share: parts(k), roughness: values(k + 1), across: values(k + 2), shift: values(k + 3) });
  const all = Array.from({ length: lobes }, (_, k) => lobe(3 + 4 * k));
  return {
    kind: "diffuse + GGX", lobes: all, uniform: parts(1), squared: parts(2), cosines: list(0), angle: fixed ? digits(angle) : null,
  };
}

// {blocks, length, training, held, sizes, angle}: samples in blocks, so many to train on and to hold out.
export async function draw(kernel, page, recipe, isotropic) {
  const ask = (wi, wo, count) => {
    const pair = [wi, wo].map((at) => kernel.numbers(at, 4 * count).slice());
    page.send({ pair }, pair.map(({ buffer }) => buffer));
  };
  const mixture = await lobes(kernel, isotropic, (...of) => {
    ask(...of);
    return page.next();
  });
  const room = recipe.samples, rows = isotropic ? 6 : 8, blocks = Math.ceil(room / BLOCK), length = blocks * BLOCK * (rows + 4);
  const place = kernel.room(4 * length), numbers = kernel.room(4 * 6 * CHUNK);
  const chunk = () => Object.assign([0, 1, 2].map(() => kernel.room(VECTOR * CHUNK)), { count: 0 });
  const drawn = (k, to) => {
    to.count = kernel.samples_draw(kernel.random(recipe.seed, k), numbers, CHUNK, isotropic, mixture, to[0], to[1]);
    ask(to[0], to[1], to.count);
    return to;
  };
  const fill = (filled, { count, ...of }, angle) =>
    kernel.samples_fill(place, filled, room, of[0], of[1], of[2], count, kindOf(recipe, isotropic), angle, recipe.gain, 0);
  // Axes are found from the first samples, which wait for them.
  let filled = 0, angle = isotropic ? 0 : undefined, waiting = [], looked = 0;
  const free = [chunk(), chunk()];
  let ahead = drawn(0, free.pop());
  for (let k = 1; filled < room; k++) {
    if (k > HOPELESS && filled < (k * CHUNK) / 1000) throw new FileError("hardly any sample is valid");
    const own = ahead, next = drawn(k, free.pop() ?? chunk()), values = await page.next();
    ahead = next;
    kernel.numbers(own[2], values.length).set(values);
    if (angle === undefined) {
      waiting.push(own);
      looked += own.count;
      if (looked < LOOKED && looked < room) continue;
      angle = axis(kernel, waiting);
      for (const each of waiting) filled = fill(filled, each, angle);
      free.push(...waiting.splice(0));
    } else {
      filled = fill(filled, own, angle);
      free.push(own);
    }
    page.send({ sampled: filled / room });
  }
  await page.next();
  const held = Math.max(1, Math.round(recipe.held_out * blocks)), sizes = [rows, ...recipe.hidden, 3];
  return { blocks: place, length, training: blocks - held, held, sizes, angle };
}

// The azimuth of the axis that enhanced inputs turn to x, in radians.
function axis(kernel, chunks) {
  const parts = [0, 1, 2].map((part) => kernel.room(VECTOR * LOOKED)), known = new Map();
  let count = 0;
  for (const chunk of chunks) {
    const arrays = [0, 1, 2].map((part) => kernel.numbers(chunk[part], 4 * chunk.count));
    for (let k = 0; k < chunk.count && count < LOOKED; k++) {
      if (!arrays[2][4 * k + 3]) continue;
      parts.forEach((at, part) => kernel.numbers(at + VECTOR * count, 4).set(arrays[part].subarray(4 * k, 4 * k + 4)));
      count += 1;
    }
  }
  const error = (degrees) => {
    if (!known.has(degrees)) known.set(degrees, kernel.samples_axis(...parts, count, degrees));
    return known.get(degrees);
  };
  const least = (angles) => angles.reduce((best, each) => (error(each) < error(best) ? each : best));
  const coarse = least(Array.from({ length: 90 / STEP }, (_, k) => STEP * k));
  const best = least(Array.from({ length: 2 * STEP - 1 }, (_, k) => (coarse - STEP + 1 + k + 90) % 90));
  return error(best) < WORTH * error(0) ? (best * Math.PI) / 180 : 0;
}
