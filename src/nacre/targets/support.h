// What all materials use, in front of elementary functions.

#define NACRE_PANEL 16  // pairs that are evaluated side by side

#if defined(__GNUC__)
#define NACRE_INLINE static inline __attribute__((always_inline))
#define NACRE_ROLLED _Pragma("GCC unroll 1")  // lest single steps of the loop are all there is
#elif defined(_MSC_VER)
#define NACRE_INLINE static __forceinline
#define NACRE_ROLLED
#else
#define NACRE_INLINE static inline
#define NACRE_ROLLED
#endif

#if defined(__clang__)
#define NACRE_UNROLLED _Pragma("clang loop unroll(full)")  // it vectorizes innermost loops only
#else
#define NACRE_UNROLLED
#endif

NACRE_INLINE int32_t nacre_bits(float x) {
    int32_t n;
    memcpy(&n, &x, sizeof n);
    return n;
}

NACRE_INLINE float nacre_float(int32_t n) {
    float x;
    memcpy(&x, &n, sizeof x);
    return x;
}

// Whole numbers wrap around.
NACRE_INLINE int32_t nacre_add(int32_t a, int32_t b) {
    return (int32_t)((uint32_t)a + (uint32_t)b);
}

NACRE_INLINE int32_t nacre_sub(int32_t a, int32_t b) {
    return (int32_t)((uint32_t)a - (uint32_t)b);
}

NACRE_INLINE int32_t nacre_shl(int32_t a, int32_t b) {
    return (int32_t)((uint32_t)a << b);
}

// a where the condition is 1, b where it is 0; without a branch, which would not be vectorized.
NACRE_INLINE float nacre_pick(int condition, float a, float b) {
    const int32_t mask = -(int32_t)condition;
    return nacre_float((nacre_bits(a) & mask) | (nacre_bits(b) & ~mask));
}

NACRE_INLINE float nacre_min(float a, float b) { return nacre_pick(b < a, b, a); }
NACRE_INLINE float nacre_max(float a, float b) { return nacre_pick(b > a, b, a); }

NACRE_INLINE float nacre_to_float(int32_t n) { return (float)n; }

NACRE_INLINE float nacre_fma(float a, float b, float c) {
#ifdef FP_FAST_FMAF
    return fmaf(a, b, c);
#else
    return a * b + c;
#endif
}

// Of finite numbers that are not negative.
NACRE_INLINE float nacre_sqrt(float x) {
#if defined(__NO_MATH_ERRNO__) || !defined(__GNUC__)
    return sqrtf(x);
#else  // sqrtf may set errno and is not vectorized: Newton's method for 1 / sqrt(x)
    const float half = 0.5f * x;
    float y = nacre_float(nacre_sub(0x5f3759df, nacre_bits(x) >> 1));
    y *= nacre_fma(-half * y, y, 1.5f);
    y *= nacre_fma(-half * y, y, 1.5f);
    y *= nacre_fma(-half * y, y, 1.5f);
    return x * y;
#endif
}

// Vectors one after the other, from and to a panel of their components.
NACRE_INLINE void nacre_split(const float *vectors, float *panel) {
    NACRE_ROLLED
    for (size_t l = 0; l < NACRE_PANEL; l++) {
        panel[l] = vectors[3 * l];
        panel[NACRE_PANEL + l] = vectors[3 * l + 1];
        panel[2 * NACRE_PANEL + l] = vectors[3 * l + 2];
    }
}

NACRE_INLINE void nacre_join(const float *panel, float *vectors) {
    NACRE_ROLLED
    for (size_t l = 0; l < NACRE_PANEL; l++) {
        vectors[3 * l] = panel[l];
        vectors[3 * l + 1] = panel[NACRE_PANEL + l];
        vectors[3 * l + 2] = panel[2 * NACRE_PANEL + l];
    }
}
