// Half-precision numbers: 1 bit of sign, 5 of exponent, 10 of fraction (IEEE 754 binary16).

const single = new Float32Array(1), bits = new Uint32Array(single.buffer);
const LARGEST = 65504;

export function fromHalf(half) {
  const sign = half & 0x8000 ? -1 : 1, exponent = (half >> 10) & 31, fraction = half & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
}

// The nearest half of a number that is finite in single precision, ties to even.
export function toHalf(value) {
  single[0] = value;
  const sign = (bits[0] >>> 16) & 0x8000, exponent = ((bits[0] >>> 23) & 255) - 112;
  if (exponent > 30) return sign | 0x7c00;
  if (exponent < -10) return sign;
  const fraction = bits[0] & 0x7fffff, shift = exponent > 0 ? 13 : 14 - exponent;
  const whole = exponent > 0 ? (exponent << 23) | fraction : 0x800000 | fraction;
  const half = whole >>> shift, rest = whole & ((1 << shift) - 1), middle = 1 << (shift - 1);
  return sign | (half + (rest > middle || (rest === middle && half & 1) ? 1 : 0));
}

// The nearest number that a half holds.
export const rounded = (value) => fromHalf(toHalf(Math.min(Math.max(value, -LARGEST), LARGEST)));

// {scale, values}: numbers as halves times a power of two, the smallest that lets the largest fit.
export function halves(numbers) {
  let largest = 0;
  for (const number of numbers) largest = Math.max(largest, Math.abs(number));
  const scale = largest ? 2 ** Math.min(Math.max(Math.ceil(Math.log2(largest / LARGEST)), -100), 127) : 1;
  const values = new Uint16Array(numbers.length);
  for (let k = 0; k < numbers.length; k++) values[k] = toHalf(numbers[k] / scale);
  return { scale, values };
}
