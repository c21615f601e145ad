// Materials as files for others to open.

import { made } from "./dom.js";
import { toHalf } from "./halves.js";

// The bytes of a `.safetensors` file, as nacre reads it; `tensors` are {shape, values} by name, with a
// `type` of "F16" where they are stored as halves.
export function bytesOf({ header, tensors }) {
  const table = { __metadata__: { nacre: JSON.stringify(header) } };
  let size = 0;
  for (const [name, { shape, values, type = "F32" }] of Object.entries(tensors)) {
    const start = size;
    size += (type === "F16" ? 2 : 4) * values.length;
    table[name] = { dtype: type, shape, data_offsets: [start, size] };
  }
  const text = new TextEncoder().encode(JSON.stringify(table)), start = 8 * Math.ceil((8 + text.length) / 8);
  const bytes = new Uint8Array(start + size).fill(32, 8, start), view = new DataView(bytes.buffer);
  view.setBigUint64(0, BigInt(start - 8), true);
  bytes.set(text, 8);
  for (const [name, { values, type }] of Object.entries(tensors)) {
    const first = start + table[name].data_offsets[0];
    values.forEach((value, k) =>
      (type === "F16" ? view.setUint16(first + 2 * k, toHalf(value), true) : view.setFloat32(first + 4 * k, value, true)));
  }
  return bytes;
}

// Hand a file to the reader, under a name that every system takes.
export function handOver(name, bytes, ending = "safetensors") {
  const safe = name.replace(/[^\p{L}\p{N} ,._-]+/gu, "_").trim().slice(0, 100) || "material";
  const url = URL.createObjectURL(new Blob([bytes], { type: "application/octet-stream" }));
  made("a", { href: url, download: `${safe}.${ending}` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}
