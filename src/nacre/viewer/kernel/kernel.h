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
