// What codes of nacre's hypernetwork stand for: networks of 675 weights, and lobes to sample them by.
//
// As nacre.latent.hypernetwork and nacre.sampling.mixture_parameters say it, in double precision.

const FARTHEST = 5; // root mean square of a code beyond which only its direction counts
const CHROMA = [[Math.SQRT1_2, -Math.SQRT1_2, 0], [Math.sqrt(1 / 6), Math.sqrt(1 / 6), -Math.sqrt(2 / 3)]]
  .map((row) => row.map(Math.fround));
const MIN_COSINE = 0.01, LOW = Math.log(0.004), HIGH = Math.log(1.5), BOUND = 30;

const silu = (x) => 0.5 * x * (1 + Math.tanh(0.5 * x));
const clipped = (x) => Math.min(Math.max(x, -BOUND), BOUND);
const logistic = (x) => 1 / (1 + Math.exp(-clipped(x)));
const digits = (x) => Number(x.toPrecision(4));

export class Decoder {
  // `file` is that of a space: layers by name, codes and places of materials.
  constructor({ header, tensors }) {
    Object.assign(this, { header, tensors });
    this.codeDim = tensors.codes.shape[1];
  }

  // Codes of materials of the map, each by a weight, added up.
  mixed(weights) {
    const { codes } = this.tensors;
    return Float32Array.from({ length: this.codeDim }, (_, k) =>
      weights.reduce((sum, [index, weight]) => sum + weight * codes.values[index * this.codeDim + k], 0));
  }

  // One layer; "#" stands for "weights" and "biases" in its name.
  dense(values, name, activation = (x) => x) {
    const { shape: [rows, columns], values: weights } = this.tensors[name.replace("#", "weights")];
    const sum = Float64Array.from(this.tensors[name.replace("#", "biases")].values);
    for (let i = 0; i < rows; i++) for (let j = 0; j < columns; j++) sum[j] += values[i] * weights[i * columns + j];
    return sum.map((x) => activation(x));
  }

  // The weights of a code's network, as its file lays them out.
  weights(code) {
    const { luma: count } = this.header;
    const length = Math.sqrt(code.reduce((sum, x) => sum + x * x, 0) / code.length);
    const values = Array.from(code, (x) => x * (FARTHEST / Math.max(length, FARTHEST)));
    const luma = values.slice(0, count);
    const pairs = Array.from({ length: (values.length - count) / 2 }, (_, k) => values.slice(count + 2 * k).slice(0, 2));
    const common = this.dense([...luma, ...pairs.map(([a, b]) => 0.5 * (a * a + b * b) - 1)], "trunk_#", silu);
    const hidden = this.dense([...luma, ...common], "shared_#");
    const columns = [0, 1, 2].map((c) => {
      const chroma = pairs.map(([a, b]) => a * CHROMA[0][c] + b * CHROMA[1][c]);
      return this.dense([...luma, ...chroma, ...this.dense([...common, ...chroma], "channel_#", silu)], "output_#");
    });
    const last = Array.from(columns[0]).flatMap((_, k) => columns.map((column) => column[k]));
    return Float32Array.from([...hidden, ...last]);
  }

  // The description of a code's sampler, four digits of each number.
  sampler(code) {
    const { cosines, lobes } = this.header;
    const free = this.dense(this.dense(code, "predictor_#_1", Math.tanh), "predictor_#_2");
    const size = 2 + 4 * lobes, rows = cosines.map((_, k) => Array.from(free.slice(size * k, size * (k + 1))));
    const values = rows.map((row) => {
      const powers = row.slice(0, 2 + lobes).map((x) => Math.exp(clipped(x)));
      const whole = 1 + powers.reduce((a, b) => a + b);
      return [
        ...powers.map((x) => Math.round(((1 - MIN_COSINE) * x * 1e4) / whole) / 1e4),
        ...row.slice(2 + lobes, 2 + 3 * lobes).map((x) => Math.exp(LOW + (HIGH - LOW) * logistic(x))),
        ...row.slice(2 + 3 * lobes).map((x) => 2 * logistic(2 * x) - 1),
      ].map(digits);
    });
    const column = (k) => values.map((row) => row[k]);
    const lobe = (k) => ({
      share: column(2 + k), roughness: column(2 + lobes + k), across: column(2 + 2 * lobes + k), shift: column(2 + 3 * lobes + k),
    });
    const all = Array.from({ length: lobes }, (_, k) => lobe(k));
    return { kind: "diffuse + GGX", lobes: all, uniform: column(0), squared: column(1), cosines, angle: null };
  }

  // {header, tensors} of a code's file.
  network(code, name) {
    const { sizes, basis } = this.header, tensors = {};
    let left = this.weights(code);
    for (let layer = 1; layer < sizes.length; layer++) {
      const [rows, columns] = [sizes[layer - 1], sizes[layer]];
      tensors[`weights_${layer}`] = { shape: [rows, columns], values: left.slice(0, rows * columns) };
      tensors[`biases_${layer}`] = { shape: [columns], values: left.slice(rows * columns, (rows + 1) * columns) };
      left = left.slice((rows + 1) * columns);
    }
    const header = {
      source: { basis, code: Array.from(code) },
      version: 1, model: "nbrdf", sizes, parametrisation: "rusinkiewicz vectors, phi_h = 0",
      output: "exp(x) - 1, clamped at 0", color_space: "linear Rec. 709", name, sampler: this.sampler(code),
    };
    return { header, tensors };
  }
}
