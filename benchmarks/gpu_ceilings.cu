// What the card and its link can do at most: the ceilings that kernels are judged by. Copies on the
// card and over the link, what a dependent step costs in each of the ways to order steps, and how
// fast instructions can be fetched. Needs a GPU.

#include <cooperative_groups.h>
#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>
#include <vector>

#include "cuda/base/check.h"
#include "report.h"

namespace {

using ist::gpu::check;

__global__ void nothing(int* counter) {
  if (threadIdx.x == 0 && blockIdx.x == 0) *counter += 1;
}

__global__ void countdown(int* counter, cudaGraphConditionalHandle handle) {
  const int left = *counter - 1;
  *counter = left;
  cudaGraphSetConditional(handle, left > 0 ? 1u : 0u);
}

__global__ void grid_syncs(int steps, int* counter) {
  const auto grid = cooperative_groups::this_grid();
  for (int i = 0; i < steps; ++i) {
    if (grid.thread_rank() == 0) *counter += 1;
    grid.sync();
  }
}

/// One thread follows a random cycle through memory: the time of one dependent load.
__global__ void chase(const unsigned* next, int steps, unsigned* end) {
  unsigned at = 0;
  for (int i = 0; i < steps; ++i) at = next[at];
  *end = at;
}

__global__ void multiply(float* out, int steps) {
  float a = static_cast<float>(threadIdx.x), b = 0.5f * a, c = 0.25f * a, d = 0.125f * a;
  for (int i = 0; i < steps; ++i) {
    a = a * 0.999f;
    b = b * 0.999f;
    c = c * 0.999f;
    d = d * 0.999f;
    a = a + 0.1f;
    b = b + 0.1f;
    c = c + 0.1f;
    d = d + 0.1f;
  }
  out[blockIdx.x * blockDim.x + threadIdx.x] = a + b + c + d;
}

/// 4 KB of instructions of which no two are merged.
template <int Number>
__device__ __noinline__ float4 four_kilobytes(float4 v, float c) {
#pragma unroll
  for (int i = 0; i < 64; ++i)
    asm volatile(
        "fma.rn.f32 %0, %0, %4, %4; fma.rn.f32 %1, %1, %4, %4;"
        "fma.rn.f32 %2, %2, %4, %4; fma.rn.f32 %3, %3, %4, %4;"
        : "+f"(v.x), "+f"(v.y), "+f"(v.z), "+f"(v.w)
        : "f"(c));
  v.x += Number;
  return v;
}

constexpr int kMostPieces = 64;  ///< of code
using PieceOfCode = float4 (*)(float4, float);

template <int... Number>
__device__ PieceOfCode piece_of_code(int k, std::integer_sequence<int, Number...>) {
  static const PieceOfCode pieces[] = {four_kilobytes<Number>...};
  return pieces[k];
}

/// Each warp runs through the first `pieces` of code in an order of its own.
__global__ void run_code(int pieces, int rounds, float* out, long long* cycles) {
  constexpr std::make_integer_sequence<int, kMostPieces> kAll;
  float4 v = {1, 2, 3, 4};
  const float c = 0.5f * static_cast<float>(gridDim.x);
  unsigned state = (blockIdx.x * 37 + threadIdx.x / 32) * 2654435761u + 1;
  for (int i = 0; i < 2 * pieces; ++i) v = piece_of_code(i % pieces, kAll)(v, c);
  __syncthreads();
  const long long start = clock64();
  for (int i = 0; i < rounds; ++i) {
    state = state * 1664525u + 1013904223u;
    v = piece_of_code(static_cast<int>((state >> 8) % static_cast<unsigned>(pieces)), kAll)(v, c);
  }
  if (threadIdx.x == 0) cycles[blockIdx.x] = clock64() - start;
  out[blockIdx.x * blockDim.x + threadIdx.x] = v.x + v.y + v.z + v.w;
}

/// Median and extremes of `rounds` host times of `work`, which waits for its own end; seconds.
struct Times {
  double median = 0, least = 0, most = 0;
};

Times time(int rounds, const std::function<void()>& work) {
  work();  // warm-up
  std::vector<double> seconds;
  for (int i = 0; i < rounds; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(seconds.begin(), seconds.end());
  return {seconds[seconds.size() / 2], seconds.front(), seconds.back()};
}

class Ceilings {
 public:
  explicit Ceilings(ist::benchmark::Report& report) : report_(report) {
    check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
    check(cudaMalloc(&counter_, sizeof(int)), "allocating");
    check(cudaMalloc(&other_, sizeof(int)), "allocating");
    check(cudaMemset(counter_, 0, sizeof(int)), "clearing");
  }

  void copies() {
    constexpr std::size_t kLarge = std::size_t{2} << 30;
    char *from = nullptr, *to = nullptr;
    check(cudaMalloc(&from, kLarge), "allocating");
    check(cudaMalloc(&to, kLarge), "allocating");
    check(cudaMemset(from, 1, kLarge), "filling");
    bandwidth("on the card, read + written", 2 * kLarge, [&] {
      check(cudaMemcpyAsync(to, from, kLarge, cudaMemcpyDeviceToDevice, stream_), "copying");
      wait();
    });
    constexpr std::size_t kMesh = std::size_t{21} << 20;  // dragon_871k
    std::vector<char> pageable(kMesh, 1);
    char* pinned = nullptr;
    check(cudaMallocHost(&pinned, kMesh), "allocating pinned memory");
    bandwidth("21 MiB up, pageable", kMesh, [&] {
      check(cudaMemcpyAsync(to, pageable.data(), kMesh, cudaMemcpyHostToDevice, stream_),
            "copying");
      wait();
    });
    bandwidth("21 MiB up, pinned", kMesh, [&] {
      check(cudaMemcpyAsync(to, pinned, kMesh, cudaMemcpyHostToDevice, stream_), "copying");
      wait();
    });
    constexpr std::size_t kSpheres = 16 * 100000;
    bandwidth("1.6 MB down, pageable", kSpheres, [&] {
      check(cudaMemcpyAsync(pageable.data(), to, kSpheres, cudaMemcpyDeviceToHost, stream_),
            "copying");
      wait();
    });
    cudaFreeHost(pinned);
    cudaFree(from);
    cudaFree(to);
  }

  void steps() {
    constexpr int kSteps = 1000;
    step("kernels one after another in a stream", kSteps, [&] {
      for (int i = 0; i < kSteps; ++i) nothing<<<132, 256, 0, stream_>>>(counter_);
      wait();
    });
    step("kernel, then the host waits", kSteps, [&] {
      for (int i = 0; i < kSteps; ++i) {
        nothing<<<132, 256, 0, stream_>>>(counter_);
        wait();
      }
    });
    int* mailbox = nullptr;
    check(cudaMallocHost(&mailbox, sizeof(int)), "allocating pinned memory");
    step("kernel, 4 bytes to pinned memory, then the host waits", kSteps, [&] {
      for (int i = 0; i < kSteps; ++i) {
        nothing<<<132, 256, 0, stream_>>>(counter_);
        check(cudaMemcpyAsync(mailbox, counter_, sizeof(int), cudaMemcpyDeviceToHost, stream_),
              "copying");
        wait();
      }
    });
    cudaFreeHost(mailbox);
    int many = kSteps;
    int* counter = counter_;
    void* arguments[] = {&many, &counter};
    for (const int blocks : {132, 264, 528})
      step("grid.sync() of " + std::to_string(blocks) + " blocks of 256", kSteps, [&] {
        check(cudaLaunchCooperativeKernel(reinterpret_cast<void*>(&grid_syncs),
                                          dim3(unsigned(blocks)), dim3(256), arguments, 0, stream_),
              "launching");
        wait();
      });
    graph_of_kernels(kSteps);
    while_graph(kSteps, 1);
    while_graph(kSteps, 4);
    step("cudaMallocAsync and cudaFreeAsync of 1 MiB", kSteps, [&] {
      for (int i = 0; i < kSteps; ++i) {
        void* memory = nullptr;
        check(cudaMallocAsync(&memory, 1 << 20, stream_), "allocating");
        check(cudaFreeAsync(memory, stream_), "freeing");
      }
      wait();
    });
  }

  void loads() {
    for (const std::size_t bytes :
         {std::size_t{16} << 10, std::size_t{8} << 20, std::size_t{1} << 30}) {
      const std::size_t count = bytes / sizeof(unsigned);
      // One cycle through all of them in no order that a prefetcher sees: a full-period linear
      // congruential generator modulo a power of two.
      std::vector<unsigned> next(count);
      for (std::size_t i = 0; i < count; ++i)
        next[i] = (static_cast<unsigned>(i) * 1664525u + 1013904223u) & unsigned(count - 1);
      unsigned* device = nullptr;
      check(cudaMalloc(&device, bytes), "allocating");
      check(cudaMemcpy(device, next.data(), bytes, cudaMemcpyHostToDevice), "copying");
      constexpr int kLoads = 20000;
      step("dependent load, " + std::to_string(bytes >> 10) + " KiB", kLoads, [&] {
        chase<<<1, 1, 0, stream_>>>(device, kLoads, reinterpret_cast<unsigned*>(counter_));
        wait();
      });
      cudaFree(device);
    }
  }

  void arithmetic() {
    constexpr int kBlocks = 132 * 8, kThreads = 256, kRounds = 20000;
    float* out = nullptr;
    check(cudaMalloc(&out, sizeof(float) * kBlocks * kThreads), "allocating");
    const Times t = time(10, [&] {
      multiply<<<kBlocks, kThreads, 0, stream_>>>(out, kRounds);
      wait();
    });
    cudaFree(out);
    report_.row("Arithmetic", {{"what", "float + and ×, not fused"},
                               {"TFLOP/s", 8.0 * kRounds * kBlocks * kThreads / t.median * 1e-12}});
  }

  /// Warps at other places of much code: what does not fit the first cache for instructions has to
  /// be fetched, and all warps of a multiprocessor together.
  void code() {
    constexpr int kBlocks = 132, kMostWarps = 16, kRounds = 256;
    float* out = nullptr;
    long long* cycles = nullptr;
    check(cudaMallocManaged(&out, sizeof(float) * kBlocks * 32 * kMostWarps), "allocating");
    check(cudaMallocManaged(&cycles, sizeof(long long) * kBlocks), "allocating");
    for (const int warps : {1, 4, kMostWarps})
      for (const int pieces : {2, 4, 6, 8, 10, 12, 16, 24, 32, 48, kMostPieces}) {
        run_code<<<kBlocks, 32 * warps, 0, stream_>>>(pieces, kRounds, out, cycles);
        wait();
        std::sort(cycles, cycles + kBlocks);
        const double each = static_cast<double>(cycles[kBlocks / 2]) / (kRounds * 256.0);
        report_.row("Instructions", {{"warps on a multiprocessor", warps},
                                     {"code [KB]", 4 * pieces},
                                     {"cycles an instruction of a warp", each},
                                     {"instructions a cycle and multiprocessor", warps / each}});
      }
    cudaFree(out);
    cudaFree(cycles);
  }

 private:
  void wait() { check(cudaStreamSynchronize(stream_), "waiting"); }

  void bandwidth(const std::string& what, std::size_t bytes, const std::function<void()>& work) {
    const Times t = time(20, work);
    const auto rate = [&](double seconds) { return static_cast<double>(bytes) / seconds * 1e-9; };
    report_.row("Copies", {{"what", what},
                           {"GB/s, median", rate(t.median)},
                           {"least", rate(t.most)},
                           {"most", rate(t.least)}});
  }

  void step(const std::string& what, int steps, const std::function<void()>& work) {
    const Times t = time(10, work);
    report_.row("Time of a dependent step", {{"what", what},
                                             {"µs, median", t.median / steps * 1e6},
                                             {"least", t.least / steps * 1e6},
                                             {"most", t.most / steps * 1e6}});
  }

  void launch_and_time(cudaGraph_t graph, const std::string& what, int steps, int set_counter) {
    cudaGraphExec_t exec = nullptr;
    check(cudaGraphInstantiate(&exec, graph, 0), "instantiating a graph");
    step(what, steps, [&] {
      if (set_counter > 0)
        check(cudaMemcpyAsync(counter_, &set_counter, sizeof(int), cudaMemcpyHostToDevice, stream_),
              "copying");
      check(cudaGraphLaunch(exec, stream_), "launching a graph");
      wait();
    });
    cudaGraphExecDestroy(exec);
    cudaGraphDestroy(graph);
  }

  void graph_of_kernels(int steps) {
    cudaGraph_t graph = nullptr;
    check(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal), "capturing");
    for (int i = 0; i < steps; ++i) nothing<<<132, 256, 0, stream_>>>(counter_);
    check(cudaStreamEndCapture(stream_, &graph), "capturing");
    launch_and_time(graph, "kernels one after another in a graph", steps, 0);
  }

  void while_graph(int steps, int kernels) {
    cudaGraph_t graph = nullptr;
    check(cudaGraphCreate(&graph, 0), "making a graph");
    cudaGraphConditionalHandle handle{};
    check(cudaGraphConditionalHandleCreate(&handle, graph, 1, cudaGraphCondAssignDefault),
          "making a condition");
    cudaGraphNodeParams parameters{};
    parameters.type = cudaGraphNodeTypeConditional;
    parameters.conditional.handle = handle;
    parameters.conditional.type = cudaGraphCondTypeWhile;
    parameters.conditional.size = 1;
    cudaGraphNode_t node = nullptr;
    check(cudaGraphAddNode(&node, graph, nullptr, nullptr, 0, &parameters), "adding a while node");
    cudaGraph_t body = parameters.conditional.phGraph_out[0];
    check(cudaStreamBeginCaptureToGraph(stream_, body, nullptr, nullptr, 0,
                                        cudaStreamCaptureModeThreadLocal),
          "capturing");
    for (int i = 1; i < kernels; ++i) nothing<<<132, 256, 0, stream_>>>(other_);
    countdown<<<1, 1, 0, stream_>>>(counter_, handle);
    check(cudaStreamEndCapture(stream_, nullptr), "capturing");
    launch_and_time(graph, "while node of " + std::to_string(kernels) + " kernel(s), an iteration",
                    steps, steps);
  }

  ist::benchmark::Report& report_;
  cudaStream_t stream_ = nullptr;
  int *counter_ = nullptr, *other_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) {
  ist::benchmark::Report report("gpu_ceilings", argc, argv);
  try {
    Ceilings ceilings(report);
    ceilings.copies();
    ceilings.steps();
    ceilings.loads();
    ceilings.arithmetic();
    ceilings.code();
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return report.write();
}
