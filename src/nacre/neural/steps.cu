// Training steps of a stack of small networks on a graphics card, hundreds in one launch.
//
// A cluster of PARTS blocks of threads trains one network and shares its batches. Weights, moments
// and activations stay in the blocks' shared memory; only samples come from the card's memory. Every
// sum has one order, so results do not depend on which thread is first, and all blocks of a cluster
// hold the same weights to the last bit.
//
// Macros say what is compiled: WIDTHS of the layers, THREADS per block, PARTS, BATCH in blocks of 16
// samples, SQUARED (ReLUs), OFFSET, 1 or 0, of e^x, MIN_SLOPE, which is what e^x counts as at least
// where f_r is e^x and too low, and SHARED, the bytes of shared memory. `torch_steps.py` has them.

constexpr int BLOCK = 16;
constexpr int CHUNK = THREADS;      // samples that a block of threads has in shared memory
constexpr int STRIDE = CHUNK + 4;   // neighboring rows begin in different banks
constexpr int QUADS = CHUNK / 4;    // a row is read as vectors of four samples
constexpr int TILE = 8;             // outputs that a thread computes for four samples, at most
constexpr int ROWS_A = 8, ROWS_B = 3;  // the tile of the weights' gradient that a thread sums up
constexpr float LARGEST = 88.0f;    // bound of outputs: e^x of more is infinite

__device__ constexpr int width(int layer) {
    constexpr int widths[] = {WIDTHS};
    return widths[layer];
}
__device__ constexpr int layer_count() {
    constexpr int widths[] = {WIDTHS};
    return sizeof(widths) / sizeof(int) - 1;
}
constexpr int LAYERS = layer_count();
constexpr int OUTPUTS = width(LAYERS);
constexpr int SAMPLE_ROWS = width(0) + OUTPUTS + 1;  // inputs, targets, weight
constexpr int SHARE = (BATCH + PARTS - 1) / PARTS;   // of a batch, for each part
constexpr int CHUNKS = (SHARE * BLOCK + CHUNK - 1) / CHUNK;
constexpr int VECTORS = BLOCK * SAMPLE_ROWS / 4;     // that hold a block of samples
constexpr int LOADS = (QUADS * SAMPLE_ROWS + THREADS - 1) / THREADS;

__device__ constexpr int ceil_div(int a, int b) { return (a + b - 1) / b; }

// Results of a layer in a tile: a third of them or fewer, as there are threads for four tiles.
__device__ constexpr int tile_of(int results) {
    const int third = ceil_div(results, 3);
    return third < TILE ? third : ceil_div(results, ceil_div(results, TILE));
}

// Parameters of a layer are a matrix with a row for each input, and the biases below.
__device__ constexpr int first_parameter(int layer) {
    int sum = 0;
    for (int k = 0; k < layer; ++k) sum += (width(k) + 1) * width(k + 1);
    return sum;
}
constexpr int SIZE = first_parameter(LAYERS);

// Where a parameter of a network is in the card's memory: weights of the first layer of all networks,
// their biases, weights of the second layer, and so on.
__device__ inline long long place_of(int parameter, int network, int networks) {
    int first = 0;
#pragma unroll
    for (int k = 0; k < 2 * LAYERS; ++k) {
        const int size = (k % 2 ? 1 : width(k / 2)) * width(k / 2 + 1);
        if (parameter < first + size)
            return (long long)networks * first + network * size + parameter - first;
        first += size;
    }
    return -1;
}

// Rows in shared memory: of samples, of activations, of gradients, and one row of ones.
__device__ constexpr int sum_of_widths(int first, int end) {
    int sum = 0;
    for (int k = first; k < end; ++k) sum += width(k);
    return sum;
}
__device__ constexpr int activation_row(int layer) {
    return layer ? SAMPLE_ROWS + sum_of_widths(1, layer) : 0;
}
__device__ constexpr int gradient_row(int layer) {
    return SAMPLE_ROWS + sum_of_widths(1, LAYERS) + sum_of_widths(1, layer);
}
constexpr int ONES = gradient_row(LAYERS + 1);

__device__ constexpr int first_tile(int layer) {
    int sum = 0;
    for (int k = 0; k < layer; ++k)
        sum += ceil_div(width(k) + 1, ROWS_A) * ceil_div(width(k + 1), ROWS_B);
    return sum;
}
constexpr int TILES = first_tile(LAYERS);
constexpr int SPLITS = TILES < THREADS ? THREADS / TILES : 1;  // threads that share a tile's samples

struct Shared {
    float rows[(ONES + 1) * STRIDE];
    float weights[SIZE], means[SIZE], squares[SIZE];
    float partial[SPLITS][SIZE];  // gradients, of every split
#if PARTS > 1
    float gradient[2][SIZE];  // of this block, of the current and of the previous step
#endif
};
static_assert(sizeof(Shared) == SHARED, "the launch reserves as much memory as the code takes");

__device__ inline float4& quad(Shared& s, int row, int sample) {
    return *reinterpret_cast<float4*>(s.rows + row * STRIDE + sample);
}

__device__ inline float& lane(float4& v, int k) { return (&v.x)[k]; }

// Sums of COUNT rows times weights, for four samples and TILED of RESULTS results. The weights of one
// row are ACROSS apart from each other, those of one result ALONG; past the last result is the last.
template <int TILED, int RESULTS, int COUNT, int ACROSS, int ALONG>
__device__ inline void products(
    Shared& s, float4 (&sum)[TILED], int first_row, int sample, const float* weights, int first
) {
    weights += first * ACROSS;
    int places[TILED];
#pragma unroll
    for (int a = 0; a < TILED; ++a) {
        const bool fits = RESULTS % TILED == 0 || first + a < RESULTS;
        places[a] = (fits ? a : RESULTS - 1 - first) * ACROSS;
    }
#pragma unroll 3
    for (int k = 0; k < COUNT; ++k) {
        const float4 x = quad(s, first_row + k, sample);
#pragma unroll
        for (int a = 0; a < TILED; ++a) {
            const float w = weights[places[a] + k * ALONG];
            sum[a].x = fmaf(w, x.x, sum[a].x);
            sum[a].y = fmaf(w, x.y, sum[a].y);
            sum[a].z = fmaf(w, x.z, sum[a].z);
            sum[a].w = fmaf(w, x.w, sum[a].w);
        }
    }
}

// Gradient of the loss |log(1 + u) - log(1 + target)| by an output x, where u = (e^x - OFFSET) weight.
// With a weight above 1 the logarithm goes on below u = 0 as -log(1 - u).
__device__ inline float loss_slope(float x, float target, float weight, float scale) {
    const float e = expf(x > LARGEST ? LARGEST : x);
    const float u = (e - OFFSET) * weight;
    const float side = (float)(u > target) - (float)(u < target);
    const float slope = OFFSET || u >= target || e >= MIN_SLOPE ? e : MIN_SLOPE;
    return side * (weight * scale) * slope / (1.0f + (weight > 1.0f ? fabsf(u) : u));
}

// Outputs of a layer; of the last one, the gradients of the loss by them. Samples from `valid` on
// are no samples, and have none.
template <int L>
__device__ void forward(Shared& s, int valid, float scale) {
    constexpr int in = width(L), out = width(L + 1);
    constexpr int tile = tile_of(out), groups = ceil_div(out, tile);
    const float* weights = s.weights + first_parameter(L);
    for (int item = threadIdx.x; item < groups * QUADS; item += THREADS) {
        const int sample = item % QUADS * 4, first = item / QUADS * tile;
        float4 sum[tile];
#pragma unroll
        for (int a = 0; a < tile; ++a) {
            const float bias = weights[in * out + (first + a < out ? first + a : out - 1)];
            sum[a] = make_float4(bias, bias, bias, bias);
        }
        products<tile, out, in, 1, out>(s, sum, activation_row(L), sample, weights, first);
#pragma unroll
        for (int a = 0; a < tile; ++a) {
            if (out % tile && first + a >= out) continue;
            if constexpr (L + 1 < LAYERS) {
                for (int k = 0; k < 4; ++k) {
                    const float x = lane(sum[a], k), y = x < 0.0f ? 0.0f : x;  // keeps NaNs
                    lane(sum[a], k) = SQUARED ? y * y : y;
                }
                quad(s, activation_row(L + 1) + first + a, sample) = sum[a];
            } else {
                float4 target = quad(s, width(0) + first + a, sample);
                float4 weight = quad(s, width(0) + OUTPUTS, sample);
                for (int k = 0; k < 4; ++k) {
                    float& x = lane(sum[a], k);
                    x = loss_slope(x, lane(target, k), lane(weight, k), scale);
                    if (sample + k >= valid) x = 0.0f;
                }
                quad(s, gradient_row(LAYERS) + first + a, sample) = sum[a];
            }
        }
    }
    __syncthreads();
    if constexpr (L + 1 < LAYERS) forward<L + 1>(s, valid, scale);
}

// Gradients of the sums before the activations of a layer, from those of the layer after it.
template <int L>
__device__ void backward(Shared& s) {
    if constexpr (L > 0) {
        constexpr int in = width(L), out = width(L + 1);
        constexpr int tile = tile_of(in), groups = ceil_div(in, tile);
        const float* weights = s.weights + first_parameter(L);
        for (int item = threadIdx.x; item < groups * QUADS; item += THREADS) {
            const int sample = item % QUADS * 4, first = item / QUADS * tile;
            float4 sum[tile];
#pragma unroll
            for (int a = 0; a < tile; ++a) sum[a] = make_float4(0.0f, 0.0f, 0.0f, 0.0f);
            products<tile, in, out, out, 1>(s, sum, gradient_row(L + 1), sample, weights, first);
#pragma unroll
            for (int a = 0; a < tile; ++a) {
                if (in % tile && first + a >= in) continue;
                float4 y = quad(s, activation_row(L) + first + a, sample);
                for (int k = 0; k < 4; ++k) {
                    const float x = lane(y, k), g = lane(sum[a], k);
                    lane(y, k) = SQUARED ? g * (2.0f * sqrtf(x)) : x <= 0.0f ? 0.0f : g;
                }
                quad(s, gradient_row(L) + first + a, sample) = y;
            }
        }
        __syncthreads();
        backward<L - 1>(s);
    }
}

// A tile of the outer product of a layer's inputs (and a row of ones, for the biases) with the
// gradients of its sums, over every SPLITS-th vector of samples.
template <int L>
__device__ void weight_gradient(Shared& s, int tile, int split, bool again) {
    if constexpr (L + 1 < LAYERS) {
        if (tile >= first_tile(L + 1)) return weight_gradient<L + 1>(s, tile, split, again);
    }
    constexpr int in = width(L), out = width(L + 1), across = ceil_div(out, ROWS_B);
    const int i = (tile - first_tile(L)) / across * ROWS_A;
    const int j = (tile - first_tile(L)) % across * ROWS_B;
    const float *x[ROWS_A], *g[ROWS_B];
    for (int a = 0; a < ROWS_A; ++a)
        x[a] = &quad(s, i + a < in ? activation_row(L) + i + a : ONES, 0).x;
    for (int b = 0; b < ROWS_B; ++b)
        g[b] = &quad(s, gradient_row(L + 1) + (j + b < out ? j + b : out - 1), 0).x;
    float sum[ROWS_A][ROWS_B] = {};
    for (int k = split * 4; k < CHUNK; k += SPLITS * 4) {
        float4 right[ROWS_B];
#pragma unroll
        for (int b = 0; b < ROWS_B; ++b) right[b] = *reinterpret_cast<const float4*>(g[b] + k);
#pragma unroll
        for (int a = 0; a < ROWS_A; ++a) {
            const float4 left = *reinterpret_cast<const float4*>(x[a] + k);
#pragma unroll
            for (int b = 0; b < ROWS_B; ++b) {
                sum[a][b] = fmaf(left.x, right[b].x, sum[a][b]);
                sum[a][b] = fmaf(left.y, right[b].y, sum[a][b]);
                sum[a][b] = fmaf(left.z, right[b].z, sum[a][b]);
                sum[a][b] = fmaf(left.w, right[b].w, sum[a][b]);
            }
        }
    }
#pragma unroll
    for (int a = 0; a < ROWS_A; ++a)
#pragma unroll
        for (int b = 0; b < ROWS_B; ++b)
            if (i + a <= in && j + b < out) {
                float& total = s.partial[split][first_parameter(L) + (i + a) * out + j + b];
                total = again ? total + sum[a][b] : sum[a][b];
            }
}

// The part of the samples that a block of threads takes, chunk after chunk of all steps.
struct Share {
    const float4* blocks;  // of this network
    const int* order;
    int count, part;  // blocks in the order; which part this one is

    __device__ int end(int step) const {
        const int last = step * BATCH + (part + 1) * SHARE;
        const int whole = (step + 1) * BATCH < count ? (step + 1) * BATCH : count;
        return last < whole ? last : whole;
    }
    __device__ int first(int chunk) const {
        return chunk / CHUNKS * BATCH + part * SHARE + chunk % CHUNKS * (CHUNK / BLOCK);
    }
    // Where the vector of a chunk is that a thread loads; -1 past the end.
    __device__ int place(int chunk, int vector) const {
        const int at = first(chunk) + vector / VECTORS;
        if (vector >= QUADS * SAMPLE_ROWS || at >= end(chunk / CHUNKS)) return -1;
        return order[at];
    }
    __device__ float4 load(int place, int vector) const {
        if (place < 0) return make_float4(0.0f, 0.0f, 0.0f, 0.0f);
        return blocks[(long long)place * VECTORS + vector % VECTORS];
    }
};

#if PARTS > 1
#define CLUSTER __cluster_dims__(PARTS, 1, 1)
#else
#define CLUSTER
#endif

// Takes `steps` steps. `blocks` has the samples of all networks, sample by sample, those of a network
// from block starts[network]; `order`, of `count` blocks, is the networks' own if `stride` is not 0.
// `state` has weights, first and second moments of every network; `schedule` has for each step the
// learning rate and the factor of the second moments, corrected for their beginning at zero.
extern "C" __global__ void CLUSTER __launch_bounds__(THREADS) train(
    const float4* blocks, const long long* starts, const int* order, int count, int stride,
    const float2* schedule, int steps, float* state
) {
    extern __shared__ float4 memory[];
    Shared& s = *reinterpret_cast<Shared*>(memory);
    const int network = blockIdx.x / PARTS, networks = gridDim.x / PARTS, thread = threadIdx.x;
    const Share share = {
        blocks + starts[network] * VECTORS, order + (long long)network * stride, count,
        (int)(blockIdx.x % PARTS)
    };
    float* const own[] = {s.weights, s.means, s.squares};
    for (int p = thread; p < SIZE; p += THREADS)
        for (int k = 0; k < 3; ++k)
            own[k][p] = state[(long long)k * networks * SIZE + place_of(p, network, networks)];
    s.rows[ONES * STRIDE + thread] = 1.0f;

    // Samples are fetched a chunk ahead, and their places two: memory is far.
    int places[LOADS];
    float4 fetched[LOADS];
    for (int k = 0; k < LOADS; ++k) {
        const int vector = thread + k * THREADS;
        fetched[k] = share.load(share.place(0, vector), vector);
        places[k] = steps * CHUNKS > 1 ? share.place(1, vector) : -1;
    }
    for (int step = 0; step < steps; ++step) {
        const int batch = count - step * BATCH < BATCH ? count - step * BATCH : BATCH;
        const float scale = 1.0f / (OUTPUTS * BLOCK * batch);
        const float2 rate = schedule[step];
        for (int c = 0; c < CHUNKS; ++c) {
            const int chunk = step * CHUNKS + c;
#pragma unroll
            for (int k = 0; k < LOADS; ++k) {
                const int vector = thread + k * THREADS;
                if (vector < QUADS * SAMPLE_ROWS)
                    for (int e = 0; e < 4; ++e) {
                        const int value = vector % VECTORS * 4 + e;
                        const int sample = vector / VECTORS * BLOCK + value / SAMPLE_ROWS;
                        s.rows[value % SAMPLE_ROWS * STRIDE + sample] = lane(fetched[k], e);
                    }
                fetched[k] = share.load(places[k], vector);
                places[k] = chunk + 2 < steps * CHUNKS ? share.place(chunk + 2, vector) : -1;
            }
            __syncthreads();
            const int valid = (share.end(step) - share.first(chunk)) * BLOCK;
            forward<0>(s, valid, scale);
            backward<LAYERS - 1>(s);
            for (int item = thread; item < TILES * SPLITS; item += THREADS)
                weight_gradient<0>(s, item % TILES, item / TILES, c > 0);
            __syncthreads();
        }
#if PARTS > 1
        for (int p = thread; p < SIZE; p += THREADS) {
            float sum = s.partial[0][p];
            for (int k = 1; k < SPLITS; ++k) sum += s.partial[k][p];
            s.gradient[step % 2][p] = sum;
        }
        // The next step writes to the other half, so that no block overwrites what one still reads.
        __cluster_barrier_arrive();
        __cluster_barrier_wait();
        const float* parts[PARTS];
        for (int k = 0; k < PARTS; ++k)
            parts[k] = static_cast<const float*>(__cluster_map_shared_rank(s.gradient[step % 2], k));
#else
        const float* parts[SPLITS];
        for (int k = 0; k < SPLITS; ++k) parts[k] = s.partial[k];
#endif
        constexpr int count_of_parts = PARTS > 1 ? PARTS : SPLITS;
        for (int p = thread; p < SIZE; p += THREADS) {
            float g = parts[0][p];
#pragma unroll
            for (int k = 1; k < count_of_parts; ++k) g += parts[k][p];
            const float mean = s.means[p] = 0.9f * s.means[p] + 0.1f * g;
            const float square = s.squares[p] = 0.999f * s.squares[p] + 0.001f * g * g;
            s.weights[p] -= rate.x * mean / (sqrtf(square * rate.y) + 1e-8f);
        }
    }
#if PARTS > 1
    __cluster_barrier_arrive();  // a block's memory stays until the others have read it
    __cluster_barrier_wait();
#endif
    if (share.part) return;
    for (int p = thread; p < SIZE; p += THREADS)
        for (int k = 0; k < 3; ++k)
            state[(long long)k * networks * SIZE + place_of(p, network, networks)] = own[k][p];
}
