// Measured reflectance of the Material Definition Language: see nacre.measured.mbsdf.

import { halves } from "./halves.js";
import { checkFinite, floats, product, Reader } from "./raw.js";
import { FileError } from "./tensors.js";

const MAGIC = "NVIDIA ARC MBSDF V1\n";
const REFLECTION = ["MBSDF_DATA=\n", "MBSDF_DATA_REFLECTION=\n"], TRANSMISSION = "MBSDF_DATA_TRANSMISSION=\n";
const TEXT_LIMIT = 1 << 16, NODE_LIMIT = 1024;

export function readMbsdf(buffer) {
  const reader = new Reader(buffer), bytes = new Uint8Array(buffer);
  const text = (start, end) => String.fromCharCode(...bytes.subarray(start, end));
  if (text(0, MAGIC.length) !== MAGIC) throw new FileError(`does not begin with the line ${MAGIC.trim()}`);
  reader.position = MAGIC.length;
  for (let number = 2; ; number++) {
    const end = bytes.subarray(0, TEXT_LIMIT).indexOf(10, reader.position) + 1;
    if (!end) throw new FileError("holds no values; the file is empty or cut short");
    const line = bytes.subarray(reader.position, end - 1), start = reader.position;
    reader.position = end;
    const words = line.length > 99 ? "" : text(start, end);
    if (REFLECTION.includes(words)) break;
    if (words === TRANSMISSION) throw new FileError("holds transmission; nacre reads reflection only");
    if (!line.every((byte) => byte >= 32 && byte < 127)) throw new FileError(`line ${number}: is not printable ASCII text`);
  }
  const [kind, theta, phi] = [0, 1, 2].map(() => reader.take(4, "the header of the values"));
  if (kind > 1) throw new FileError(`type of the values: ${kind}, expected 0 or 1`);
  if (![theta, phi].every((count) => count >= 1 && count <= NODE_LIMIT))
    throw new FileError(`header gives ${theta} polar angles and ${phi} azimuths, expected 1 to ${NODE_LIMIT}`);
  const channels = kind ? 3 : 1, counts = [theta, theta, phi], count = product(counts) * channels;
  const start = reader.skip(4 * count, `the values of a grid of (${counts.join(", ")})`), end = reader.position;
  if (text(end, end + TRANSMISSION.length) === TRANSMISSION)
    throw new FileError("holds transmission beside reflection; nacre reads files without");
  if (end < buffer.byteLength) throw new FileError("has trailing bytes after the values; the file is damaged");
  const stored = floats(buffer, start, count, 4);
  checkFinite(stored, "values", "download the file again");
  const { scale, values } = halves(stored);
  return {
    table: { kind: "mbsdf", scale, grids: { nodes: { size: [phi, theta, theta], channels, values } } },
    known: { Model: "MbsdfBrdf", Grid: `theta_in x theta_out x phi: ${counts.join(" x ")}` },
  };
}
