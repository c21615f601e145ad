// Files of neural materials, checked as nacre.neural.file checks them.

import { keyOf } from "./programs.js";
import { FileError, readTensors } from "./tensors.js";

const OUTPUTS = 3, LARGEST_INPUT = 1.01, LARGEST_SUM = 1e37;
const MAX_LOBES = 8, MAX_COSINES = 16, MAX_EXPONENT = 1e5, ROUGHNESSES = [1e-3, 4], SHIFTS = [-2, 2], ROUNDING = 1e-6;
const COUNTS = { paper: [6, 6], enhanced: [8, 6], spinning: [7, 7], stereographic: [4, 4], reciprocal: [7, 6] };

export function readNetwork(buffer) {
  const network = readTensors(buffer), { header, tensors } = network;
  if (!header || typeof header !== "object") throw new FileError("a field of its header has the wrong type");
  if (header.model === "chain")
    throw new FileError("is a network of another kind; nacre view makes a page with it");
  for (const field of ["version", "model", "parametrisation", "sizes", "name", "sampler"])
    if (!(field in header)) throw new FileError(`field '${field}' is missing`);
  const [inputs, isotropic, sizes, activation] = keyOf(header), { sampler } = header;
  const types = new Set();
  let bound;
  for (let layer = 1; layer < sizes.length; layer++) {
    const [weights, biases] = ["weights", "biases"].map((part) => {
      const found = tensors[`${part}_${layer}`];
      if (!found) throw new FileError(`field '${part}_${layer}' is missing`);
      types.add(found.type);
      return found;
    });
    const [from, to] = weights.shape;
    if (weights.shape.length !== 2 || !from || !to || `${biases.shape}` !== `${to}`)
      throw new FileError(`weights (${weights.shape.join(", ")}) and biases (${biases.shape.join(", ")}) are not a layer`);
    if (from !== sizes[layer - 1] || to !== sizes[layer]) throw new FileError(`tensors have other sizes than the header says: ${sizes.join(", ")}`);
    bound = bounds(bound ?? Array(from).fill(LARGEST_INPUT), weights.values, biases.values);
    if (activation !== "relu" && layer < sizes.length - 1) bound = bound.map((x) => x * x);
    if (!bound.every((x) => x < LARGEST_SUM)) throw new FileError("weights are so large that sums of them overflow");
  }
  if (types.size !== 1) throw new FileError("layers do not hold float32 or float16 numbers, all alike");
  if (sizes[0] !== COUNTS[inputs][isotropic ? 1 : 0] || sizes.at(-1) !== OUTPUTS)
    throw new FileError(`this NBRDF goes from ${COUNTS[inputs][isotropic ? 1 : 0]} inputs to ${OUTPUTS} outputs: (${sizes.join(", ")})`);
  if (inputs === "enhanced" && !isotropic && !(within(header.angle, 0, Math.PI / 2) && header.angle < Math.PI / 2))
    throw new FileError(`the angle of the axes lies in [0, pi/2), not at ${header.angle}`);
  for (const key of ["source", "fit", "quality"])
    if (key in header && (header[key] === null || typeof header[key] !== "object" || Array.isArray(header[key])))
      throw new FileError(`field '${key}' is not a table`);
  checkSampler(sampler);
  checkJson(header);
  return network;
}

// Bounds of a layer's sums from bounds of its inputs.
function bounds(inputs, weights, biases) {
  return Array.from(biases, (bias, j) =>
    inputs.reduce((sum, x, i) => sum + x * Math.abs(weights[i * biases.length + j]), Math.abs(bias)));
}

const within = (value, low, high) => typeof value === "number" && value >= low && value <= high;

function checkNumbers(name, values, count, [low, high]) {
  if (!Array.isArray(values) || values.length !== count) throw new FileError(`${name} must have ${count} values`);
  if (!values.every((value) => within(value, low, high))) throw new FileError(`${name} must lie in [${low}, ${high}], got ${values}`);
}

const SAMPLERS = {
  cosine() {},
  uniform() {},
  "cosine + Blinn-Phong"({ specular, exponent }) {
    checkNumbers("specular", [specular], 1, [0, 1]);
    checkNumbers("exponent", [exponent], 1, [0, MAX_EXPONENT]);
  },
  "diffuse + GGX"({ lobes, uniform, squared, cosines, angle }) {
    if (![lobes, cosines].every(Array.isArray)) throw new FileError("a field of its header has the wrong type");
    const count = cosines.length;
    if (!lobes.length || lobes.length > MAX_LOBES || !count || count > MAX_COSINES)
      throw new FileError(`1 to ${MAX_LOBES} lobes and 1 to ${MAX_COSINES} cosines are possible`);
    for (const [name, values] of Object.entries({ cosines, uniform, squared })) checkNumbers(name, values, count, [0, 1]);
    if (cosines.some((cosine, k) => k && cosine <= cosines[k - 1])) throw new FileError(`cosines must increase, got ${cosines}`);
    for (const lobe of lobes) {
      checkNumbers("fraction", lobe?.share, count, [0, 1]);
      checkNumbers("roughness", lobe.roughness, count, ROUGHNESSES);
      checkNumbers("across", lobe.across, count, ROUGHNESSES);
      checkNumbers("shift", lobe.shift, count, SHIFTS);
    }
    const fractions = [uniform, squared, ...lobes.map((lobe) => lobe.share)];
    if (cosines.some((_, k) => fractions.reduce((sum, values) => sum + values[k], 0) > 1 + ROUNDING))
      throw new FileError("fractions must add up to 1 at most");
    if (angle !== null && !within(angle, -Math.PI, Math.PI)) throw new FileError(`angle must lie in [-pi, pi], got ${angle}`);
  },
};

function checkSampler(sampler) {
  const kind = sampler?.kind;
  if (!Object.hasOwn(SAMPLERS, kind)) throw new FileError(`unknown sampler '${kind}'; update nacre, or install the package that brings it`);
  SAMPLERS[kind](sampler);
}

// Refuse what could be read from JSON but not be written again.
function checkJson(content) {
  if (typeof content === "number" && !Number.isFinite(content)) throw new FileError("its description holds a number that is not finite");
  if (typeof content === "string" && !content.isWellFormed()) throw new FileError("its description holds half a character");
  if (content && typeof content === "object")
    for (const pair of Object.entries(content)) pair.forEach(checkJson);
}
