#include "cuda/packing/mesh/device_mesh.h"

// Parts of a power of two of triangles begin at multiples of it, so a position in the order
// determines its part. The triangles of one last node are halved in shared memory; larger parts are
// divided by sorting all of them at once, into 4, 4 and 2 a level of nodes, which needs fewer sorts
// than halving and is no worse.
#include <cub/device/device_radix_sort.cuh>

#include <algorithm>
#include <bit>
#include <utility>

#include "cuda/base/check.h"
#include "cuda/base/warp_team.h"
#include "mesh/hierarchy/wide_build.h"

namespace ist::gpu {
namespace {

/// Sorts pairs by the lowest `bits` bits of their keys, ascending and stable. Both arrays have the
/// same size and are replaced; meanwhile twice their memory is in use.
void sort_pairs(Queue& queue, DeviceArray<std::uint32_t>& keys, DeviceArray<std::uint32_t>& values,
                int bits) {
  const auto count = static_cast<int>(keys.size());
  DeviceArray<std::uint32_t> other_keys(queue, keys.size());
  DeviceArray<std::uint32_t> other_values(queue, values.size());
  cub::DoubleBuffer<std::uint32_t> key_buffers(keys.data(), other_keys.data());
  cub::DoubleBuffer<std::uint32_t> value_buffers(values.data(), other_values.data());
  std::size_t bytes = 0;
  check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, key_buffers, value_buffers, count, 0, bits,
                                        queue.stream()),
        "preparing a sort");
  DeviceArray<std::byte> scratch(queue, bytes);
  check(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, key_buffers, value_buffers, count, 0,
                                        bits, queue.stream()),
        "sorting");
  if (key_buffers.Current() != keys.data()) std::swap(keys, other_keys);
  if (value_buffers.Current() != values.data()) std::swap(values, other_values);
}

constexpr unsigned kThreads = 1024;
constexpr std::uint32_t kNodeTriangles = kWideWidth * kWideWidth;  ///< of a node of the last level
static_assert(kThreads == kNodeTriangles);
constexpr int kPlaceBits = 14;  ///< of a coordinate within a part, at most
constexpr std::uint32_t kAll = 0xFFFFFFFFu;

/// Middles of the triangles' boxes, axis by axis.
__global__ void __launch_bounds__(kThreads)
    find_middles(const double* vertices, const std::uint32_t* triangles, std::uint32_t count,
                 float* middles, std::uint32_t* order) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= count) return;
  const std::uint32_t* t = triangles + 3 * std::size_t{i};
  for (int k = 0; k < 3; ++k) {
    float least = HUGE_VALF, most = -HUGE_VALF;
    for (int c = 0; c < 3; ++c) {
      const auto x = static_cast<float>(vertices[3 * std::size_t{t[c]} + std::size_t(k)]);
      least = x < least ? x : least;
      most = x > most ? x : most;
    }
    middles[std::size_t(k) * count + i] = (least + most) / 2;
  }
  order[i] = i;
}

/// The box of some points as six words, combined by minimum: of the lower corner, then of the
/// negated upper one. All bits set: no points.
struct Extent {
  std::uint32_t word[6];

  __device__ float lower(int k) const { return from_ordered_bits(word[k]); }
  __device__ float upper(int k) const { return from_ordered_bits(~word[3 + k]); }

  __device__ int longest() const {
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (upper(k) - lower(k) > upper(axis) - lower(axis)) axis = k;
    return axis;
  }

  /// The position of a coordinate between the sides, in 0 … most.
  __device__ std::uint32_t place(float x, int axis, std::uint32_t most) const {
    const float side = upper(axis) - lower(axis);
    const float cells = static_cast<float>(most);
    const float cell = side > 0 ? (x - lower(axis)) / side * cells : 0;
    return static_cast<std::uint32_t>(cell > 0 ? (cell < cells ? cell : cells) : 0);
  }
};

__device__ Extent extent_of_warp(const WarpTeam& warp, bool present, const float point[3]) {
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t bits = ordered_bits(point[k]);
    extent.word[k] = warp.min(present ? bits : kAll);
    extent.word[3 + k] = warp.min(present ? ~bits : kAll);
  }
  return extent;
}

/// The extents of parts of `size` triangles, a multiple of kThreads. They begin with all bits set.
__global__ void __launch_bounds__(kThreads)
    find_extents(const float* middles, const std::uint32_t* order, std::uint32_t count,
                 std::uint32_t size, Extent* extents) {
  __shared__ Extent block;
  if (threadIdx.x < 6) block.word[threadIdx.x] = kAll;
  __syncthreads();
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  float middle[3] = {};
  for (int k = 0; k < 3; ++k)
    if (i < count) middle[k] = middles[std::size_t(k) * count + order[i]];
  const WarpTeam warp;
  const Extent mine = extent_of_warp(warp, i < count, middle);
  if (warp.lane() == 0)
    for (int j = 0; j < 6; ++j) atomicMin(&block.word[j], mine.word[j]);
  __syncthreads();
  if (threadIdx.x < 6)
    atomicMin(&extents[blockIdx.x * kThreads / size].word[threadIdx.x], block.word[threadIdx.x]);
}

/// Keys that sort the triangles of every part along its longest side.
__global__ void __launch_bounds__(kThreads)
    place_in_parts(const float* middles, const std::uint32_t* order, std::uint32_t count,
                   std::uint32_t size, const Extent* extents, int place_bits, std::uint32_t* keys) {
  const std::uint32_t i = blockIdx.x * kThreads + threadIdx.x;
  if (i >= count) return;
  const Extent& extent = extents[i / size];
  const int axis = extent.longest();
  const float middle = middles[std::size_t(axis) * count + order[i]];
  keys[i] = i / size << place_bits | extent.place(middle, axis, (1u << place_bits) - 1);
}

/// Sorts the keys of every `size` successive threads, a power of two: Batcher's bitonic network.
__device__ std::uint32_t sort_in_block(std::uint32_t key, unsigned size, std::uint32_t* shared) {
  const unsigned me = threadIdx.x;
  for (unsigned run = 2; run <= size; run *= 2) {
    for (unsigned step = run / 2; step > 0; step /= 2) {
      std::uint32_t other = 0;
      if (step < 32) {
        other = __shfl_xor_sync(kAll, key, step);
      } else {
        shared[me] = key;
        __syncthreads();
        other = shared[me ^ step];
        __syncthreads();
      }
      const bool ascending = run == size || (me & run) == 0;
      const bool first = (me & step) == 0;
      key = (key < other) == (ascending == first) ? key : other;
    }
  }
  return key;
}

/// Orders the triangles of every last node, one block a node.
__global__ void __launch_bounds__(kThreads)
    cut_into_blocks(const float* middles, std::uint32_t count, std::uint32_t* order) {
  constexpr unsigned kWarps = kThreads / 32;
  constexpr int kIndexBits = 10;
  constexpr std::uint32_t kLastPlace = (1u << (32 - kIndexBits)) - 1;
  static_assert(kThreads == 1u << kIndexBits);
  __shared__ float middle[3][kThreads];
  __shared__ std::uint32_t triangle[kThreads], scratch[kThreads];
  __shared__ Extent of_warp[kWarps];
  const WarpTeam warp;
  const unsigned me = threadIdx.x;
  const std::uint32_t begin = blockIdx.x * kThreads;
  if (begin + me < count) {
    triangle[me] = order[begin + me];
    for (int k = 0; k < 3; ++k) middle[k][me] = middles[std::size_t(k) * count + triangle[me]];
  }
  std::uint32_t index = me;  // of the triangle at this thread's position
  __syncthreads();
  for (unsigned size = kThreads; size > kWideWidth; size /= 2) {
    const bool present = begin + index < count;
    float point[3] = {};
    for (int k = 0; k < 3; ++k)
      if (present) point[k] = middle[k][index];
    const Extent mine = extent_of_warp(warp, present, point);
    if (warp.lane() == 0) of_warp[me / 32] = mine;
    __syncthreads();
    Extent part;
    const unsigned warps = size / 32;
    for (int j = 0; j < 6; ++j)
      part.word[j] = warp.min(of_warp[(me / 32 & ~(warps - 1)) + (me & (warps - 1))].word[j]);
    const int axis = part.longest();
    // Absent lanes are sorted behind the last triangle.
    const std::uint32_t place =
        present ? part.place(point[axis], axis, kLastPlace - 1) : kLastPlace;
    index = sort_in_block(place << kIndexBits | index, size, scratch) & (kThreads - 1);
    __syncthreads();
  }
  if (begin + me < count) order[begin + me] = triangle[index];
}

}  // namespace

DeviceArray<std::uint32_t> order_triangles(Queue& queue, const double* vertices,
                                           const std::uint32_t* triangles, std::uint32_t count) {
  const unsigned blocks = blocks_for(count, kThreads);
  const cudaStream_t stream = queue.stream();
  DeviceArray<float> middles(queue, 3 * std::size_t{count});
  DeviceArray<std::uint32_t> order(queue, count), keys(queue, count);
  launch("ordering the triangles", find_middles, blocks, kThreads, stream, vertices, triangles,
         count, middles.data(), order.data());

  // Sorts the parts of `whole` triangles; divides them into parts of `size` if there is more than
  // one.
  const auto cut = [&](std::uint32_t whole, std::uint32_t size) {
    if (size >= count) return;
    const unsigned parts = blocks_for(count, whole);
    const int part_bits = std::bit_width(parts - 1);
    const int place_bits = std::min(kPlaceBits, 32 - part_bits);
    DeviceArray<Extent> extents(queue, parts);
    extents.fill_bytes(0xFF);
    launch("ordering the triangles", find_extents, blocks, kThreads, stream, middles.data(),
           order.data(), count, whole, extents.data());
    launch("ordering the triangles", place_in_parts, blocks, kThreads, stream, middles.data(),
           order.data(), count, whole, extents.data(), place_bits, keys.data());
    sort_pairs(queue, keys, order, part_bits + place_bits);
  };
  constexpr std::uint32_t kMost = 1u << 30;  // triangles
  for (std::uint32_t whole = kMost; whole > kNodeTriangles; whole /= kWideWidth) {
    cut(whole, whole / 4);
    cut(whole / 4, whole / 16);
    cut(whole / 16, whole / 32);
  }
  launch("ordering the triangles", cut_into_blocks, blocks, kThreads, stream, middles.data(), count,
         order.data());
  return order;
}

}  // namespace ist::gpu
