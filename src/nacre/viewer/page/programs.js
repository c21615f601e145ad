// The GLSL of a material: a text with its numbers filled in.

import { FileError } from "./tensors.js";

// What a network's text depends on beside its numbers: the `key` of nacre's templates.
const INPUTS = {
  "rusinkiewicz vectors, phi_h = 0": ["paper", true],
  "rusinkiewicz vectors": ["paper", false],
  "enhanced rusinkiewicz vectors, phi_h = 0": ["enhanced", true],
  "enhanced half vectors along x and y, light carried to the pole": ["enhanced", false],
  "enhanced rusinkiewicz vectors": ["spinning", false],
  "stereographic light and view": ["stereographic", false],
  "reciprocal rusinkiewicz vectors, phi_h = 0": ["reciprocal", true],
  "reciprocal rusinkiewicz vectors": ["reciprocal", false],
};
const ACTIVATIONS = { 1: "relu", 2: "squared relu" };

export function keyOf(header) {
  const [inputs, isotropic] = INPUTS[header.parametrisation] ?? [];
  const activation = ACTIVATIONS[header.version];
  if (header.model !== "nbrdf" || !inputs || !activation || !Array.isArray(header.sizes))
    throw new FileError("is of a kind that this page does not know");
  return [inputs, isotropic, header.sizes, activation, shape(header.sampler)];
}

function shape(value) {
  if (Array.isArray(value))
    return value.every((x) => typeof x === "number") ? value.length : value.map(shape);
  if (typeof value === "number") return "number";
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.keys(value).sort().map((key) => [key, shape(value[key])]));
}

// The text with the numbers of a file; `template` has the key of its header.
export function filled(template, { header, tensors }) {
  const weights = [];
  for (let layer = 1; layer < header.sizes.length; layer++)
    for (const part of ["weights", "biases"]) {
      const found = tensors[`${part}_${layer}`];
      const wanted = part === "weights" ? [header.sizes[layer - 1], header.sizes[layer]] : [header.sizes[layer]];
      if (!found || `${found.shape}` !== `${wanted}`) throw new FileError(`${part}_${layer}: expected ${wanted.join(" x ")} numbers`);
      weights.push(...found.values);
    }
  const known = { numbers: numbersOf(header.sampler), angle: header.angle, "sampler angle": header.sampler.angle };
  const numbers = template.places.map((place) =>
    literal(typeof place === "number" ? weights[place] : formula(place, known)));
  return template.text.replace(/@(\d+)@/g, (_, k) => numbers[k]);
}

// Parameters of a sampler in the order of its fields in Python.
function numbersOf(sampler) {
  const fields = ["share", "roughness", "across", "shift"];
  const lobes = (sampler.lobes ?? []).flatMap((lobe) => fields.flatMap((field) => lobe[field]));
  return [...lobes, ...["uniform", "squared", "cosines", "specular", "exponent"].flatMap((field) => sampler[field] ?? [])];
}

const OPERATIONS = {
  add: (a, b) => a + b,
  sub: (a, b) => a - b,
  mul: (a, b) => a * b,
  truediv: (a, b) => a / b,
  neg: (a) => -a,
  cos: Math.cos,
  sin: Math.sin,
};

function formula(place, known) {
  if (typeof place === "number") return place;
  const [name, ...values] = place;
  if (name === "parameter") return known.numbers[values[0]];
  if (!values.length) return known[name];
  return OPERATIONS[name](...values.map((value) => formula(value, known)));
}

// A float32 as GLSL reads it; in parentheses where a sign could meet another.
function literal(value) {
  const text = `${Math.fround(value)}`;
  const number = /[.e]/.test(text) ? text : `${text}.0`;
  return value < 0 ? `(${number})` : number;
}
