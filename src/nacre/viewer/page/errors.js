// Numbers that say how far apart two pictures, or two reflectances, are: those of nacre.metrics.

const WINDOW = 7, REACH = 3; // pixels that similarity is over, and on either side of its middle
const STEADY = [0.01 ** 2, 0.03 ** 2]; // of structural similarity (Wang et al. 2004)

// Errors of a picture of displayed values against a true one, four numbers a pixel of each; pixels
// whose fourth is positive count. `map` has their FLIP errors, likewise.
export function pictureErrors([truth, other], map, [width, height]) {
  let count = 0, absolute = 0, squared = 0, flip = 0;
  for (let k = 0; k < truth.length; k += 4) {
    if (!(truth[k + 3] > 0)) continue;
    for (let c = 0; c < 3; c++) {
      const apart = truth[k + c] - other[k + c];
      absolute += Math.abs(apart);
      squared += apart * apart;
    }
    flip += map[k];
    count += 1;
  }
  const rmse = Math.sqrt(squared / (3 * count));
  return {
    ssim: similarity(truth, other, width, height), psnr: -20 * Math.log10(rmse),
    mae: absolute / (3 * count), rmse, flip: flip / count,
  };
}

// Mean structural similarity over windows that lie within the picture, channels averaged.
function similarity(truth, other, width, height) {
  const count = WINDOW ** 2, sample = count / (count - 1);
  let total = 0;
  for (let channel = 0; channel < 3; channel++) {
    const [a, b] = [truth, other].map((picture) => (k) => picture[4 * k + channel]);
    const [sa, sb, saa, sbb, sab] = [a, b, (k) => a(k) ** 2, (k) => b(k) ** 2, (k) => a(k) * b(k)]
      .map((value) => boxes(value, width, height));
    for (let k = 0; k < sa.length; k++) {
      const ma = sa[k] / count, mb = sb[k] / count;
      const variances = sample * (saa[k] / count - ma * ma + sbb[k] / count - mb * mb);
      const shared = sample * (sab[k] / count - ma * mb);
      total += ((2 * ma * mb + STEADY[0]) * (2 * shared + STEADY[1])) /
        ((ma * ma + mb * mb + STEADY[0]) * (variances + STEADY[1]));
    }
  }
  return total / (3 * (width - 2 * REACH) * (height - 2 * REACH));
}

// Sums over all windows of a picture.
function boxes(value, width, height) {
  const across = runs(value, width, height);
  return runs((k) => across[k], height, width - 2 * REACH);
}

// Sums over runs along the rows of a picture, which are the columns of the result.
function runs(value, width, height) {
  const found = new Float64Array((width - 2 * REACH) * height);
  for (let j = 0; j < height; j++)
    for (let i = 0, sum = 0; i < width; i++) {
      sum += value(j * width + i);
      if (i >= WINDOW) sum -= value(j * width + i - WINDOW);
      if (i >= WINDOW - 1) found[(i - WINDOW + 1) * height + j] = sum;
    }
  return found;
}

// Errors of reflectances over pairs of directions, four numbers a pair, where the true one's fourth is
// positive; `wi` has three numbers a pair.
export function angularErrors([truth, other], wi) {
  const logarithmic = [], relative = [];
  let squared = 0;
  for (let k = 0; k < wi.length / 3; k++) {
    if (!(truth[4 * k + 3] > 0)) continue;
    let sum = 0;
    for (let c = 0; c < 3; c++) {
      const cosine = wi[3 * k + 2], [f, g] = [truth, other].map((values) => values[4 * k + c]);
      sum += Math.abs(Math.log1p(f * cosine) - Math.log1p(g * cosine));
      squared += ((g - f) * cosine) ** 2;
      if (f > 0) relative.push(Math.abs(g - f) / f);
    }
    logarithmic.push(sum / 3);
  }
  const count = logarithmic.length;
  return {
    count, log_cosine: logarithmic.reduce((a, b) => a + b, 0) / count, log_cosine_p95: quantile(logarithmic, 0.95),
    relative_median: quantile(relative, 0.5), rmse_cosine: Math.sqrt(squared / (3 * count)),
  };
}

// Linear between the values around it; 0 of none.
function quantile(values, part) {
  if (!values.length) return 0;
  const sorted = Float64Array.from(values).sort(), at = part * (sorted.length - 1), low = Math.floor(at);
  return sorted[low] + (at - low) * (sorted[Math.min(low + 1, sorted.length - 1)] - sorted[low]);
}
