// `.safetensors` files of nacre's neural materials: tensors, and what they mean as JSON.
//
// The same checks as in Python: sizes are never trusted, nothing is allocated before it is known to
// be in the file.

import { fromHalf } from "./halves.js";

export const LIMIT = 1 << 26; // bytes
const HEADER_LIMIT = 1 << 24;
const SINGLE = "F32", HALF = "F16";
const TYPES = { [SINGLE]: 4, [HALF]: 2 };

export class FileError extends Error {}

const broken = (problem) => new FileError(`is not a whole safetensors file: ${problem}`);

// {header, tensors} of a file: header is the material's, tensors are {shape, type, values} by name.
export function readTensors(buffer) {
  if (buffer.byteLength > LIMIT) throw new FileError(`is larger than ${LIMIT} bytes`);
  const view = new DataView(buffer);
  if (buffer.byteLength < 8) throw broken("it ends within the header");
  const length = view.getBigUint64(0, true);
  if (length > BigInt(Math.min(HEADER_LIMIT, buffer.byteLength - 8)))
    throw broken("it ends within the header, or is damaged");
  const start = 8 + Number(length);
  const table = parsed(() => new TextDecoder("utf-8", { fatal: true }).decode(buffer.slice(8, start)));
  if (!table || typeof table !== "object" || Array.isArray(table)) throw broken("its header is not whole JSON");
  const text = table.__metadata__?.nacre, header = typeof text === "string" ? parsed(() => text) : undefined;
  if (header === undefined) throw new FileError("is a safetensors file, but not a nacre material");
  const tensors = {}, places = [];
  for (const [name, entry] of Object.entries(table)) {
    if (name === "__metadata__") continue;
    tensors[name] = tensor(view, start, name, entry);
    places.push(entry.data_offsets);
  }
  let end = 0;
  for (const [from, to] of places.sort((a, b) => a[0] - b[0] || a[1] - b[1])) {
    if (from !== end) throw broken("its tensors do not lie one behind the other");
    end = to;
  }
  if (start + end !== buffer.byteLength) throw broken("it holds more bytes than its tensors");
  return { header, tensors };
}

// How many numbers tensors hold, and in how many bytes.
export function sizeOf(tensors) {
  const counts = Object.values(tensors).map(({ type, values }) => [values.length, TYPES[type]]);
  return { weights: counts.reduce((sum, [count]) => sum + count, 0), bytes: counts.reduce((sum, [count, each]) => sum + count * each, 0) };
}

// What a text holds as JSON, if anything.
function parsed(text) {
  try {
    return JSON.parse(text());
  } catch {
    return undefined;
  }
}

function tensor(view, start, name, entry) {
  const { dtype, shape, data_offsets: offsets } = entry ?? {};
  const whole = (x) => Number.isInteger(x) && x >= 0;
  if (!Object.hasOwn(TYPES, dtype) || !Array.isArray(shape) || !shape.every(whole))
    throw broken(`${name} is no array of single or half precision`);
  const count = shape.reduce((a, b) => a * b, 1);
  const [from, to] = Array.isArray(offsets) ? offsets : [];
  if (!whole(from) || !whole(to) || to - from !== count * TYPES[dtype])
    throw broken(`${name}: its shape and its bytes do not agree`);
  if (start + to > view.byteLength) throw broken(`${name} reaches past the end of the file`);
  const values = new Float32Array(count);
  for (let k = 0; k < count; k++) {
    const place = start + from + k * TYPES[dtype];
    values[k] = dtype === SINGLE ? view.getFloat32(place, true) : fromHalf(view.getUint16(place, true));
  }
  if (!values.every(Number.isFinite)) throw new FileError(`weights are not finite: ${name}`);
  return { shape, type: dtype, values };
}
