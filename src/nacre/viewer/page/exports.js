// A network as code for other tools, character by character what nacre's export targets write.

import { active } from "./inactive.js";
import { datumOf, keyOf, shape } from "./programs.js";
import { GLSL, WGSL, written } from "./source.js";
import { FileError, sizeOf } from "./tensors.js";
import { replayed, traced } from "./trace.js";

const MOST = 10000; // weights that compilers take as literals
const PARAMETERS = { eval: [["wi", 3], ["wo", 3]], sample: [["wo", 3], ["u", 3]], pdf: [["wi", 3], ["wo", 3]] };

// By target: what it is called, the ending of its file, and its text for {held, file, name}.
export const TARGETS = {
  glsl: ["GLSL", ".glsl", (given) => source(GLSL, given, given.held.opening)],
  wgsl: ["WGSL", ".wgsl", (given) => source(WGSL, given, [])],
  three: ["three.js", ".js", module],
};

// The file of a target, {name, text}, of a network's file; `held` are the page's facts for exports, and
// `terms` those of the material where its file does not say them.
export function exported(target, held, file, title, terms) {
  const [, ending, write] = TARGETS[target], name = identifier(title);
  return { name: name + ending, text: write({ held, file, name, terms }) };
}

function source(language, given, opening) {
  const head = [...comments(preamble(given)), ...opening];
  return `${[head.join("\n"), ...functions(language, given)].join("\n\n")}\n`;
}

function module(given) {
  const { held: { three }, file, name } = given, [, isotropic] = keyOf(file.header);
  const values = {
    ...three.values, NAME: name, PREAMBLE: comments(preamble(given)).join("\n"), ANISOTROPIC: `${!isotropic}`,
    GLSL: functions(GLSL, given).join("\n\n"), WGSL: functions(WGSL, given).join("\n\n"),
  };
  return three.text.replace(/NACRE_([A-Z]+)/g, (_, place) => values[place]);
}

const comments = (lines) => lines.map((line) => `// ${line}`.trimEnd());

const pruned = new WeakMap(); // layers by file: a file may be written in several languages

// NAME_eval, NAME_sample and NAME_pdf.
function functions(language, { held, file, name }) {
  const { header, tensors } = file, [inputs, isotropic, sizes, activation] = keyOf(header), datum = datumOf(header);
  const angled = inputs === "enhanced" && !isotropic && header.angle !== 0, squared = activation !== "relu";
  const recorded = held.values[JSON.stringify([inputs, isotropic, angled])];
  const sampling = held.samplers[JSON.stringify([shape(header.sampler), Boolean(header.sampler.angle)])];
  if (!recorded || !sampling) throw new FileError("has a sampler that this page cannot write; export it with nacre export");
  if (!pruned.has(file)) pruned.set(file, active(used(sizes, tensors, recorded.inputs), squared, held, recorded, datum));
  const layers = pruned.get(file);
  const count = layers.reduce((sum, { weights, biases }) => sum + weights.length + biases.length, 0);
  if (count > MOST) throw new FileError(`has ${count} weights, more than the ${MOST} that compilers take as literals`);
  const formulas = { eval: traced(recorded, layers, squared, datum) };
  for (const each of ["sample", "pdf"]) formulas[each] = replayed(sampling[each], datum);
  return Object.entries(formulas).map(([each, formula]) => written(language, `${name}_${each}`, PARAMETERS[each], formula));
}

// Layers of a file, without the inputs that are always zero: `inputs` are the others.
function used(sizes, tensors, inputs) {
  const layers = sizes.slice(1).map((_, k) => ({ weights: tensors[`weights_${k + 1}`].values, biases: tensors[`biases_${k + 1}`].values }));
  const [{ weights, biases }] = layers, rows = biases.length;
  layers[0] = { weights: Float32Array.from(inputs.flatMap((k) => Array.from(weights.slice(k * rows, (k + 1) * rows)))), biases };
  return layers;
}

// Facts about the network, and conventions.
function preamble({ held, file: { header, tensors }, terms }) {
  const { quality = {}, fit = {}, source = {}, channels, notes } = header, { weights, bytes } = sizeOf(tensors), loss = quality.held_out_loss;
  const lines = [`${safe(header.name) || "A material"}; written by nacre export`, `NeuralBrdf, ${weights} weights, ${bytes} memory bytes`];
  if (source.file !== undefined && source.file !== null) lines.push(`Fitted to ${safe(source.file)}, SHA-256 ${safe(source.sha256 ?? "None")}`);
  if (typeof loss === "number") {
    const gain = typeof fit.gain === "number" && fit.gain !== 1 ? `${fit.gain} ` : "";
    lines.push(`Error against it: held-out loss ${loss.toFixed(5)} (${safe(`log(1 + ${gain}f cos)`)})`);
  }
  if (channels) lines.push(`Channels, in place of red, green and blue: ${channels.map(safe).join(", ")}`);
  if (notes?.length) lines.push(`Notes: ${notes.map(safe).join(" ")}`);
  return [...lines, `Terms of the source: ${safe(terms || source.terms || "not recorded")}`, "", ...held.conventions];
}

// Text on one line, of what no language takes for more than text: nacre.targets.text.safe.
function safe(text) {
  const kept = Array.from(`${text}`.normalize("NFKD"), (c) => (/[A-Za-z0-9 .,:;()+\-_=%]/.test(c) ? c : "_")).join("");
  return kept.replace(/-{2,}/g, "-").slice(0, 200);
}

// A name as an identifier of every language.
function identifier(name) {
  const plain = name.normalize("NFKD").replace(/[^\x00-\x7f]/g, "").toLowerCase();
  const joined = plain.replace(/[^a-z0-9]+/g, "_").slice(0, 60).replace(/^_+|_+$/g, "");
  if (!joined) return "material";
  return /^[a-z]/.test(joined) && !joined.startsWith("gl_") ? joined : `m_${joined}`;
}
