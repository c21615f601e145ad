// CUDA on a processor, for tests: a kernel as C++, behind the function of the driver that launches it.
//
// The macro SOURCE is the file of the kernel, which defines PARTS, its blocks per cluster, and KERNEL
// its name. A block of threads is a thread of the system, and its CUDA threads take turns on it: each
// runs to its next barrier, in an order that `emulate_order` chooses, so that results show where a
// barrier is missing. What a card would not forgive ends the process: a barrier that only some
// threads of a block reach, and writing past the shared memory.

#include <ucontext.h>

#include <algorithm>
#include <barrier>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

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
constexpr std::size_t SHARED_BYTES = 227 << 10, STACK_BYTES = 64 << 10;
thread_local float4 memory[SHARED_BYTES / sizeof(float4)];

enum State { READY, AT_BLOCK, AT_CLUSTER, DONE };

struct Cluster {
    std::barrier<> barrier;
    std::vector<char*> memory;
};

static thread_local std::vector<State> states;
static thread_local std::vector<ucontext_t> contexts;
static thread_local ucontext_t scheduler;
static thread_local Cluster* cluster;

static void wait_at(State barrier) {
    const unsigned own = threadIdx.x;
    states[own] = barrier;
    swapcontext(&contexts[own], &scheduler);
}
static void __syncthreads() { wait_at(AT_BLOCK); }
[[maybe_unused]] static void __cluster_barrier_arrive() {}
[[maybe_unused]] static void __cluster_barrier_wait() { wait_at(AT_CLUSTER); }
[[maybe_unused]] static void* __cluster_map_shared_rank(void* pointer, unsigned rank) {
    const char* own = reinterpret_cast<char*>(memory);
    return cluster->memory[rank] + (static_cast<char*>(pointer) - own);
}

#include SOURCE

static int order = 0, launches = 0;
static std::size_t allowed = 48 << 10;
static thread_local void** arguments;

template <class... A, std::size_t... I>
static void call(void (*kernel)(A...), std::index_sequence<I...>) {
    kernel(*static_cast<A*>(arguments[I])...);
}
template <class... A>
static void call(void (*kernel)(A...)) { call(kernel, std::index_sequence_for<A...>()); }

static void thread_main() {
    call(KERNEL);
    states[threadIdx.x] = DONE;
}

// Shared memory is not a number until a thread writes to it.
static void run_block(unsigned rank, unsigned threads, std::size_t shared) {
    std::memset(memory, 0xff, SHARED_BYTES);
    cluster->memory[rank] = reinterpret_cast<char*>(memory);
    cluster->barrier.arrive_and_wait();
    const std::unique_ptr<char[]> stacks(new char[threads * STACK_BYTES]);
    states.assign(threads, READY);
    contexts.resize(threads);
    std::vector<unsigned> turns(threads);
    for (unsigned k = 0; k < threads; ++k) {
        turns[k] = k;
        getcontext(&contexts[k]);
        contexts[k].uc_stack.ss_sp = &stacks[k * STACK_BYTES];
        contexts[k].uc_stack.ss_size = STACK_BYTES;
        contexts[k].uc_link = &scheduler;
        makecontext(&contexts[k], thread_main, 0);
    }
    std::mt19937 random(order + rank);
    for (;;) {
        if (order) std::shuffle(turns.begin(), turns.end(), random);
        for (unsigned k : turns) {
            threadIdx.x = k;
            swapcontext(&scheduler, &contexts[k]);
        }
        if (std::count(states.begin(), states.end(), states[0]) != long(threads)) {
            std::fputs("only some threads of a block reached a barrier\n", stderr);
            std::abort();
        }
        if (states[0] == AT_CLUSTER) cluster->barrier.arrive_and_wait();
        if (states[0] == DONE) break;
    }
    const char* bytes = reinterpret_cast<char*>(memory);
    if (std::count(bytes + shared, bytes + SHARED_BYTES, char(0xff)) != long(SHARED_BYTES - shared)) {
        std::fputs("a block wrote past its shared memory\n", stderr);
        std::abort();
    }
    cluster->barrier.arrive_and_wait();
}

extern "C" {

void emulate_order(int seed) { order = seed; }
int emulated_launches() { return launches; }

int cuFuncSetAttribute(void*, int attribute, int value) {
    if (attribute != 8 || std::size_t(value) > SHARED_BYTES) return 1;
    allowed = value;
    return 0;
}

int cuLaunchKernel(
    void*, unsigned blocks, unsigned, unsigned, unsigned threads, unsigned, unsigned,
    unsigned shared, void*, void** given, void**
) {
    if (shared > allowed || blocks % PARTS || threads > 1024) return 1;
    ++launches;
    for (unsigned first = 0; first < blocks; first += PARTS) {
        Cluster one{std::barrier<>(PARTS), std::vector<char*>(PARTS)};
        std::vector<std::thread> running;
        for (unsigned rank = 0; rank < PARTS; ++rank)
            running.emplace_back([&, rank] {
                cluster = &one;
                arguments = given;
                blockIdx.x = first + rank;
                gridDim.x = blocks;
                run_block(rank, threads, shared);
            });
        for (std::thread& each : running) each.join();
    }
    return 0;
}

}  // extern "C"
