// The worker's side of a fit in the page, as nacre.neural.fitting does it: samples, several starts, and two
// replicas of the best of them, of which each worker trains one.

import { rounded } from "./halves.js";
import { Kernel } from "./kernel.js";
import { Post } from "./post.js";
import { described, draw, kindOf, lobes } from "./sampling.js";
import { clamped, scattered } from "./scan.js";

const BLOCK = 16, REPLICAS = 2;
const STEPS = 50; // between two averages
const TRIAL = 20; // one in so many epochs chooses among the starts
const PAUSE = 300; // ms between two pictures

// Learning rate of every step: linear warm-up over 2 %, then a cosine to zero.
function schedule(steps, peak) {
  const warm = Math.max(1, Math.floor(steps / 50));
  return Float32Array.from({ length: steps }, (_, k) => {
    const decay = Math.min(Math.max((k - warm) / Math.max(1, steps - warm), 0), 1);
    return peak * Math.min((k + 1) / warm, 0.5 + 0.5 * Math.cos(Math.PI * decay));
  });
}

class Training {
  // `index` is 0 for the worker that also talks to the page.
  constructor({ wasm, recipe, index, port, ...material }) {
    Object.assign(this, { kernel: new Kernel(wasm), recipe, index, material, other: new Post(port), page: new Post(globalThis), last: 0 });
  }

  async run() {
    const { kernel, other, page, recipe, material: { isotropic, scan } } = this;
    if (!this.index) {
      const { blocks, judge, ...data } = scan ? scattered(kernel, page, recipe, scan) : await draw(kernel, page, recipe, isotropic);
      this.judge = judge;
      const numbers = kernel.numbers(blocks, data.length).slice();
      other.send({ data, numbers }, [numbers.buffer]);
      Object.assign(this, data, { blocks });
    } else {
      const { data, numbers } = await other.next();
      Object.assign(this, data, { blocks: kernel.put(numbers) });
    }
    await this.train();
    if (!this.index) await this.finish();
  }

  async train() {
    const { kernel, recipe, training } = this, { epochs, seed } = recipe, batch = recipe.batch / BLOCK;
    const steps = Math.ceil(training / batch), rates = schedule(steps * epochs, recipe.learning_rate);
    const trial = Math.floor(epochs / TRIAL), random = kernel.random(seed, 1), every = Math.max(1, Math.floor(epochs / 20));
    const starts = Array.from({ length: trial ? recipe.starts : 1 }, (_, k) => k);
    const own = starts.filter((start) => !trial || start % REPLICAS === this.index).map((start) => this.start(start));
    Object.assign(this, { order: kernel.room(4 * training), rates: kernel.put(rates), batch, net: own[0], steps: 0 });
    for (let epoch = 0; epoch < epochs; epoch++) {
      kernel.random_order(random, this.order, training);
      if (epoch === trial && trial) await this.choose(own);
      if (epoch < trial) {
        for (const net of own) this.advance(net, 0, training, this.rates + 4 * epoch * steps, steps);
        this.steps += steps;
      } else await this.pass(rates.subarray(epoch * steps, (epoch + 1) * steps));
      if (this.index) continue;
      if (epoch % every === 0 || epoch + 1 === epochs) this.loss = this.mean(this.held, training);
      this.tell(epoch + 1, epochs);
    }
  }

  // A network with the weights of a start: normal ones of variance 2 / inputs, zero biases.
  start(k) {
    const { kernel, sizes, recipe: { seed, activation } } = this, net = kernel.network(sizes, activation === "squared relu");
    const random = kernel.random(seed, 2, ...(k ? [k] : [])), list = [];
    for (let layer = 1; layer < sizes.length; layer++) {
      const [rows, columns] = [sizes[layer - 1], sizes[layer]], at = kernel.room(4 * rows * columns);
      kernel.random_normals(random, Math.sqrt(2 / rows), at, rows * columns);
      list.push(...kernel.numbers(at, rows * columns), ...Array(columns).fill(0));
    }
    kernel.network_list(net, kernel.put(Float32Array.from(list)), 1, 0);
    return net;
  }

  // Mean loss over blocks from the first.
  mean(count, first = 0, net = this.net) {
    return this.kernel.network_loss(net, this.blocks, first, count);
  }

  // So many steps on blocks of the order from a first one.
  advance(net, first, count, rates, steps) {
    this.kernel.network_train(net, this.blocks, this.order + 4 * first, count, this.batch, rates, steps, this.steps);
  }

  // Go on from the start with the smallest held-out loss of both workers.
  async choose(own) {
    const { kernel, other, index } = this;
    const losses = own.map((net) => this.mean(this.held, this.training, net)).map((loss) => (loss >= 0 ? loss : Infinity));
    const best = losses.indexOf(Math.min(...losses)), state = kernel.state(own[best]).slice();
    other.send({ best, loss: losses[best], state });
    const its = await other.next(), [a, b] = index ? [its, { best, loss: losses[best] }] : [{ best, loss: losses[best] }, its];
    const first = a.loss < b.loss || (a.loss === b.loss && a.best <= b.best), mine = first === !index;
    this.net = own[best];
    if (!mine) kernel.state(this.net).set(its.state);
  }

  // An epoch: half of the batches at twice the rate, averaged with the other half after every few steps.
  async pass(rates) {
    const { kernel, other, batch, index, training } = this, steps = Math.ceil(rates.length / REPLICAS);
    const end = Math.min(training, (index + 1) * steps * batch);
    for (let first = 0; first < steps; first += STEPS) {
      const at = (index * steps + first) * batch, count = Math.max(0, Math.min(STEPS * batch, end - at)), own = Math.ceil(count / batch);
      kernel.numbers(this.rates, own).set(Array.from({ length: own }, (_, k) => REPLICAS * rates[REPLICAS * (first + k)]));
      this.advance(this.net, at, count, this.rates, own);
      this.steps += own;
      const state = kernel.state(this.net);
      other.send(state.slice());
      (await other.next()).forEach((x, k) => (state[k] = 0.5 * Math.fround(state[k] + x)));
    }
  }

  // The weights as files have them.
  weights() {
    const { kernel, net, list = kernel.room(4 * this.count()) } = this;
    this.list = list;
    kernel.network_list(net, list, 0, 0);
    return kernel.numbers(list, this.count()).slice();
  }

  count() {
    return this.sizes.slice(1).reduce((sum, size, k) => sum + (this.sizes[k] + 1) * size, 0);
  }

  tell(done, total) {
    const now = performance.now(), { loss, sizes, angle } = this;
    if (now - this.last < PAUSE) return;
    this.last = now;
    this.page.send({ progress: done / total, loss, sizes, angle, weights: this.weights() });
  }

  // f_r of a network at directions in the kernel's memory, four numbers each.
  evaluate(net, rows, wi, wo, count) {
    const { kernel, angle, recipe, material: { isotropic } } = this, own = rows + 4, whole = Math.ceil(count / BLOCK), ones = kernel.room(16 * count);
    const blocks = kernel.room(4 * whole * BLOCK * own), rgb = new Float32Array(4 * count);
    kernel.numbers(ones, 4 * count).fill(1);
    kernel.samples_fill(blocks, 0, count, wi, wo, ones, count, kindOf(recipe, isotropic), angle, 1, 1);
    kernel.network_evaluate(net, blocks, 0, whole);
    const found = kernel.numbers(blocks, whole * BLOCK * own);
    for (let k = 0; k < count; k++)
      for (let c = 0; c < 3; c++) rgb[4 * k + c] = found[(Math.floor(k / BLOCK) * own + rows + c) * BLOCK + (k % BLOCK)];
    return rgb;
  }

  // The losses, the weights as they are stored, and lobes to sample these by.
  async finish() {
    const { kernel, loss, angle, recipe, highest, material: { isotropic } } = this, quality = { training_loss: this.mean(this.training), held_out_loss: loss };
    if (!Number.isFinite(quality.training_loss + loss)) throw new Error("training diverged");
    let { sizes } = this, weights = this.weights();
    if (highest) [weights, sizes] = [clamped(weights, sizes, highest), [...sizes, 3]];
    if (recipe.precision === "half") weights = weights.map(rounded);
    const net = kernel.network(sizes, recipe.activation === "squared relu");
    kernel.network_list(net, kernel.put(weights), 1, 0);
    const evaluate = (wi, wo, count) => this.evaluate(net, sizes[0], wi, wo, count);
    if (this.judge) Object.assign(quality, this.judge(evaluate));
    const mixture = await lobes(kernel, isotropic, evaluate);
    this.page.send({ done: quality, sizes, angle, weights, sampler: described(kernel.numbers(mixture, 37, Float64Array)) });
  }
}

// Take one fit, and post how it goes, or what is wrong.
export function train() {
  globalThis.onmessage = ({ data }) =>
    new Training(data).run().catch((error) => postMessage({ trouble: error.message }));
}
