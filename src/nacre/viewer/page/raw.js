// Numbers taken one after another from a binary file, never beyond its end.

import { fromHalf } from "./halves.js";
import { FileError } from "./tensors.js";

const LARGEST = 3.4028234663852886e38; // of single precision

export class Reader {
  constructor(buffer, position = 0) {
    Object.assign(this, { buffer, position, view: new DataView(buffer) });
  }

  // Go on by a number of bytes; the position before.
  skip(length, what) {
    const start = this.position;
    if (start + length > this.buffer.byteLength) throw new FileError(`ends within ${what}; the file is cut short or damaged`);
    this.position = start + length;
    return start;
  }

  // The next unsigned number of 1, 2, 4 or 8 bytes; of 8 bytes it is a BigInt.
  take(size, what) {
    const start = this.skip(size, what);
    return this.view[{ 1: "getUint8", 2: "getUint16", 4: "getUint32", 8: "getBigUint64" }[size]](start, true);
  }

  bytes(length, what) {
    const start = this.skip(length, what);
    return new Uint8Array(this.buffer, start, length);
  }
}

// So many little-endian numbers of 8, 4 or 2 bytes from a position.
export function floats(buffer, start, count, size) {
  const part = buffer.slice(start, start + count * size); // numbers lie at multiples of their size
  if (size === 8) return new Float64Array(part);
  return size === 4 ? new Float32Array(part) : Float32Array.from(new Uint16Array(part), fromHalf);
}

export function checkFinite(values, where, hint) {
  for (const value of values)
    if (!(value >= -LARGEST && value <= LARGEST)) throw new FileError(`${where}: some are not finite; ${hint}`);
}

export const product = (numbers) => numbers.reduce((a, b) => a * b, 1);
