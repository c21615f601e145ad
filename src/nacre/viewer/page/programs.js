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

// A description of a sampler without its numbers.
export function shape(value) {
  if (Array.isArray(value))
    return value.every((x) => typeof x === "number") ? value.length : value.map(shape);
  if (typeof value === "number") return "number";
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(Object.keys(value).sort().map((key) => [key, shape(value[key])]));
}

// The text with the numbers of a file; `template` has the key of its header.
export function filled(template, file) {
  const numbers = numbersFor(template, file);
  return template.text.replace(/@(\d+)@/g, (_, k) => literal(numbers[k]));
}

// The text with its numbers in a uniform, `material_numbers`, padded to whole vectors.
export const open = ({ text, places }) => opened(text.replace(/@(\d+)@/g, (_, k) => place(k)), places.length);

export const opened = (text, count) => `uniform vec4 material_numbers[${Math.ceil(count / 4)}];\n${text}`;

export const place = (k) => `material_numbers[${k >> 2}].${"xyzw"[k & 3]}`;

// What fills the places of a template.
export function numbersFor(template, { header, tensors }) {
  const weights = [];
  for (let layer = 1; layer < header.sizes.length; layer++)
    for (const part of ["weights", "biases"]) {
      const found = tensors[`${part}_${layer}`];
      const wanted = part === "weights" ? [header.sizes[layer - 1], header.sizes[layer]] : [header.sizes[layer]];
      if (!found || `${found.shape}` !== `${wanted}`) throw new FileError(`${part}_${layer}: expected ${wanted.join(" x ")} numbers`);
      weights.push(...found.values);
    }
  const datum = datumOf(header);
  return template.places.map((place) => (typeof place === "number" ? weights[place] : datum(place)));
}

// What gives the numbers that formulas of a file's sampler and axes stand for.
export function datumOf({ sampler, angle }) {
  const known = { numbers: numbersOf(sampler), angle, "sampler angle": sampler.angle };
  return (place) => formula(place, known);
}

const MOST = 1 << 13; // weights of a network that is written here: more take browsers seconds to compile

// The GLSL of a network of any sizes: layer by layer, from GLSL of its inputs; see `input_sources` in
// Python. `sampler` is GLSL of how directions are drawn; `number` writes a number.
export function written({ header, tensors }, inputs, sampler, number = literal) {
  const [name, isotropic, sizes, activation] = keyOf(header), lines = [];
  const angle = name === "enhanced" && !isotropic ? header.angle : 0;
  const count = sizes.slice(1).reduce((sum, size, k) => sum + (sizes[k] + 1) * size, 0);
  if (count > MOST) throw new FileError(`has ${count} weights; this page draws networks of up to ${MOST}`);
  if (angle) {
    const [c, s] = [Math.cos(angle), Math.sin(angle)].map((x) => number(x));
    for (const w of ["wi", "wo"]) lines.push(`${w}.xy = vec2(${c} * ${w}.x + ${s} * ${w}.y, ${c} * ${w}.y - ${s} * ${w}.x);`);
  }
  lines.push("vec4 a = material_first(wi, wo), b = material_second(wi, wo);");
  let values = [..."ab"].flatMap((part) => [..."xyzw"].map((axis) => `${part}.${axis}`)).slice(0, sizes[0]);
  for (let layer = 1; layer < sizes.length; layer++) {
    const { values: weights } = tensors[`weights_${layer}`], { values: biases } = tensors[`biases_${layer}`];
    const sums = Array.from(biases, (bias, j) =>
      [number(bias), ...values.map((value, i) => `${value} * ${number(weights[i * biases.length + j])}`)].join(" + "));
    values = sums.map((sum, j) => `v${layer}_${j}`);
    sums.forEach((sum, j) => {
      lines.push(`float ${values[j]} = ${layer < sizes.length - 1 ? `max(${sum}, 0.0)` : sum};`);
      if (layer < sizes.length - 1 && activation !== "relu") lines.push(`${values[j]} *= ${values[j]};`);
    });
  }
  const found = `vec3(${values.join(", ")})`, f = name === "reciprocal" ? `exp(min(${found}, 80.0))` : `exp(${found}) - 1.0`;
  lines.push(`return wi.z > 0.0 && wo.z > 0.0 ? clamp(${f}, 0.0, 3.4028234663852886e38) : vec3(0.0);`);
  return `${inputs[`${name} ${isotropic}`]}\n\nvec3 material_eval(vec3 wi, vec3 wo) {\n${lines.join("\n")}\n}\n\n${sampler}`;
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
