// Pictures as OpenEXR files: one part, scan lines, single precision, not compressed.

const NAMES = ["A", "B", "G", "R"]; // in the order that files need
const FLOAT = 2;

// The bytes of a file of RGBA, four numbers a pixel, the top row first; linear Rec. 709.
export function exrOf(pixels, width, height) {
  const head = headOf(width, height), line = 8 + 16 * width, start = head.length + 8 * height;
  const bytes = new Uint8Array(start + line * height), view = new DataView(bytes.buffer);
  bytes.set(head);
  for (let y = 0; y < height; y++) {
    const at = start + y * line;
    view.setBigUint64(head.length + 8 * y, BigInt(at), true);
    view.setInt32(at, y, true);
    view.setInt32(at + 4, 16 * width, true);
    for (let k = 0; k < 4; k++)
      for (let x = 0; x < width; x++)
        view.setFloat32(at + 8 + 4 * (k * width + x), pixels[4 * (y * width + x) + 3 - k], true);
  }
  return bytes;
}

function headOf(width, height) {
  const bytes = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
  const text = (value) => [...new TextEncoder().encode(value), 0];
  const numbers = (method, values) => {
    const view = new DataView(new ArrayBuffer(4 * values.length));
    values.forEach((value, k) => view[method](4 * k, value, true));
    return [...new Uint8Array(view.buffer)];
  };
  const whole = (...values) => numbers("setInt32", values), real = (...values) => numbers("setFloat32", values);
  const attribute = (name, type, value) => bytes.push(...text(name), ...text(type), ...whole(value.length), ...value);
  attribute("channels", "chlist", [...NAMES.flatMap((name) => [...text(name), ...whole(FLOAT, 0, 1, 1)]), 0]);
  attribute("chromaticities", "chromaticities", real(0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329));
  attribute("compression", "compression", [0]);
  attribute("dataWindow", "box2i", whole(0, 0, width - 1, height - 1));
  attribute("displayWindow", "box2i", whole(0, 0, width - 1, height - 1));
  attribute("lineOrder", "lineOrder", [0]);
  attribute("pixelAspectRatio", "float", real(1));
  attribute("screenWindowCenter", "v2f", real(0, 0));
  attribute("screenWindowWidth", "float", real(1));
  bytes.push(0);
  return Uint8Array.from(bytes);
}
