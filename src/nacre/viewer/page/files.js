// Files that people open on the page: read in a worker, so that the page never waits for them.

import { readCsv } from "./csv.js";
import { Kernel } from "./kernel.js";
import { readMbsdf } from "./mbsdf.js";
import { readMerl } from "./merl.js";
import { readNetwork } from "./networks.js";
import { keyOf } from "./programs.js";
import { readRgl } from "./rgl.js";
import { tabulated } from "./scan.js";
import { FileError } from "./tensors.js";

const LIMIT = 1 << 28; // bytes
const SLICE = 1 << 23; // bytes that are read at a time
const READERS = { ".safetensors": networkOf, ".binary": readMerl, ".bsdf": readRgl, ".mbsdf": readMbsdf, ".csv": scanOf };

export const ENDINGS = Object.keys(READERS);

// {name, known, source, network | table, scan} of a file; throws a FileError that says what is wrong.
// `progress` is called with the fraction that was read.
export async function read(file, wasm, progress = () => {}) {
  const ending = file.name.toLowerCase().match(/\.[a-z]*$/)?.[0];
  if (!Object.hasOwn(READERS, ending)) throw new FileError(`is of a kind that this page does not read; it reads ${ENDINGS.join(", ")}`);
  if (file.size > LIMIT) throw new FileError(`is larger than ${LIMIT} bytes, the most that this page reads`);
  const buffer = await whole(file, progress), source = { file: file.name };
  const hash = await globalThis.crypto?.subtle?.digest("SHA-256", buffer);
  if (hash) source.sha256 = Array.from(new Uint8Array(hash), (byte) => byte.toString(16).padStart(2, "0")).join("");
  const { name, known, ...form } = READERS[ending](buffer, wasm);
  const short = name || file.name.slice(0, -ending.length);
  return { name: short, known: { ...known, File: file.name, "File bytes": file.size.toLocaleString("en") }, source, ...form };
}

async function whole(file, progress) {
  const bytes = new Uint8Array(file.size);
  for (let start = 0; start < file.size; start += SLICE) {
    if (start) progress(start / file.size);
    bytes.set(new Uint8Array(await file.slice(start, start + SLICE).arrayBuffer()), start);
  }
  return bytes.buffer;
}

function networkOf(buffer) {
  const network = readNetwork(buffer), { name, sizes, source } = network.header;
  const known = { Model: "NeuralBrdf", Inputs: keyOf(network.header)[0], Layers: sizes.join("-") };
  if (typeof source?.file === "string") known["Fitted to"] = source.file;
  return { name: typeof name === "string" ? name : "", known, network };
}

// Scattered samples, and the table that shows them; `wasm` is the kernel.
function scanOf(buffer, wasm) {
  const { name, samples: scan } = readCsv(buffer);
  if (!globalThis.WebAssembly) throw new FileError("holds scattered samples, which take a browser with WebAssembly");
  return { name, known: { Model: "ScatteredBrdf", Samples: scan.count.toLocaleString("en") }, table: tabulated(new Kernel(wasm), scan), scan };
}

// The worker's side: takes files, and posts what they hold or what is wrong with them.
export function serve() {
  globalThis.onmessage = async ({ data }) => {
    try {
      const found = await read(data.file, data.wasm, (part) => postMessage({ part }));
      const numbers = found.table ? Object.values(found.table.grids) : Object.values(found.network.tensors);
      postMessage({ found }, [...new Set(numbers.map(({ values }) => values.buffer))]);
    } catch (error) {
      postMessage({ trouble: error instanceof FileError ? error.message : `could not be read: ${error.message}` });
    }
  };
}

// The page's side: what a file holds, read by a worker that runs the page's own script.
export class Reading {
  // `wasm` is the kernel.
  constructor(wasm) {
    this.wasm = wasm;
    const script = document.querySelector("script[type=module]").textContent;
    this.url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    this.worker = new Worker(this.url);
  }

  // One file at a time; rejects with an Error in words. `progress` is called with the fraction read.
  read(file, progress) {
    const { worker } = this;
    return new Promise((resolve, reject) => {
      worker.onmessage = ({ data }) => {
        if (data.part) progress(data.part);
        else if (data.trouble) reject(new Error(data.trouble));
        else resolve(data.found);
      };
      worker.onerror = (event) => reject(new Error(`could not be read: ${event.message ?? "the browser runs no workers here"}`));
      worker.onmessageerror = () => reject(new Error("could not be read: it takes too much memory"));
      worker.postMessage({ file, wasm: this.wasm });
    });
  }

  close() {
    this.worker.terminate();
    URL.revokeObjectURL(this.url);
  }
}
