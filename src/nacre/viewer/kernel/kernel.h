// What the sources of the page's fit kernel share: vectors of four, and the mathematics that they call.
//
// Compiled to WebAssembly with SIMD for the page, and natively for the tests; both do the same
// operations in the same order, so that they differ only where the two mathematics do.

#include <stdint.h>

typedef float f4 __attribute__((vector_size(16)));
typedef int32_t i4 __attribute__((vector_size(16)));

#ifdef __wasm__
#define EXPORT __attribute__((visibility("default")))
// JavaScript's: see page/kernel.js.
#define IMPORT(name) __attribute__((import_module("env"), import_name(#name))) double name
IMPORT(exp)(double);
IMPORT(log)(double);
IMPORT(sin)(double);
IMPORT(cos)(double);
IMPORT(atan2)(double, double);
IMPORT(pow)(double, double);
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define floor __builtin_floor
#define INFINITY __builtin_inff()
#else
#include <math.h>
#define EXPORT
#endif

#define INLINE static inline __attribute__((always_inline))
#define PI 3.14159265358979323846
enum { BLOCK = 16 };  // samples that stay together when the order of training is shuffled

// Bytes up to a multiple of 64.
#define ALIGNED(bytes) (((bytes) + 63) & ~(uint32_t)63)

// A generator of random numbers: see random.c.
typedef struct {
  uint64_t high, low, add_high, add_low;  // state and increment
  uint64_t kept;                          // the upper half of the last 64 bits, where `half`
  uint64_t half;
} Random;
void random_floats(Random *r, float *to, int32_t count);
void random_doubles(Random *r, double *to, int32_t count);
void random_normals(Random *r, double scale, float *to, int32_t count);

typedef struct { float x, y, z, w; } Vector;
typedef struct { double x, y, z; } Direction;

INLINE double larger(double a, double b) { return a > b ? a : b; }
INLINE double smaller(double a, double b) { return a < b ? a : b; }
INLINE double dot(Direction a, Direction b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

INLINE Direction normalized(Direction v) {
  double scale = 1.0 / sqrt(larger(dot(v, v), 1e-30));
  return (Direction){v.x * scale, v.y * scale, v.z * scale};
}

INLINE Direction middle(Direction a, Direction b) {
  return normalized((Direction){a.x + b.x, a.y + b.y, a.z + b.z});
}

// A direction of this cosine, by so many turns from x toward y.
INLINE Direction around(double z, double turn) {
  double radius = sqrt(larger(1.0 - z * z, 0.0));
  return (Direction){radius * cos(2.0 * PI * turn), radius * sin(2.0 * PI * turn), z};
}

INLINE Direction in_frame(Direction w, double c, double s) {
  return (Direction){c * w.x + s * w.y, c * w.y - s * w.x, w.z};
}

// The frame of a direction's azimuth: its cosine and sine, 0 at the pole; returns the polar sine.
INLINE double azimuth(Direction w, double *c, double *s) {
  double sine = sqrt(larger(w.x * w.x + w.y * w.y, 3.2e-30));
  *c = sine < 4e-15 ? 1.0 : w.x / sine;
  *s = sine < 4e-15 ? 0.0 : w.y / sine;
  return sine;
}

// The light in the frame of the half vector h: Rusinkiewicz's difference vector.
INLINE Direction difference(Direction wi, Direction h) {
  double c, s, sine = azimuth(h, &c, &s);
  Direction w = in_frame(wi, c, s);
  return (Direction){h.z * w.x - sine * w.z, w.y, sine * w.x + h.z * w.z};
}
