// CUDA on a processor, for tests: a kernel as C++, behind the function of the driver that launches it.
//
// The macro SOURCE is the file of the kernel, which defines PARTS, its blocks per cluster, and KERNEL
// its name. A block of threads is a thread of the system, and its CUDA threads take turns on it: each
// runs to its next barrier, in an order that `emulate_order` chooses, so that results show where a
// barrier is missing. What a card would not forgive ends the process: a barrier that only some
// threads of a block reach, and writing past the shared memory. C headers alone: it compiles faster.

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>

struct dim3 { unsigned x, y, z; };
struct float2 { float x, y; };
struct alignas(16) float4 { float x, y, z, w; };
static float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }

#define __device__
#define __global__
#define __shared__ thread_local
#define __launch_bounds__(threads)
#define __cluster_dims__(x, y, z)

static thread_local dim3 threadIdx, blockIdx, gridDim;
constexpr size_t SHARED_BYTES = 227 << 10, STACK_BYTES = 64 << 10;
constexpr unsigned MOST_THREADS = 1024;
thread_local float4 memory[SHARED_BYTES / sizeof(float4)];

enum State { READY, AT_BLOCK, AT_CLUSTER, DONE };

static pthread_barrier_t cluster_barrier;
static char* cluster_memory[16];
static thread_local State states[MOST_THREADS];
static thread_local ucontext_t contexts[MOST_THREADS], scheduler;

static void wait_at(State barrier) {
    const unsigned own = threadIdx.x;
    states[own] = barrier;
    swapcontext(&contexts[own], &scheduler);
}
static void __syncthreads() { wait_at(AT_BLOCK); }
[[maybe_unused]] static void __cluster_barrier_arrive() {}
[[maybe_unused]] static void __cluster_barrier_wait() { wait_at(AT_CLUSTER); }
[[maybe_unused]] static void* __cluster_map_shared_rank(void* pointer, unsigned rank) {
    return cluster_memory[rank] + (static_cast<char*>(pointer) - reinterpret_cast<char*>(memory));
}

#include SOURCE

static int order = 0, launches = 0;
static size_t shared_bytes = 48 << 10;
static unsigned block_count, thread_count, first_block;
static void** arguments;

template <class... A>
struct Call {
    template <size_t N, size_t... I>
    struct Count : Count<N - 1, N - 1, I...> {};
    template <size_t... I>
    struct Count<0, I...> {
        static void run(void (*kernel)(A...)) { kernel(*static_cast<A*>(arguments[I])...); }
    };
};
template <class... A>
static void call(void (*kernel)(A...)) { Call<A...>::template Count<sizeof...(A)>::run(kernel); }

static void thread_main() {
    call(KERNEL);
    states[threadIdx.x] = DONE;
}

static void fail(const char* message) {
    fputs(message, stderr);
    abort();
}

// Shared memory is not a number until a thread writes to it.
static void* run_block(void* rank) {
    blockIdx.x = first_block + unsigned(reinterpret_cast<size_t>(rank));
    gridDim.x = block_count;
    memset(memory, 0xff, SHARED_BYTES);
    cluster_memory[reinterpret_cast<size_t>(rank)] = reinterpret_cast<char*>(memory);
    pthread_barrier_wait(&cluster_barrier);
    char* const stacks = static_cast<char*>(malloc(thread_count * STACK_BYTES));
    unsigned turns[MOST_THREADS], random = order + blockIdx.x;
    for (unsigned k = 0; k < thread_count; ++k) {
        turns[k] = k;
        states[k] = READY;
        getcontext(&contexts[k]);
        contexts[k].uc_stack.ss_sp = stacks + k * STACK_BYTES;
        contexts[k].uc_stack.ss_size = STACK_BYTES;
        contexts[k].uc_link = &scheduler;
        makecontext(&contexts[k], thread_main, 0);
    }
    do {
        for (unsigned k = order ? thread_count : 0; k > 1; --k) {
            random = random * 1664525 + 1013904223;
            const unsigned other = (random >> 8) % k, own = turns[k - 1];
            turns[k - 1] = turns[other];
            turns[other] = own;
        }
        for (unsigned k = 0; k < thread_count; ++k) {
            threadIdx.x = turns[k];
            swapcontext(&scheduler, &contexts[turns[k]]);
        }
        for (unsigned k = 0; k < thread_count; ++k)
            if (states[k] != states[0]) fail("only some threads of a block reached a barrier\n");
        if (states[0] == AT_CLUSTER) pthread_barrier_wait(&cluster_barrier);
    } while (states[0] != DONE);
    const char* bytes = reinterpret_cast<char*>(memory);
    for (size_t k = shared_bytes; k < SHARED_BYTES; ++k)
        if (bytes[k] != char(0xff)) fail("a block wrote past its shared memory\n");
    free(stacks);
    pthread_barrier_wait(&cluster_barrier);
    return nullptr;
}

extern "C" {

void emulate_order(int seed) { order = seed; }
int emulated_launches() { return launches; }

int cuFuncSetAttribute(void*, int attribute, int value) {
    if (attribute != 8 || size_t(value) > SHARED_BYTES) return 1;
    shared_bytes = value;
    return 0;
}

int cuLaunchKernel(
    void*, unsigned blocks, unsigned, unsigned, unsigned threads, unsigned, unsigned,
    unsigned shared, void*, void** given, void**
) {
    if (shared > shared_bytes || blocks % PARTS || threads > MOST_THREADS) return 1;
    ++launches;
    block_count = blocks;
    thread_count = threads;
    arguments = given;
    pthread_barrier_init(&cluster_barrier, nullptr, PARTS);
    for (first_block = 0; first_block < blocks; first_block += PARTS) {
        pthread_t running[PARTS];
        for (size_t k = 0; k < PARTS; ++k)
            pthread_create(&running[k], nullptr, run_block, reinterpret_cast<void*>(k));
        for (pthread_t each : running) pthread_join(each, nullptr);
    }
    return 0;
}

}  // extern "C"
