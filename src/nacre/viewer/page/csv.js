// Scattered samples as comma-separated values: see nacre.measured.comma_separated and sample_columns.

import { FileError } from "./tensors.js";

const ANGLES = ["theta_i", "phi_i", "theta_o", "phi_o"], NOISE = "sigma";
const UNITS = { deg: Math.PI / 180, degree: Math.PI / 180, degrees: Math.PI / 180, rad: 1, radian: 1, radians: 1 };
const ALIASES = {
  theta_r: "theta_o", theta_s: "theta_o", phi_r: "phi_o", phi_s: "phi_o",
  brdf: "f", bsdf: "f", f_r: "f", red: "r", green: "g", blue: "b",
};
const COLORS = { bgr: (v) => [v.r, v.g, v.b], f: (v) => [v.f, v.f, v.f], xyz: (v) => LINEAR.map((row) => row[0] * v.x + row[1] * v.y + row[2] * v.z) };
const LINEAR = [
  [3.2409699419045226, -1.537383177570094, -0.49861076029300344],
  [-0.9692436362808798, 1.8759675015077206, 0.04155505740717563],
  [0.05563007969699364, -0.20397695888897655, 1.0569715142428786],
];
const LIMIT = 1 << 26, LONGEST = 1 << 16, HEADER = 1000, LARGEST = 3.4028234663852886e38;
const ELSEWHERE = "; nacre view makes a page with it";

const quoted = (text) => `'${text.slice(0, 40)}'`;

// {name, samples}: directions and colors, four numbers each, of an isotropic material.
export function readCsv(buffer) {
  if (buffer.byteLength > LIMIT) throw new FileError(`is larger than ${LIMIT} bytes${ELSEWHERE}`);
  const lines = text(buffer).split(/\r\n|\n|\r/);
  const { pairs, columns, start } = header(lines);
  if ((pairs.isotropic ?? "yes") !== "yes")
    throw new FileError(pairs.isotropic === "no" ? `is anisotropic${ELSEWHERE}` : `header 'isotropic': ${quoted(pairs.isotropic)}, expected yes or no`);
  const rows = table(lines, start, columns);
  for (const key of ["samples", "num_points"])
    if (key in pairs && Number(pairs[key]) !== rows.length)
      throw new FileError(`holds ${rows.length} samples, but header '${key}' says ${pairs[key].slice(0, 40)}; the file is cut short or was edited`);
  return { name: pairs.name ?? "", samples: sorted(rows, columns) };
}

function text(buffer) {
  const bytes = new Uint8Array(buffer), wide = bytes[0] === 255 && bytes[1] === 254 ? "utf-16le" : bytes[0] === 254 && bytes[1] === 255 ? "utf-16be" : "";
  if (!wide && bytes.includes(0)) throw new FileError("is not text, or is UTF-16 without its mark; save it as UTF-8");
  try {
    return new TextDecoder(wide || "utf-8", { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder(wide || "windows-1252").decode(bytes);
  }
}

// Keys and values of the first lines, and the columns that the last of these names.
function header(lines) {
  const pairs = {};
  let stray = 0;
  for (let k = 0; k < Math.min(lines.length, HEADER); k++) {
    if (lines[k].length > LONGEST) throw new FileError(`line ${k + 1}: is longer than ${LONGEST} characters`);
    const line = lines[k].trim().replace(/^[,;]+|[,;]+$/g, "");
    if (/theta_i/i.test(line) && !line.startsWith("#")) {
      if (stray) throw new FileError(`line ${stray}: is neither 'key: value' nor a comment; start it with #`);
      return { pairs, columns: columnsOf(lines[k], pairs), start: k + 1 };
    }
    const found = line.replace(/^#+/, "").trim().match(/^([^:=,#]+)[:=](.*)$/);
    if (found) pairs[found[1].trim().toLowerCase()] = found[2].trim();
    else if (line && !line.startsWith("#")) stray ||= k + 1;
  }
  throw new FileError(`has no line that names columns, or is something else; expected one like ${ANGLES},r,g,b; nacre reads other tables`);
}

const cells = (line, separator) => (separator ? line.split(separator) : line.trim().split(/\s+/)).map((cell) => cell.trim().replace(/^"+|"+$/g, ""));

// {names, scales, separator, color} of the line that names columns.
function columnsOf(line, pairs) {
  const separator = [";", "\t", ","].find((mark) => line.includes(mark)), scales = {}, found = cells(line.toLowerCase(), separator);
  while (found.length && !found.at(-1)) found.pop();
  const names = found.map((cell) => {
    const match = cell.match(/^([^[\]()]*?)\s*(?:[[(]\s*([^[\]()]*?)\s*[\])])?$/), own = match ? match[1] : cell;
    const name = Object.hasOwn(ALIASES, own) ? ALIASES[own] : own, unit = match?.[2] ?? pairs.units;
    if (!ANGLES.includes(name)) return name;
    if (unit === undefined) throw new FileError(`column ${name}: has no unit; name it '${name} [deg]' or '${name} [rad]', or add a line '# units: degrees'`);
    if (!Object.hasOwn(UNITS, unit.toLowerCase())) throw new FileError(`column ${name}: unit ${quoted(unit)}, expected degrees or radians`);
    scales[name] = UNITS[unit.toLowerCase()];
    return name;
  });
  const missing = ANGLES.filter((name) => !names.includes(name)), twice = names.find((name, k) => names.indexOf(name) < k);
  if (missing.length) throw new FileError(`columns: ${missing.join(", ")} missing`);
  if (twice !== undefined) throw new FileError(`columns: ${quoted(twice)} appears twice`);
  const values = names.filter((name) => !ANGLES.includes(name) && name !== NOISE), color = COLORS[[...values].sort().join("")];
  if (values.length && values.every((name) => /^\d+(\.\d+)?\s*(nm)?$/.test(name))) throw new FileError(`holds bands of wavelengths${ELSEWHERE}`);
  if (!color) throw new FileError(`columns: beside the angles there must be r, g, b, or x, y, z, or f; found ${values.join(", ").slice(0, 80) || "none"}`);
  return { names, scales, separator, color };
}

// Rows of numbers by the names of their columns; those with angles only are left out.
function table(lines, start, { names, separator }) {
  const rows = [];
  let empty = 0;
  for (let k = start; k < lines.length; k++) {
    let line = lines[k];
    if (!line.trim() || line.trimStart().startsWith("#")) continue;
    if (line.length > LONGEST) throw new FileError(`line ${k + 1}: is longer than ${LONGEST} characters`);
    if (separator !== ",") line = line.replaceAll(",", ".");
    const found = cells(line, separator);
    while (found.length > names.length && !found.at(-1)) found.pop();
    if (!found.some(Boolean)) continue;
    if (found.length !== names.length) throw new FileError(`line ${k + 1}: ${found.length} values, expected ${names.length}`);
    if (names.every((name, c) => Boolean(found[c]) === ANGLES.includes(name))) {
      empty ||= k + 1;
      continue;
    }
    const row = {};
    names.forEach((name, c) => {
      const value = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(found[c]) ? Number(found[c]) : NaN;
      if (!(Math.abs(value) <= LARGEST)) throw new FileError(`line ${k + 1}: column ${name}: ${quoted(found[c])} is not a finite number`);
      row[name] = value;
    });
    rows.push(row);
  }
  if (!rows.length) throw new FileError(empty ? `is a plan that is not filled in, from line ${empty} on` : "holds no samples");
  return rows;
}

// Samples above the horizon, those of one pair of directions averaged; see nacre.measured.deduplication.
function sorted(rows, { scales, color }) {
  const known = new Map();
  for (const row of rows) {
    const [ti, pi, to, po] = ANGLES.map((name) => row[name] * scales[name]);
    if (!(Math.min(ti, to) >= 0 && Math.max(ti, to) <= Math.PI * (1 + 1e-6))) throw new FileError("polar angles: must lie from 0 to 180 degrees; check the units");
    const [wi, wo] = [[ti, pi], [to, po]].map(([t, p]) => [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)]), rgb = color(row);
    if (row[NOISE] < 0) throw new FileError(`column ${NOISE}: a standard deviation is negative`);
    if (!(Math.min(wi[2], wo[2]) > 1e-6) || !(Math.max(...rgb) >= 0)) continue;
    const [x, y] = Math.hypot(wi[0], wi[1]) > 1e-6 ? wi : wo, r = Math.hypot(x, y), [c, s] = r > 0 ? [x / r, y / r] : [0, 0];
    const key = [wi, wo].flatMap((w) => [c * w[0] + s * w[1], Math.abs(c * w[1] - s * w[0]), w[2]].map((v) => Math.round(v * 1e6))).join();
    const sample = known.get(key) ?? { wi, wo, rgb: [0, 0, 0], count: 0 };
    known.set(key, { ...sample, rgb: sample.rgb.map((v, k) => v + rgb[k]), count: sample.count + 1 });
  }
  if (!known.size) throw new FileError("samples: no sample is above the horizon and measured");
  const all = [...known.values()], packed = (of) => Float32Array.from(all.flatMap(of));
  return {
    count: all.length, wi: packed(({ wi }) => [...wi, 0]), wo: packed(({ wo }) => [...wo, 0]),
    rgb: packed(({ rgb, count }) => [...rgb.map((v) => v / count), 1]),
  };
}
