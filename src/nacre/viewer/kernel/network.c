// The fit of a network: forward, backward and Adam over mini-batches, as nacre.neural.kernel_code.
//
// A panel of samples goes through all layers and back while it is in the first-level cache; its part
// of the gradient is added to sums of vectors, whose lanes are added when the batch is done.

#include "kernel.h"

enum {
  LAYERS = 6,      // of weights, at most
  TILE = 3,        // rows of a tile; widths are padded to whole tiles by weights that stay zero
  PANEL = 32,      // samples
  VECTORS = 4,     // of samples in a tile
  OUTPUTS = 3,
  WIDEST = 96,     // units of a layer
  STEP = PANEL / 4 // vectors from one row of a panel to the next
};

typedef struct {
  int32_t layers, squared, size;  // weights and biases, padded to whole vectors
  int32_t sizes[LAYERS + 1], widths[LAYERS + 1], starts[LAYERS];
  f4 *weights, *mean, *square;    // one behind the other: the state
  f4 *sums;                       // of the gradient, a vector for each weight
  f4 *x[LAYERS + 1], *g[LAYERS + 1], *roots[LAYERS + 1];  // rows of a panel
  f4 targets[4 * STEP];           // f cos theta_i of three channels, and the weight
} Network;

INLINE f4 all(float x) { return (f4){x, x, x, x}; }
INLINE f4 choose(i4 where, f4 a, f4 b) { return (f4)((where & (i4)a) | (~where & (i4)b)); }
INLINE f4 positive(f4 x) { return (f4)((x > 0.0f) & (i4)x); }
INLINE f4 magnitude(f4 x) { return (f4)((i4)x & 0x7fffffff); }
INLINE float lanes(f4 x) { return (x[0] + x[1]) + (x[2] + x[3]); }

// e^x to 2 ulp, coefficients from Cephes.
INLINE f4 exponential(f4 x) {
  x = choose(x > -87.0f, x, all(-87.0f));
  x = choose(x < 88.0f, x, all(88.0f));
  f4 n = x * 1.44269504f + 12582912.0f;  // rounds to a whole number, in the last bits
  i4 whole = (i4)n - 0x4b400000;
  n -= 12582912.0f;
  f4 r = (x - n * 0.693359375f) + n * 2.12194440e-4f, p = all(1.9875691500e-4f);
  p = p * r + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  return (p * r * r + r + 1.0f) * (f4)((whole + 127) << 23);
}

// Logarithm of a positive normal number to 2 ulp, coefficients from Cephes.
INLINE f4 logarithm(f4 x) {
  i4 whole = ((i4)x - 0x3f3504f3) >> 23;
  f4 f = (f4)((i4)x - (whole << 23)) - 1.0f, z = f * f, p = all(7.0376836292e-2f);
  p = p * f - 1.1514610310e-1f;
  p = p * f + 1.1676998740e-1f;
  p = p * f - 1.2420140846e-1f;
  p = p * f + 1.4249322787e-1f;
  p = p * f - 1.6668057665e-1f;
  p = p * f + 2.0000714765e-1f;
  p = p * f - 2.4999993993e-1f;
  p = p * f + 3.3333331174e-1f;
  return __builtin_convertvector(whole, f4) * 0.69314718056f + (f - 0.5f * z + z * f * p);
}

static int32_t padded(int32_t n) { return (n + TILE - 1) / TILE * TILE; }

// Lay a network out in memory, or with none tell how many bytes it takes.
static uint32_t laid(Network *to, const int32_t *sizes, int32_t layers, char *memory) {
  Network scratch, *net = memory ? to : &scratch;
  net->layers = layers;
  int32_t size = 0, rows = 0;
  for (int32_t k = 0; k <= layers; k++) {
    net->sizes[k] = sizes[k];
    net->widths[k] = padded(sizes[k]);
    rows += net->widths[k];
    if (k) {
      net->starts[k - 1] = size;
      size += (net->widths[k - 1] + 1) * net->widths[k];
    }
  }
  net->size = size = (size + 3) / 4 * 4;
  uint32_t at = ALIGNED(sizeof(Network));
  if (memory) {
    net->weights = (f4 *)(memory + at);
    net->mean = net->weights + size / 4;
    net->square = net->mean + size / 4;
    net->sums = net->square + size / 4;
    f4 *row = net->sums + size;
    for (int32_t k = 0; k <= layers; k++) {
      net->x[k] = row;
      net->g[k] = row + rows * STEP;
      net->roots[k] = row + 2 * rows * STEP;
      row += net->widths[k] * STEP;
    }
  }
  return at + ALIGNED(4 * 3 * size + 16 * size + 3 * 16 * STEP * rows);
}

// Bytes of a network; 0 if it is too large. `sizes` are one more than `layers`.
EXPORT uint32_t network_bytes(const int32_t *sizes, int32_t layers) {
  if (layers < 1 || layers > LAYERS || sizes[layers] != OUTPUTS) return 0;
  for (int32_t k = 0; k <= layers; k++)
    if (sizes[k] < 1 || sizes[k] > WIDEST) return 0;
  return laid(0, sizes, layers, 0);
}

// A network in zeroed memory of that many bytes, at a multiple of 64.
EXPORT void network_new(void *memory, const int32_t *sizes, int32_t layers, int32_t squared) {
  Network *net = memory;
  laid(net, sizes, layers, memory);
  net->squared = squared;
}

// Weights, means and squares of the gradient: three times `network_size` numbers, one after the other.
EXPORT float *network_state(Network *net) { return (float *)net->weights; }
EXPORT int32_t network_size(Network *net) { return net->size; }

// Copy weights between the state, or the gradient where `gradient`, and a list as files have it: layer
// by layer, biases after weights.
EXPORT void network_list(Network *net, float *list, int32_t put, int32_t gradient) {
  for (int32_t layer = 0; layer < net->layers; layer++)
    for (int32_t i = 0; i <= net->sizes[layer]; i++)
      for (int32_t j = 0; j < net->sizes[layer + 1]; j++) {
        int32_t row = i < net->sizes[layer] ? i : net->widths[layer];
        int32_t at = net->starts[layer] + row * net->widths[layer + 1] + j;
        float *own = (float *)net->weights + at;
        if (put) *own = *list++;
        else *list++ = gradient ? lanes(net->sums[at]) : *own;
      }
}

// Lay blocks in an order side by side, feature by feature; returns how many samples they have.
INLINE int32_t gathered(Network *net, const float *blocks, const int32_t *order, int32_t count) {
  int32_t rows = net->sizes[0], most = PANEL / BLOCK;
  if (count > most) count = most;
  for (int32_t k = 0; k < count; k++) {
    const f4 *from = (const f4 *)(blocks + (int64_t)order[k] * (rows + 4) * BLOCK);
    for (int32_t f = 0; f < rows + 4; f++) {
      f4 *to = (f < rows ? net->x[0] + f * STEP : net->targets + (f - rows) * STEP) + k * 4;
      for (int32_t v = 0; v < 4; v++) to[v] = from[4 * f + v];
    }
  }
  return count * BLOCK;
}

// Add products with TILE columns of weights to vectors of samples: rows of x with a STEP between them.
#define PRODUCTS(sum, x, count, w, along, across)                                       \
  for (int32_t i = 0; i < (count); i++) {                                                \
    f4 w0 = all((w)[i * (along)]), w1 = all((w)[i * (along) + (across)]),                \
       w2 = all((w)[i * (along) + 2 * (across)]);                                        \
    for (int32_t v = 0; v < VECTORS; v++) {                                              \
      f4 value = (x)[i * STEP + v];                                                      \
      sum[0][v] += w0 * value;                                                           \
      sum[1][v] += w1 * value;                                                           \
      sum[2][v] += w2 * value;                                                           \
    }                                                                                    \
  }

// Outputs of a panel, and what its hidden layers are made of.
static void forward(Network *net) {
  for (int32_t layer = 0; layer < net->layers; layer++) {
    int32_t rows = net->widths[layer], columns = net->widths[layer + 1];
    const float *w = (float *)net->weights + net->starts[layer], *bias = w + rows * columns;
    for (int32_t t = 0; t < columns; t += TILE)
      for (int32_t part = 0; part < STEP; part += VECTORS) {
        f4 sum[TILE][VECTORS], *x = net->x[layer] + part;
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t v = 0; v < VECTORS; v++) sum[r][v] = all(bias[t + r]);
        PRODUCTS(sum, x, rows, w + t, columns, 1)
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t v = 0; v < VECTORS; v++) {
            int32_t at = (t + r) * STEP + part + v;
            f4 value = sum[r][v];
            if (layer < net->layers - 1) {
              value = positive(value);
              net->roots[layer + 1][at] = value;
              if (net->squared) value *= value;
            }
            net->x[layer + 1][at] = value;
          }
      }
  }
}

// Gradient of the outputs of so many samples of a panel, times `scale`; zero for the rest of it.
static void output_gradient(Network *net, int32_t count, float scale) {
  int32_t last = net->layers;
  for (int32_t channel = 0; channel < OUTPUTS; channel++)
    for (int32_t v = 0; v < STEP; v++) {
      int32_t at = channel * STEP + v;
      f4 gradient = all(0.0f);
      if (4 * v < count) {
        f4 e = exponential(net->x[last][at]), target = net->targets[at];
        f4 weight = net->targets[OUTPUTS * STEP + v], u = (e - 1.0f) * weight;
        f4 size = choose(weight > 1.0f, magnitude(u), u) + 1.0f;
        gradient = choose(u > target, all(scale), all(-scale)) * weight * e / size;
      }
      net->g[last][at] = gradient;
    }
}

// Gradients of all sums of a panel from those of its outputs, and their part in that of the weights.
static void backward(Network *net) {
  for (int32_t layer = net->layers - 1; layer >= 0; layer--) {
    int32_t rows = net->widths[layer], columns = net->widths[layer + 1];
    const float *w = (float *)net->weights + net->starts[layer];
    f4 *sums = net->sums + net->starts[layer], *g = net->g[layer + 1];
    for (int32_t j = 0; j < columns; j++) {
      f4 total = g[j * STEP];
      for (int32_t v = 1; v < STEP; v++) total += g[j * STEP + v];
      sums[rows * columns + j] += total;
    }
    for (int32_t j = 0; j < columns; j += TILE)
      for (int32_t i = 0; i < rows; i += TILE) {
        f4 sum[TILE][TILE], *a = net->x[layer] + i * STEP, *b = g + j * STEP, *to = sums + i * columns + j;
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t c = 0; c < TILE; c++) sum[r][c] = to[r * columns + c];
        for (int32_t v = 0; v < STEP; v++) {
          f4 b0 = b[v], b1 = b[STEP + v], b2 = b[2 * STEP + v];
          for (int32_t r = 0; r < TILE; r++) {
            f4 value = a[r * STEP + v];
            sum[r][0] += value * b0;
            sum[r][1] += value * b1;
            sum[r][2] += value * b2;
          }
        }
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t c = 0; c < TILE; c++) to[r * columns + c] = sum[r][c];
      }
    if (!layer) break;
    for (int32_t t = 0; t < rows; t += TILE)
      for (int32_t part = 0; part < STEP; part += VECTORS) {
        f4 sum[TILE][VECTORS], *x = g + part;
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t v = 0; v < VECTORS; v++) sum[r][v] = all(0.0f);
        PRODUCTS(sum, x, columns, w + t * columns, 1, columns)
        for (int32_t r = 0; r < TILE; r++)
          for (int32_t v = 0; v < VECTORS; v++) {
            int32_t at = (t + r) * STEP + part + v;
            f4 root = net->roots[layer][at], value = sum[r][v];
            net->g[layer][at] = net->squared ? (root + root) * value : (f4)((root > 0.0f) & (i4)value);
          }
      }
  }
}

// Sums of the gradient of the mean loss of so many blocks in an order.
static void batch_gradient(Network *net, const float *blocks, const int32_t *order, int32_t count) {
  float scale = 1.0f / (float)(OUTPUTS * BLOCK * count);
  for (int32_t k = 0; k < net->size; k++) net->sums[k] = all(0.0f);
  for (int32_t k = 0; k < count; k += PANEL / BLOCK) {
    int32_t samples = gathered(net, blocks, order + k, count - k);
    forward(net);
    output_gradient(net, samples, scale);
    backward(net);
  }
}

// One step of Adam (Kingma and Ba 2015) with betas .9 and .999. Moments are cut to zero before they
// become subnormal numbers, which are slow.
static void adam(Network *net, float rate, float unbias) {
  for (int32_t k = 0; k < net->size / 4; k++) {
    const f4 *sum = net->sums + 4 * k;
    f4 g = {lanes(sum[0]), lanes(sum[1]), lanes(sum[2]), lanes(sum[3])};
    f4 m = 0.9f * net->mean[k] + 0.1f * g, v = 0.999f * net->square[k] + 0.001f * g * g;
    m = (f4)((magnitude(m) > 1e-30f) & (i4)m);
    v = (f4)((v > 1e-36f) & (i4)v);
    net->mean[k] = m;
    net->square[k] = v;
    f4 w = v * unbias;
    f4 root = {__builtin_sqrtf(w[0]), __builtin_sqrtf(w[1]), __builtin_sqrtf(w[2]), __builtin_sqrtf(w[3])};
    net->weights[k] -= rate * m / (root + 1e-8f);
  }
}

// Gradient of the mean loss over blocks in an order: see `network_list`.
EXPORT void network_gradient(Network *net, const float *blocks, const int32_t *order, int32_t count) {
  batch_gradient(net, blocks, order, count);
}

// A step for each of so many learning rates over `count` blocks in an order, `batch` at a time; `step`
// have been taken before.
EXPORT void network_train(Network *net, const float *blocks, const int32_t *order, int32_t count,
                          int32_t batch, const float *rates, int32_t steps, int32_t step) {
  for (int32_t k = 0; k < steps; k++) {
    int32_t left = count - k * batch;
    batch_gradient(net, blocks, order + k * batch, left < batch ? left : batch);
    step += 1;
    adam(net, (float)(rates[k] / (1.0 - pow(0.9, step))), (float)(1.0 / (1.0 - pow(0.999, step))));
  }
}

// Mean of |log(1 + (e^x - 1) weight) - log(1 + target)| over `count` blocks from the first. With a
// weight above 1, the logarithm goes on below e^x = 1 as -log(1 - u).
EXPORT double network_loss(Network *net, const float *blocks, int32_t first, int32_t count) {
  double total = 0.0;
  for (int32_t k = 0; k < count; k += PANEL / BLOCK) {
    int32_t order[PANEL / BLOCK];
    for (int32_t b = 0; b < PANEL / BLOCK; b++) order[b] = first + k + b;
    int32_t samples = gathered(net, blocks, order, count - k);
    forward(net);
    f4 sum = all(0.0f);
    for (int32_t channel = 0; channel < OUTPUTS; channel++)
      for (int32_t v = 0; v < samples / 4; v++) {
        int32_t at = channel * STEP + v;
        f4 weight = net->targets[OUTPUTS * STEP + v], aim = net->targets[at] + 1.0f;
        f4 u = (exponential(net->x[net->layers][at]) - 1.0f) * weight;
        i4 below = (weight > 1.0f) & (u < 0.0f);
        sum += magnitude(logarithm(choose(below, 1.0f / ((1.0f - u) * aim), (u + 1.0f) / aim)));
      }
    total += lanes(sum);
  }
  return total / ((double)count * BLOCK * OUTPUTS);
}

// Replace the targets of blocks from the first by f_r in 1/sr, at least 0.
EXPORT void network_evaluate(Network *net, float *blocks, int32_t first, int32_t count) {
  int32_t rows = net->sizes[0];
  for (int32_t k = 0; k < count; k++) {
    int32_t order = first + k;
    f4 *to = (f4 *)(blocks + (int64_t)order * (rows + 4) * BLOCK) + 4 * rows;
    gathered(net, blocks, &order, 1);
    forward(net);
    for (int32_t at = 0; at < 4 * OUTPUTS; at++)
      to[at] = positive(exponential(net->x[net->layers][at / 4 * STEP + at % 4]) - 1.0f);
  }
}
