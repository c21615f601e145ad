// Tables as the renderer draws them: grids in 3-D textures, and GLSL that looks values up in them.
//
// A table is {kind, scale, grids}, and for some kinds more that lookups.js reads; a grid is {size,
// channels, values}, the first axis fastest, of half or single precision: halves are f_r / scale.

import { lookup } from "./lookups.js";
import { FileError } from "./tensors.js";

// {glsl, textures, known} of a table: `known` is GLSL that is 1 where the table is valid, otherwise 0.
// `sampler` is GLSL that draws directions, for any table.
export function shown(context, table, sampler) {
  const { gl } = context, most = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
  const grids = table.kind === "rgl" ? { ...table.grids, ...integrated(table.grids.vndf) } : table.grids;
  for (const { size } of Object.values(grids))
    if (size.some((count) => count > most))
      throw new FileError(`has ${size.join(" x ")} nodes; this browser draws up to ${most} along an axis`);
  const textures = {};
  for (const [name, { size, channels, values }] of Object.entries(grids))
    textures[`material_${name}`] = context.volume(size, channels, values);
  return { glsl: `${lookup(table)}\n${sampler}`, textures, known: "float(material_known(wi, wo))" };
}

// Densities on the square that integrate to 1, and their integrals: of bilinear functions, so that
// trapezoids are exact.
function integrated({ size, values }) {
  const [width, height, slices] = size, points = width * height;
  const density = new Float32Array(values.length), columns = new Float32Array(values.length), rows = new Float32Array(height * slices);
  for (let slice = 0; slice < slices; slice++) {
    const start = slice * points, along = new Float64Array(points), up = new Float64Array(height);
    for (let y = 0; y < height; y++) {
      for (let x = 1; x < width; x++) {
        const k = y * width + x;
        along[k] = along[k - 1] + (values[start + k - 1] + values[start + k]) / (2 * (width - 1));
      }
      const end = (y + 1) * width - 1;
      if (y) up[y] = up[y - 1] + (along[end - width] + along[end]) / (2 * (height - 1));
    }
    const total = up[height - 1];
    for (let k = 0; k < points; k++) {
      density[start + k] = values[start + k] / total;
      columns[start + k] = along[k] / total;
    }
    for (let y = 0; y < height; y++) rows[slice * height + y] = up[y] / total;
  }
  return {
    vndf: { size, channels: 1, values: density },
    columns: { size, channels: 1, values: columns },
    rows: { size: [height, 1, slices], channels: 1, values: rows },
  };
}
