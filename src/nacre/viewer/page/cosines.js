// What compresses well, turned back into what shaders read: see nacre.viewer.cosines.

// Bytes of the levels of a pyramid, function by function, from their differences from means of the
// level before; in place. `levels` are widths and heights.
export function summed(bytes, count, levels) {
  const size = bytes.length / count;
  for (let k = 0; k < count; k++) {
    let before = k * size;
    for (let level = 1; level < levels.length; level++) {
      const [wide, high] = levels[level - 1], [width, height] = levels[level], start = before + wide * high;
      for (let y = 0; y < height; y++) {
        const up = before + Math.min(2 * y, high - 1) * wide, low = before + Math.min(2 * y + 1, high - 1) * wide;
        for (let x = 0; x < width; x++) {
          const left = Math.min(2 * x, wide - 1), right = Math.min(2 * x + 1, wide - 1);
          const sum = bytes[up + left] + bytes[up + right] + bytes[low + left] + bytes[low + right];
          bytes[start + y * width + x] += (sum + 2) >> 2;
        }
      }
      before = start;
    }
  }
  return bytes;
}

// Functions on a grid of size^4 nodes from their rounded cosines, as bytes of tiles of views, one for
// each light: calls `taken` with each function's bytes, lowest value and step, and waits for it.
export async function unfolded(bytes, steps, size, taken) {
  const nodes = size ** 4, order = frequencies(size), waves = cosines(size), rows = size * size;
  let values = new Float32Array(nodes), spare = new Float32Array(nodes);
  const high = steps.length * nodes;
  for (const [k, step] of steps.entries()) {
    for (let j = 0; j < nodes; j++) {
      const folded = bytes[k * nodes + j] | (bytes[high + k * nodes + j] << 8);
      values[order[j]] = step * (folded & 1 ? -1 - (folded >> 1) : folded >> 1);
    }
    for (let stride = 1; stride < nodes; stride *= size) {
      along(values, spare, waves, size, stride);
      [values, spare] = [spare, values];
    }
    let low = Infinity, most = -Infinity;
    for (const value of values) {
      low = Math.min(low, value);
      most = Math.max(most, value);
    }
    const found = new Uint8Array(nodes), width = Math.max((most - low) / 255, 1e-12);
    for (let j = 0; j < nodes; j++) {
      // From (light y, light x, view y, view x) to (light y, view y, light x, view x).
      const view = j % rows, light = (j - view) / rows, x = view % size, across = light % size;
      const place = (((light - across) / size) * size + (view - x) / size) * rows + across * size + x;
      found[place] = Math.round((values[j] - low) / width);
    }
    await taken(found, k, low, width);
  }
}

// Nodes by the sum of their four indices, which are frequencies.
function frequencies(size) {
  const nodes = size ** 4, groups = Array.from({ length: 4 * size - 3 }, () => []);
  for (let j = 0; j < nodes; j++) {
    const b = Math.floor(j / size), c = Math.floor(b / size), d = Math.floor(c / size);
    groups[(j % size) + (b % size) + (c % size) + d].push(j);
  }
  return Uint32Array.from(groups.flat());
}

// waves[size k + j]: the cosine of frequency k at node j.
function cosines(size) {
  return Float32Array.from({ length: size * size }, (_, at) => {
    const j = at % size, k = (at - j) / size;
    return Math.sqrt((k ? 2 : 1) / size) * Math.cos((Math.PI * (2 * j + 1) * k) / (2 * size));
  });
}

// One axis of the sum of cosines.
function along(from, to, waves, size, stride) {
  const block = size * stride;
  to.fill(0);
  for (let start = 0; start < from.length; start += block)
    for (let k = 0; k < size; k++)
      for (let j = 0; j < size; j++) {
        const wave = waves[size * k + j], source = start + k * stride, target = start + j * stride;
        for (let i = 0; i < stride; i++) to[target + i] += wave * from[source + i];
      }
}
