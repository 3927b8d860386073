#include "cuda/query/broad_arrays.h"

#include <cub/device/device_radix_sort.cuh>

#include <algorithm>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "cuda/query/broad_steps.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarps = kThreads / 32;

__global__ void __launch_bounds__(kThreads) count_up(std::uint32_t* values, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i < count) values[i] = i;
}

__global__ void __launch_bounds__(kThreads) place_bodies(const BroadArrays scene) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i < scene.count) place_body(scene, i);
}

__global__ void __launch_bounds__(kThreads) fit_nodes(const BroadArrays scene, const int level) {
  const std::uint32_t j = blockIdx.x * kWarps + threadIdx.x / 32;
  if (j < scene.nodes[level]) fit_node(WarpTeam(), scene, level, j);
}

__global__ void __launch_bounds__(kThreads) find_body_pairs(const BroadArrays scene) {
  __shared__ BroadMemory memory[kWarps];
  const std::uint32_t g = blockIdx.x * kWarps + threadIdx.x / 32;
  if (g < scene.nodes[1]) find_pairs_of(WarpTeam(), scene, g, memory[threadIdx.x / 32]);
}

__global__ void __launch_bounds__(kThreads) write_pairs(const BroadArrays scene) {
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k < scene.max_pairs) write_pair(scene, k);
}

cudaError_t sort_bodies(const BroadArrays& scene, void* scratch, std::size_t& bytes,
                        cudaStream_t stream) {
  return cub::DeviceRadixSort::SortPairs(scratch, bytes, scene.keys, scene.sorted_keys,
                                         scene.indices, scene.order, scene.count, 0, scene.key_bits,
                                         stream);
}
cudaError_t sort_found(const BroadArrays& scene, void* scratch, std::size_t& bytes,
                       cudaStream_t stream) {
  return cub::DeviceRadixSort::SortKeys(scratch, bytes, scene.found, scene.sorted, scene.max_pairs,
                                        0, 2 * scene.index_bits, stream);
}

}  // namespace

std::size_t broad_scratch_bytes(const BroadArrays& scene) {
  std::size_t bodies = 0, pairs = 0;
  check(sort_bodies(scene, nullptr, bodies, nullptr), "preparing a sort of bodies");
  check(sort_found(scene, nullptr, pairs, nullptr), "preparing a sort of pairs");
  return std::max(bodies, pairs);
}

void ready_broad(const BroadArrays& scene, cudaStream_t stream) {
  launch("counting bodies", count_up, blocks_for(scene.count, kThreads), kThreads, stream,
         scene.indices, scene.count);
}

void launch_broad(const BroadArrays& scene, cudaStream_t stream) {
  std::size_t bytes = scene.scratch_bytes;
  check(cudaMemsetAsync(scene.met, 0, sizeof *scene.met, stream), "starting a step");
  check(cudaMemsetAsync(scene.found, 0xFF, scene.max_pairs * sizeof *scene.found, stream),
        "starting a step");
  if (scene.count > 0) {
    launch("placing bodies", place_bodies, blocks_for(scene.count, kThreads), kThreads, stream,
           scene);
    check(sort_bodies(scene, scene.scratch, bytes, stream), "sorting bodies");
    for (int level = 1; level <= scene.top; ++level) {
      launch("fitting boxes", fit_nodes, blocks_for(scene.nodes[level], kWarps), kThreads, stream,
             scene, level);
    }
    launch("finding pairs", find_body_pairs, blocks_for(scene.nodes[1], kWarps), kThreads, stream,
           scene);
  }
  check(sort_found(scene, scene.scratch, bytes, stream), "sorting pairs");
  launch("writing pairs", write_pairs, blocks_for(scene.max_pairs, kThreads), kThreads, stream,
         scene);
}

}  // namespace ist::gpu
