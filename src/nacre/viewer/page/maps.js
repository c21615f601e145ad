// Environments as nacre's viewer/maps.py codes them: wavelets of logarithms.

const LIFTS = [-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971];
const SCALE = 1.230174104914001;

// Linear RGB of a map's bytes, three numbers a pixel.
export function pixelsOf(bytes, { width, height, levels, steps, floor }) {
  let at = 0;
  const number = () => {
    let value = 0, shift = 0, byte;
    do {
      byte = bytes[at++];
      value |= (byte & 127) << shift;
      shift += 7;
    } while (byte > 127);
    return (value >>> 1) ^ -(value & 1);
  };
  const band = (w, h, step) => {
    const found = new Float32Array(w * h);
    for (let k = 0; k < found.length; k++) found[k] = step * number();
    return found;
  };
  const [green, red, blue] = steps.map((step) => {
    let w = width >> levels, h = height >> levels, values = band(w, h, step);
    for (let level = 0; level < levels; level++) {
      const [across, down, both] = [0, 1, 2].map(() => band(w, h, step));
      const left = joined(values, down, h, w, w, 1, false), right = joined(across, both, h, w, w, 1, false);
      values = joined(left, right, w, 2 * h, 1, w, true);
      w *= 2;
      h *= 2;
    }
    return values;
  });
  const pixels = new Float32Array(3 * width * height);
  for (let k = 0; k < green.length; k++) {
    const light = 2 ** green[k];
    pixels[3 * k] = Math.max(light * 2 ** red[k] - floor, 0);
    pixels[3 * k + 1] = Math.max(light - floor, 0);
    pixels[3 * k + 2] = Math.max(light * 2 ** blue[k] - floor, 0);
  }
  return pixels;
}

// Means and details of pictures, put together along one axis: `count` of each on a line, `stride` apart;
// there are `lines`, `next` apart. At the ends a picture goes on from its start, or is mirrored.
function joined(means, details, count, lines, stride, next, periodic) {
  const whole = new Float32Array(2 * means.length), even = new Float64Array(count), odd = new Float64Array(count);
  const apart = next === 1 ? 1 : 2 * next;
  for (let line = 0; line < lines; line++) {
    for (let k = 0; k < count; k++) {
      even[k] = means[line * next + k * stride] / SCALE;
      odd[k] = details[line * next + k * stride] * SCALE;
    }
    for (let step = LIFTS.length - 1; step >= 0; step--) {
      const lift = LIFTS[step];
      if (step % 2) for (let k = 0; k < count; k++) even[k] -= lift * (odd[k] + odd[k || !periodic ? Math.max(k - 1, 0) : count - 1]);
      else for (let k = 0; k < count; k++) odd[k] -= lift * (even[k] + even[k + 1 < count ? k + 1 : periodic ? 0 : k]);
    }
    for (let k = 0; k < count; k++) {
      whole[line * apart + 2 * k * stride] = even[k];
      whole[line * apart + (2 * k + 1) * stride] = odd[k];
    }
  }
  return whole;
}
