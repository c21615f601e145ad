// Tables of the MERL BRDF database: see nacre.measured.merl.

import { halves } from "./halves.js";
import { checkFinite, floats, product } from "./raw.js";
import { FileError } from "./tensors.js";

const HEADER = 12, NODE_LIMIT = 1024;
const SIZES = [8, 4, 2]; // bytes a number, of which the length of a file tells
const SCALES = [1 / 1500, 1.15 / 1500, 1.66 / 1500]; // from stored red, green and blue to f_r in 1/sr
const INVALID = 0xbc00; // -1 as a half

export function readMerl(buffer) {
  if (buffer.byteLength < HEADER) throw new FileError("ends within the header; the file is cut short");
  const counts = [...new Int32Array(buffer.slice(0, HEADER))], contents = `${counts.join(" x ")} nodes`;
  if (!counts.every((count) => count >= 1 && count <= NODE_LIMIT))
    throw new FileError(`header gives ${contents}, expected 90 x 90 x 180`);
  if (`${counts}` === "90,90,360")
    throw new FileError("360 nodes in phi_d span a full turn of a material that is not reciprocal; only tables over half a turn are read");
  const nodes = product(counts), lengths = SIZES.map((size) => HEADER + 3 * nodes * size);
  const size = SIZES[lengths.indexOf(buffer.byteLength)];
  if (!size) {
    const problem = buffer.byteLength < lengths[0] ? "is cut short" : "has trailing bytes";
    throw new FileError(`${buffer.byteLength} bytes, but ${contents} take ${lengths.join(" or ")}; the file ${problem} or is something else`);
  }
  const stored = floats(buffer, HEADER, 3 * nodes, size);
  checkFinite(stored, "values", size === 2 ? "download the file again, or one of float32: float16 ends at 65504" : "download the file again");
  const values = new Float32Array(3 * nodes), missing = [];
  for (let k = 0; k < nodes; k++) {
    const channels = SCALES.map((scale, c) => Math.fround(stored[c * nodes + k]) * scale);
    if (channels.every((channel) => channel >= 0)) values.set(channels, 3 * k);
    else missing.push(k);
  }
  const grid = halves(values);
  for (const k of missing) grid.values.fill(INVALID, 3 * k, 3 * k + 3);
  return {
    table: {
      kind: "merl", scale: grid.scale, nearest: false,
      grids: { nodes: { size: [...counts].reverse(), channels: 3, values: grid.values } },
    },
    known: { Model: "MerlBrdf", Grid: `theta_h x theta_d x phi_d: ${counts.join(" x ")}` },
  };
}
