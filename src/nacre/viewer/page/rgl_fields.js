// The tensor container of the RGL database, named arrays in one file: see nacre.measured.tensor_file.

import { floats, product, Reader } from "./raw.js";
import { FileError } from "./tensors.js";

export const MAGIC = "tensor_file\0";
const FIELD_LIMIT = 256, RANK_LIMIT = 8, NAME_LIMIT = 256;
const TYPES = ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16", "float32", "float64"];

// Fields by name: {type, shape, values() in single precision, bytes()}; all lie within the file.
export function readFields(buffer) {
  const reader = new Reader(buffer), decoder = new TextDecoder("latin1");
  if (decoder.decode(buffer.slice(0, MAGIC.length)) !== MAGIC)
    throw new FileError("does not start with 'tensor_file', not an RGL material");
  reader.position = MAGIC.length;
  const version = [reader.take(1, "version"), reader.take(1, "version")].join(".");
  if (version !== "1.0") throw new FileError(`tensor file version ${version}, expected 1.0`);
  const count = reader.take(4, "field count");
  if (count < 1 || count > FIELD_LIMIT) throw new FileError(`${count} fields, expected 1 to ${FIELD_LIMIT}`);
  const fields = new Map();
  for (let number = 0; number < count; number++) {
    const what = `the name of field ${number}`, length = reader.take(2, what);
    const name = decoder.decode(reader.bytes(length, what));
    if (length > NAME_LIMIT) throw new FileError(`${what} has ${length} characters; the file is damaged`);
    if (!/^[A-Za-z_][A-Za-z0-9_]*$/.test(name)) throw new FileError(`${what} is not an identifier`);
    if (fields.has(name)) throw new FileError(`field '${name}': appears twice`);
    fields.set(name, field(reader, name));
  }
  return fields;
}

function field(reader, name) {
  const { buffer } = reader, what = `field '${name}'`;
  const rank = reader.take(2, what), type = TYPES[reader.take(1, what) - 1], offset = reader.take(8, what);
  if (rank > RANK_LIMIT) throw new FileError(`${what}: ${rank} dimensions, at most ${RANK_LIMIT} are read`);
  if (!type) throw new FileError(`${what}: unknown type code`);
  const sizes = Array.from({ length: rank }, () => reader.take(8, what)); // products of BigInts do not overflow
  const each = Number(type.match(/\d+/)[0]) / 8, size = sizes.reduce((a, b) => a * b, BigInt(each));
  if (size === 0n) throw new FileError(`${what}: is empty, shape (${sizes.join(", ")})`);
  if (offset + size > BigInt(buffer.byteLength))
    throw new FileError(`${what}: ${size} bytes at offset ${offset} reach past the end of the file (${buffer.byteLength} bytes); the file is cut short or damaged`);
  const shape = sizes.map(Number), start = Number(offset);
  return {
    type, shape,
    values: () => floats(buffer, start, product(shape), each),
    bytes: () => new Uint8Array(buffer, start, Number(size)),
  };
}
