// Functions as source text, as nacre.targets.source writes them for GLSL and WGSL.

import { constant } from "./trace.js";

const MASKS = new Set(["lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not"]);
const BINDING = { add: 1, sub: 1, mul: 2, div: 2 };
const LONGEST = 80, WEAKEST = 0, STRONGEST = 9, LARGEST = 3.4028234663852886e38;
const FORMS = {
  add: "{0} + {1}", sub: "{0} - {1}", mul: "{0} * {1}", div: "{0} / {1}", neg: "-{0}", lt: "{0} < {1}", le: "{0} <= {1}",
  gt: "{0} > {1}", ge: "{0} >= {1}", eq: "{0} == {1}", ne: "{0} != {1}", and: "{0} && {1}", or: "{0} || {1}", not: "!{0}",
  where: "{0} ? {1} : {2}", min: "min({0}, {1})", max: "max({0}, {1})", sqrt: "sqrt({0})", floor: "floor({0})",
  abs: "abs({0})", exp: "exp({0})", log: "log({0})", sin: "sin({0})", cos: "cos({0})", arcsin: "asin({0})", arctan2: "atan({0}, {1})",
};

export const GLSL = {
  forms: FORMS, ending: "",
  type: (count, mask) => (count > 1 ? `vec${count}` : mask ? "bool" : "float"),
  declared: (type, name, value) => `${type} ${name} = ${value};`,
  head: (type, name, parameters) => `${type} ${name}(${parameters.map(([each, kind]) => `${kind} ${each}`).join(", ")})`,
};
export const WGSL = {
  forms: { ...FORMS, where: "select({2}, {1}, {0})", arctan2: "atan2({0}, {1})" }, ending: "f",
  type: (count, mask) => (count > 1 ? `vec${count}f` : mask ? "bool" : "f32"),
  declared: (type, name, value) => `let ${name} = ${value};`,
  head: (type, name, parameters) => `fn ${name}(${parameters.map(([each, kind]) => `${each}: ${kind}`).join(", ")}) -> ${type}`,
};

// A float32 in the fewest digits that parse to it, as NumPy writes it.
function literal(value) {
  const size = Math.abs(value), sign = value < 0 || Object.is(value, -0) ? "-" : "";
  if (size >= LARGEST) return `${sign}${LARGEST}`;
  if (size === 0) return `${sign}0.0`;
  const short = shortest(size);
  const text = size >= Math.fround(1e-4) && size < 1e16 ? `${short}` : short.toExponential().replace(/e([+-])(\d)$/, "e$10$2");
  return sign + (/[.e]/.test(text) ? text : `${text}.0`);
}

// Ties go to the even digit, unlike those of toPrecision.
function shortest(size) {
  const [mantissa, exponent] = size.toExponential(60).split("e"), all = mantissa.replace(".", "");
  for (let digits = 1; ; digits++) {
    const head = Number(all.slice(0, digits)), rest = Number(`.${all.slice(digits)}`);
    const up = rest > 0.5 || (rest === 0.5 && head % 2);
    const found = Number(`${head + (up ? 1 : 0)}e${exponent - digits + 1}`);
    if (Math.fround(found) === size) return found;
  }
}

// One function of {operations, results}; `parameters` are pairs of a name and a count of numbers.
export function written(language, name, parameters, { operations, results }) {
  const all = results.flat(), lines = [], texts = new Map(), uses = used(operations, all);
  const vector = (parts) => (parts.length > 1 ? `${language.type(parts.length)}(${parts.join(", ")})` : parts[0]);
  const number = (value) => literal(value) + language.ending;
  const component = (index) => {
    for (const [each, count] of parameters) {
      if (index < count) return `${each}.${"xyzw"[index]}`;
      index -= count;
    }
  };
  const text = (value) => texts.get(value)[0];
  for (const item of [...uses.keys()].sort((a, b) => a - b)) {
    const [kind, ...parts] = operations[item];
    if (kind === "dense") {
      const [{ weights, biases }, inputs] = parts, rows = biases.length;
      biases.forEach((bias, row) => {
        const sum = [number(bias), ...inputs.map((value, k) => `${text(value)} * ${number(weights[k * rows + row])}`)];
        lines.push(language.declared(language.type(1), `s${item}_${row}`, sum.join("\n        + ")));
      });
      continue;
    }
    const fixed = constant(operations[item]);
    const short = kind === "output" ? `s${parts[0]}_${parts[1]}` : kind === "input" ? component(parts[0]) : Number.isNaN(fixed) ? null : number(fixed);
    if (short !== null) {
      texts.set(item, [short, short.startsWith("-") ? WEAKEST : STRONGEST]);
      continue;
    }
    const [composed, binding] = compose(language.forms[kind], kind, parts.map((value) => texts.get(value)));
    if (uses.get(item) === 1 && composed.length < LONGEST) {
      texts.set(item, [composed, binding]);
      continue;
    }
    lines.push(language.declared(language.type(1, isMask(operations, item)), `v${item}`, composed));
    texts.set(item, [`v${item}`, STRONGEST]);
  }
  const head = language.head(language.type(all.length), name, parameters.map(([each, count]) => [each, language.type(count)]));
  return [`${head} {`, ...lines.map((line) => `    ${line}`), `    return ${vector(all.map(text))};`, "}"].join("\n");
}

// How often each value is used; inputs of layers count twice, so that they have names.
function used(operations, results) {
  const uses = new Map(), left = [...results];
  while (left.length) {
    const item = left.pop(), [kind, ...parts] = operations[item];
    uses.set(item, (uses.get(item) ?? 0) + 1);
    if (uses.get(item) > 1 || kind === "input" || kind === "number" || kind === "literal") continue;
    left.push(...(kind === "dense" ? parts[1].flatMap((value) => [value, value]) : kind === "output" ? [parts[0]] : parts));
  }
  return uses;
}

function isMask(operations, item) {
  const [kind, , value] = operations[item];
  return kind === "where" ? isMask(operations, value) : MASKS.has(kind);
}

// The text of an operation on texts, and how strongly it binds.
function compose(form, kind, sources) {
  const call = /^[a-z]/.test(form), binding = call ? STRONGEST : (BINDING[kind] ?? WEAKEST);
  const required = kind === "neg" ? STRONGEST : Math.max(binding, 1);
  const values = sources.map(([text, own], place) =>
    !call && (own < required || (place && own === binding)) ? `(${text})` : text);
  return [form.replace(/\{(\d)\}/g, (_, k) => values[k]), binding];
}
