// Materials of the RGL database: see nacre.measured.rgl_tables.

import { halves } from "./halves.js";
import { readFields } from "./rgl_fields.js";
import { FileError } from "./tensors.js";

const NODE_LIMIT = 4096; // along any one axis of a table
const DENSEST = Math.fround(1e30);

export function readRgl(buffer) {
  const fields = new Fields(readFields(buffer));
  const phi = fields.angles("phi_i", 2 * Math.PI), theta = fields.angles("theta_i", Math.PI / 2);
  const start = [phi.values.length, theta.values.length], slices = start[0] * start[1];
  if (fields.has("spectra") || fields.has("wavelengths"))
    throw new FileError("holds spectra; open the file of colors, whose name ends in _rgb.bsdf, or make a page of this one with nacre view");
  const rgb = fields.floats("rgb", [...start, 3, null, null]), [height, width] = rgb.shape.slice(3);
  const name = fields.text("description");
  const ndf = fields.positive("ndf", [null, null]), sigma = fields.positive("sigma", [null, null]);
  const vndf = fields.density("vndf", [...start, null, null]);
  fields.density("luminance", [...start, height, width]);
  const jacobian = fields.flag("jacobian"), isotropic = start[0] <= 2;
  const spanned = phi.values[start[0] - 1] - phi.values[0];
  const reduction = isotropic ? 1 : Math.round((2 * Math.PI) / spanned);
  if (![1, 2, 4].includes(reduction))
    throw fields.error("phi_i", "must span a full turn, a half or a quarter of one, as the symmetry allows");
  if (reduction > 1 && Math.abs(phi.values[0] + Math.PI) > 1e-3)
    throw fields.error("phi_i", "must start at -pi where it spans less than a full turn");
  const colors = halves(interleaved(rgb.values, slices, height * width));
  const single = ({ shape, values }, depth = 1) => ({ size: [shape.at(-1), shape.at(-2) ?? 1, depth], channels: 1, values });
  return {
    name,
    table: {
      kind: "rgl", scale: colors.scale, jacobian, isotropic, reduction,
      grids: {
        phi: single(phi), theta: single(theta), ndf: single(ndf), sigma: single(sigma), vndf: single(vndf, slices),
        rgb: { size: [width, height, slices], channels: 3, values: colors.values },
      },
    },
    known: {
      Model: "RglBrdf",
      Grid: `theta_i x phi_i: ${start[1]} x ${start[0]}; vndf ${vndf.shape.slice(2).join(" x ")}; rgb ${height} x ${width}`,
    },
  };
}

// Channels of a point side by side, of slices that hold one after another.
function interleaved(values, slices, points) {
  const found = new Float32Array(values.length);
  for (let slice = 0; slice < slices; slice++)
    for (let c = 0; c < 3; c++) {
      const start = 3 * slice * points;
      for (let k = 0; k < points; k++) found[start + 3 * k + c] = values[start + c * points + k];
    }
  return found;
}

// Fields, checked as they are taken; every complaint names the field.
class Fields {
  constructor(fields) {
    this.fields = fields;
  }

  has(name) {
    return this.fields.has(name);
  }

  error(name, problem) {
    return new FileError(`field '${name}': ${problem}`);
  }

  get(name) {
    const found = this.fields.get(name);
    if (!found) throw this.error(name, `is missing, found ${[...this.fields.keys()].join(", ").slice(0, 200)}`);
    return found;
  }

  // Single-precision numbers; null in `shape` stands for any number of nodes from 2.
  floats(name, shape) {
    const { type, shape: found, values } = this.get(name);
    if (type !== "float32") throw this.error(name, `holds ${type}, expected float32`);
    const fits = (have, size) => (size === null ? have >= 2 && have <= NODE_LIMIT : have === size);
    if (found.length !== shape.length || !found.every((have, k) => fits(have, shape[k]))) {
      const wanted = shape.map((size) => size ?? "n").join(", ");
      throw this.error(name, `has shape (${found.join(", ")}), expected (${wanted}) with n from 2 to ${NODE_LIMIT}`);
    }
    const numbers = values();
    if (!numbers.every(Number.isFinite)) throw this.error(name, "holds values that are not finite");
    return { shape: found, values: numbers };
  }

  angles(name, limit) {
    const { shape } = this.get(name), found = this.floats(name, shape), { values } = found;
    if (shape.length !== 1 || values.length > NODE_LIMIT)
      throw this.error(name, `has shape (${shape.join(", ")}), expected one list of angles`);
    if (!values.every((angle, k) => !k || angle > values[k - 1])) throw this.error(name, "angles must increase");
    if (!values.every((angle) => Math.abs(angle) <= limit + 1e-4))
      throw this.error(name, `angles must be radians of magnitude up to ${limit.toFixed(4)}`);
    return found;
  }

  positive(name, shape) {
    const found = this.floats(name, shape);
    for (const value of found.values) {
      if (value < 0) throw this.error(name, "holds negative values, which a density cannot have");
      if (value > DENSEST) throw this.error(name, "holds values above 1e+30, which no density has");
    }
    return found;
  }

  density(name, shape) {
    const found = this.positive(name, shape), [azimuths, polars, ...sides] = found.shape, points = sides[0] * sides[1];
    for (let slice = 0; slice < azimuths * polars; slice++)
      if (!found.values.subarray(slice * points, (slice + 1) * points).some((value) => value > 0))
        throw this.error(name, `is zero throughout for phi_i ${Math.floor(slice / polars)}, theta_i ${slice % polars}`);
    return found;
  }

  text(name) {
    const { type, shape, bytes } = this.get(name);
    if (shape.length !== 1 || !type.endsWith("int8")) throw this.error(name, "is not a text");
    return new TextDecoder().decode(bytes()).replace(/\0+$/, "").trim();
  }

  flag(name) {
    const { type, shape, bytes } = this.get(name);
    if (!type.endsWith("int8") || shape.some((size) => size !== 1) || bytes()[0] > 1) throw this.error(name, "must be one byte, 0 or 1");
    return bytes()[0] === 1;
  }
}
