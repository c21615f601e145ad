// What an address of the page, and an attribute of <nacre-view>, may say about a scene: one table of names.
//
// Each setting has the value it has unless told otherwise, `parse`, which throws an Error in words, and
// `text`, its opposite; and, where that is all there is to it, `scene`, the change of a renderer's scene.

import { SHAPES } from "./shapes.js";

const DIGITS = 3, FINE = 7; // of numbers in addresses

const ALL_SHAPES = ["sphere", ...Object.keys(SHAPES)];

const shorter = (x, digits = DIGITS) => `${Number(x.toFixed(digits))}`;

function number(text, what, unit) {
  const found = text.trim() ? Number(text) : NaN;
  if (!Number.isFinite(found)) throw new Error(`${what} "${text}" is not a number of ${unit}`);
  return found;
}

const clamped = (x, [low, high]) => Math.min(Math.max(x, low), high);

function numeric(what, unit, initial, range) {
  const parse = (text) => (text === "" ? initial : clamped(number(text, what, unit), range));
  return { initial, range, parse, text: (value) => shorter(value) };
}

function pair(what, unit, initial, ranges, digits) {
  const parse = (text) => {
    const parts = text.split(",");
    if (parts.length !== 2) throw new Error(`${what} "${text}" is not two numbers`);
    return parts.map((part, k) => clamped(number(part, what, unit), ranges[k]));
  };
  return { initial, parse, text: (value) => value.map((x) => shorter(x, digits)).join(",") };
}

function word(what, words, initial) {
  const parse = (text) => {
    const found = text || initial;
    if (!words.includes(found)) throw new Error(`${what} "${found}" is none of ${words.join(", ")}`);
    return found;
  };
  return { initial, words, parse, text: (value) => value };
}

export const SETTINGS = {
  shape: { ...word("shape", ALL_SHAPES, "ball"), scene: (shape) => ({ shape }) },
  stage: word("stage", ["on", "off"], "on"),
  light: { initial: "", parse: (text) => text, text: (value) => value },
  rotation: { ...numeric("rotation", "degrees", 0, [-180, 180]), scene: (degrees) => ({ rotation: (degrees * Math.PI) / 180 }) },
  exposure: { ...numeric("exposure", "stops", 0, [-8, 8]), scene: (stops) => ({ exposure: 2 ** stops }) },
  curve: word("curve", ["film", "plain"], "film"),
  lamp: numeric("lamp", "times", 0, [0, 4]),
  at: pair("at", "parts of the radius", [-0.5, 0.5], [[-1, 1], [-1, 1]], FINE),
  turn: pair("turn", "degrees", [0, 0], [[-36000, 36000], [-86, 86]], DIGITS),
};

export const initial = () => Object.fromEntries(Object.entries(SETTINGS).map(([name, each]) => [name, each.initial]));
