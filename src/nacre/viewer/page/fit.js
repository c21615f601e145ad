// The page's side of a fit: workers that train, and the reflectance that they ask for.

import { Post } from "./post.js";

const PAIRS = 512, DIFFERENT = 0.02, SOME = 0.01; // see nacre.sampling.isotropy
const PARAMETRISATIONS = {
  enhanced: ["enhanced half vectors along x and y, light carried to the pole", "enhanced rusinkiewicz vectors, phi_h = 0"],
  paper: ["rusinkiewicz vectors", "rusinkiewicz vectors, phi_h = 0"],
};

// f_r of a material and whether it is known, four numbers a pair, at directions of four numbers each.
const values = (renderer, material, [wi, wo]) => renderer.values(material, wi, wo, material.known ?? "1.0", 4).slice();

// Whether turning both directions about the normal changes nothing.
function turns(renderer, material) {
  const place = (k, step) => (0.5 + k * step) % 1, pairs = [[], [], [], []];
  for (let k = 0; k < PAIRS; k++) {
    const [a, b, c, d] = [0.8191725133961645, 0.6710436067037893, 0.5497004779019703, 0.4503].map((step) => place(k, step));
    for (const [turned, by] of [[0, 0], [2, 2 * Math.PI * place(k, 0.6180339887498949)]])
      [[a, b], [c, d]].forEach(([z, phi], of) => {
        const r = Math.sqrt(1 - z * z), angle = 2 * Math.PI * phi + by;
        pairs[turned + of].push(r * Math.cos(angle), r * Math.sin(angle), z, 0);
      });
  }
  const [one, other] = [pairs.slice(0, 2), pairs.slice(2)].map((pair) => values(renderer, material, pair));
  const mean = one.reduce((sum, x, k) => sum + (k % 4 < 3 ? Math.abs(x) : 0), 0) / (3 * PAIRS);
  let different = 0;
  for (let k = 0; k < PAIRS; k++)
    if ([0, 1, 2].some((c) => Math.abs(one[4 * k + c] - other[4 * k + c]) > DIFFERENT * Math.max(Math.abs(one[4 * k + c]), SOME * mean)))
      different += 1;
  return different <= SOME * PAIRS;
}

export class Fit {
  // `facts` are the page's on fits, `wasm` the kernel; the material is {glsl, textures, known}, `scan` its
  // samples where it is known at these only.
  constructor(renderer, facts, wasm, material, preset, scan) {
    Object.assign(this, { renderer, material, began: performance.now(), isotropic: Boolean(scan) || turns(renderer, material) });
    const recipe = facts.presets[preset], whole = scan ? facts.scattered : facts.samples * (this.isotropic ? 1 : facts.factor);
    this.recipe = { ...recipe, samples: Math.round(recipe.sample_share * whole) };
    if (scan)
      Object.assign(this.recipe, {
        batch: recipe.batch / 2, learning_rate: recipe.learning_rate / 2, inputs: "paper", precision: "single", activation: "relu",
        gain: null, sampling: null,
      });
    const script = document.querySelector("script[type=module]").textContent, { port1, port2 } = new MessageChannel();
    this.url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    this.workers = [port1, port2].map((port, index) => {
      const worker = new Worker(this.url, { name: "fit" });
      worker.postMessage({ wasm, port, index, recipe: this.recipe, isotropic: this.isotropic, scan }, [port]);
      return worker;
    });
  }

  // {header, tensors} of the network; `report` gets messages with a part that is done, a held-out loss and
  // a network for now. Rejects with an Error in words.
  run(report) {
    return new Promise((resolve, reject) => {
      this.refuse = reject;
      const [lead, second] = this.workers, post = new Post(lead);
      const failed = ({ message }) => reject(new Error(message ?? "the browser runs no workers here"));
      for (const worker of this.workers) worker.onerror = failed;
      second.onmessage = ({ data }) => reject(new Error(data.trouble));
      this.serve(post, report).then(resolve, reject);
    }).finally(() => this.close());
  }

  async serve(post, report) {
    for (;;) {
      const message = await post.next();
      if (message.trouble) throw new Error(message.trouble);
      if (message.done) return this.network(message);
      if (message.pair) post.send(values(this.renderer, this.material, message.pair));
      else report({ ...message, network: message.weights && this.network(message) });
    }
  }

  cancel() {
    this.refuse(new Error("cancelled"));
  }

  close() {
    this.workers.forEach((worker) => worker.terminate());
    URL.revokeObjectURL(this.url);
  }

  // A file with weights, and what is known of how they came about.
  network({ weights, sizes, angle, sampler = { kind: "cosine" }, done }) {
    const { recipe, isotropic } = this, tensors = {}, type = recipe.precision === "half" ? "F16" : "F32";
    let at = 0;
    const take = (shape) => ({ shape, type, values: weights.slice(at, (at += shape.reduce((a, b) => a * b))) });
    for (let layer = 1; layer < sizes.length; layer++) {
      tensors[`weights_${layer}`] = take([sizes[layer - 1], sizes[layer]]);
      tensors[`biases_${layer}`] = take([sizes[layer]]);
    }
    const header = {
      fit: recipe, quality: done ?? {}, version: recipe.activation === "relu" ? 1 : 2, model: "nbrdf", sizes,
      parametrisation: PARAMETRISATIONS[recipe.inputs][isotropic ? 1 : 0],
      output: "exp(x) - 1, clamped at 0", color_space: "linear Rec. 709", name: "", sampler,
    };
    if (recipe.inputs === "enhanced" && !isotropic) header.angle = angle;
    return { header, tensors };
  }
}
