// NumPy's default generator: PCG-XSL-RR (O'Neill 2014) seeded by NumPy's SeedSequence, the same numbers.

#include "kernel.h"

INLINE uint64_t product_high(uint64_t a, uint64_t b) {
  uint64_t al = (uint32_t)a, ah = a >> 32, bl = (uint32_t)b, bh = b >> 32;
  uint64_t middle = ah * bl + (al * bl >> 32), other = al * bh + (uint32_t)middle;
  return ah * bh + (middle >> 32) + (other >> 32);
}

static void step(Random *r) {
  const uint64_t high = 2549297995355413924u, low = 4865540595714422341u;
  uint64_t upper = product_high(r->low, low) + r->high * low + r->low * high;
  uint64_t lower = r->low * low + r->add_low;
  r->high = upper + r->add_high + (lower < r->add_low);
  r->low = lower;
}

static uint64_t next64(Random *r) {
  step(r);
  uint64_t mixed = r->high ^ r->low;
  uint32_t by = (uint32_t)(r->high >> 58);
  return mixed >> by | mixed << (-by & 63);
}

static uint32_t next32(Random *r) {
  if (r->half) {
    r->half = 0;
    return (uint32_t)r->kept;
  }
  uint64_t bits = next64(r);
  r->half = 1;
  r->kept = bits >> 32;
  return (uint32_t)bits;
}

static double uniform(Random *r) { return (double)(next64(r) >> 11) / 9007199254740992.0; }

static uint32_t hashed(uint32_t value, uint32_t *constant, uint32_t factor) {
  value ^= *constant;
  *constant *= factor;
  value *= *constant;
  return value ^ value >> 16;
}

static uint32_t mixed(uint32_t x, uint32_t y) {
  uint32_t found = 0xca01f9ddu * x - 0x4973f715u * y;
  return found ^ found >> 16;
}

// A generator in 48 bytes, as default_rng(seed) of a list of numbers.
EXPORT void random_seed(Random *r, const uint32_t *seed, int32_t count) {
  uint32_t pool[4], words[8], constant = 0x43b0d7e5u;
  for (int32_t k = 0; k < 4; k++) pool[k] = hashed(k < count ? seed[k] : 0, &constant, 0x931e8875u);
  for (int32_t from = 0; from < 4; from++)
    for (int32_t to = 0; to < 4; to++)
      if (from != to) pool[to] = mixed(pool[to], hashed(pool[from], &constant, 0x931e8875u));
  constant = 0x8b51f9ddu;
  for (int32_t k = 0; k < 8; k++) words[k] = hashed(pool[k % 4], &constant, 0x58f38dedu);
#define WORD(k) ((uint64_t)words[2 * (k) + 1] << 32 | words[2 * (k)])
  *r = (Random){.add_high = WORD(2) << 1 | WORD(3) >> 63, .add_low = WORD(3) << 1 | 1};
  step(r);
  r->low += WORD(1);
  r->high += WORD(0) + (r->low < WORD(1));
  step(r);
}

// Numbers in [0, 1), as Generator.random does in either precision.
EXPORT void random_floats(Random *r, float *to, int32_t count) {
  for (int32_t k = 0; k < count; k++) to[k] = (float)(next32(r) >> 8) / 16777216.0f;
}

EXPORT void random_doubles(Random *r, double *to, int32_t count) {
  for (int32_t k = 0; k < count; k++) to[k] = uniform(r);
}

// Generator.permutation of so many whole numbers.
EXPORT void random_order(Random *r, int32_t *order, int32_t count) {
  for (int32_t k = 0; k < count; k++) order[k] = k;
  for (uint32_t k = (uint32_t)count - 1, mask, other; count > 1 && k > 0; k--) {
    mask = 0xffffffffu >> __builtin_clz(k);
    while ((other = next32(r) & mask) > k);
    int32_t held = order[k];
    order[k] = order[other];
    order[other] = held;
  }
}

// Generator.normal(0, scale) in single precision: the ziggurat of Marsaglia and Tsang 2000.
EXPORT void random_normals(Random *r, double scale, float *to, int32_t count) {
  static uint64_t inside[256];
  static double width[256], height[256];
  const double end = 3.6541528853610087963519472518, area = 0.0049286732339746571, whole = 4503599627370496.0;
  if (!inside[0]) {
    double x = end, before = end, q = area / exp(-0.5 * x * x);
    inside[0] = (uint64_t)(x / q * whole);
    width[0] = q / whole;
    width[255] = x / whole;
    height[0] = 1.0;
    height[255] = exp(-0.5 * x * x);
    for (int32_t k = 254; k >= 1; k--) {
      x = sqrt(-2.0 * log(area / x + exp(-0.5 * x * x)));
      inside[k + 1] = (uint64_t)(x / before * whole);
      before = x;
      height[k] = exp(-0.5 * x * x);
      width[k] = x / whole;
    }
  }
  for (int32_t k = 0; k < count; k++)
    for (;;) {
      uint64_t bits = next64(r), place = bits >> 9 & 0xfffffffffffffu;
      int32_t layer = bits & 255, negative = bits >> 8 & 1;
      double x = (double)place * width[layer];
      if (negative) x = -x;
      to[k] = (float)(scale * x);
      if (place < inside[layer]) break;
      if (layer) {
        if ((height[layer - 1] - height[layer]) * uniform(r) + height[layer] < exp(-0.5 * x * x)) break;
        continue;
      }
      double beyond, other;
      do {
        beyond = -log(1.0 - uniform(r)) / end;
        other = -log(1.0 - uniform(r));
      } while (other + other <= beyond * beyond);
      to[k] = (float)(scale * (place >> 8 & 1 ? -(end + beyond) : end + beyond));
      break;
    }
}
