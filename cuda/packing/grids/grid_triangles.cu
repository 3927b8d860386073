#include "cuda/packing/grids/device_grid.h"

#include "cuda/base/check.h"
#include "packing/grids/local_winding.h"

namespace ist::gpu {
namespace {

using packing::CellRange;
using packing::CellRecord;
using packing::DistanceGrid;
using packing::GridLayout;
using packing::GridScene;
using packing::TriangleCells;

constexpr unsigned kThreads = 128;
constexpr unsigned kWarps = kThreads / 32;
constexpr std::uint32_t kMostCellsOfAWarp = 4096;

__device__ unsigned global_thread() { return blockIdx.x * kThreads + threadIdx.x; }

__global__ void make_triangles(const double* vertices, const std::uint32_t* corners,
                               std::uint32_t count, packing::GridTriangle* triangles) {
  const unsigned t = global_thread();
  if (t >= count) return;
  const std::uint32_t* c = corners + 3 * std::size_t{t};
  triangles[t] = packing::make_grid_triangle(vertices + 3 * std::size_t{c[0]},
                                             vertices + 3 * std::size_t{c[1]},
                                             vertices + 3 * std::size_t{c[2]});
}

/// Counts a triangle in the cells that it overlaps, and its crossings in the rows whose centre
/// lines it pierces.
struct CountTriangles {
  std::uint32_t* counts;
  std::int32_t* crossings;

  __device__ void meet(std::uint32_t cell, std::uint32_t) const { atomicAdd(counts + cell, 1u); }
  __device__ void row(const GridLayout& g, const Corners& corners, const TriangleCells& cells,
                      int j, int k) const {
    const int crossing = packing::row_crossing(g, corners, j, k);
    if (crossing == 0) return;
    const int i = packing::first_in_row(g, cells, j, k);
    if (i != packing::kNoCell) atomicAdd(crossings + g.id(i, j, k), crossing);
  }
};

struct ListTriangles {
  const std::uint32_t* words;
  const CellRecord* records;
  std::int32_t* filled;
  std::uint32_t* lists;

  __device__ void meet(std::uint32_t cell, std::uint32_t triangle) const {
    const CellRecord& record = records[DistanceGrid::slot(words[cell])];
    lists[record.triangles + static_cast<std::uint32_t>(atomicAdd(filled + cell, 1))] = triangle;
  }
  __device__ void row(const GridLayout&, const Corners&, const TriangleCells&, int, int) const {}
};

template <class Act>
__device__ void act_on(const GridScene& mesh, const GridLayout& g, std::uint32_t triangle,
                       const TriangleCells& cells, std::uint32_t first, std::uint32_t step,
                       const Act& act) {
  const CellRange& range = cells.range();
  const auto nx = static_cast<std::uint32_t>(range.hi[0] - range.lo[0] + 1);
  const auto ny = static_cast<std::uint32_t>(range.hi[1] - range.lo[1] + 1);
  for (std::uint32_t n = first; n < range.count(); n += step) {
    const int i = range.lo[0] + static_cast<int>(n % nx);
    const int j = range.lo[1] + static_cast<int>(n / nx % ny);
    const int k = range.lo[2] + static_cast<int>(n / nx / ny);
    if (cells.meets(g, i, j, k)) act.meet(g.id(i, j, k), triangle);
  }
  const Corners corners = packing::corners_of(mesh, triangle);
  for (std::uint32_t n = first; n < range.count() / nx; n += step)
    act.row(g, corners, cells, range.lo[1] + static_cast<int>(n % ny),
            range.lo[2] + static_cast<int>(n / ny));
}

/// One warp a triangle. Triangles that may meet many cells are left to the whole grid of threads.
template <class Act>
__global__ void act_on_small_triangles(const GridScene mesh, const GridLayout g,
                                       std::uint32_t count, Act act, std::uint32_t* large,
                                       std::uint32_t* large_count) {
  const std::uint32_t t = global_thread() / 32;
  if (t >= count) return;
  const TriangleCells cells = packing::cells_of(g, packing::corners_of(mesh, t));
  if (cells.range().count() > kMostCellsOfAWarp) {
    if (threadIdx.x % 32 == 0) large[atomicAdd(large_count, 1u)] = t;
    return;
  }
  act_on(mesh, g, t, cells, threadIdx.x % 32, 32, act);
}

template <class Act>
__global__ void act_on_large_triangles(const GridScene mesh, const GridLayout g, Act act,
                                       const std::uint32_t* large,
                                       const std::uint32_t* large_count) {
  for (std::uint32_t n = 0; n < *large_count; ++n) {
    const TriangleCells cells = packing::cells_of(g, packing::corners_of(mesh, large[n]));
    act_on(mesh, g, large[n], cells, global_thread(), gridDim.x * kThreads, act);
  }
}

/// HostGrid::classify(), one warp a row.
__global__ void classify_row_of_warp(const GridLayout g, const std::uint32_t* counts,
                                     std::int32_t* windings, std::uint32_t* words) {
  const unsigned row = global_thread() / 32;
  if (row >= static_cast<unsigned>(g.n[1] * g.n[2])) return;
  const unsigned lane = threadIdx.x % 32;
  const std::size_t first = std::size_t{row} * static_cast<unsigned>(g.n[0]);
  int winding = 0, last = 0;  // before this piece of the row
  for (unsigned base = 0; base < static_cast<unsigned>(g.n[0]); base += 32) {
    const bool there = base + lane < static_cast<unsigned>(g.n[0]);
    const std::size_t cell = first + base + lane;
    int sum = there ? windings[cell] : 0;
    const bool empty = there && counts[cell] == 0;
    for (unsigned d = 1; d < 32; d *= 2) {
      const int before = __shfl_up_sync(0xFFFFFFFFu, sum, d);
      if (lane >= d) sum += before;
    }
    sum += winding;
    const unsigned empties = __ballot_sync(0xFFFFFFFFu, empty);
    const unsigned before = empties & ((1u << lane) - 1u);
    const int previous = __shfl_sync(0xFFFFFFFFu, sum, before == 0 ? 0 : 31 - __clz(before));
    if (there) {
      windings[cell] = empty ? sum : (before == 0 ? last : previous);
      words[cell] = empty && sum < 1 ? DistanceGrid::kInactive : 0;
    }
    const int final_empty = __shfl_sync(0xFFFFFFFFu, sum, empties == 0 ? 0 : 31 - __clz(empties));
    if (empties != 0) last = final_empty;
    winding = __shfl_sync(0xFFFFFFFFu, sum, 31);
  }
}

template <class Act>
void act_on_all(Queue& queue, const GridScene& mesh, const GridLayout& layout, std::uint32_t count,
                const Act& act, DeviceArray<std::uint32_t>& large) {
  DeviceArray<std::uint32_t> large_count(queue, 1);
  large_count.fill_bytes(0);
  launch("listing triangles", act_on_small_triangles<Act>, blocks_for(count, kWarps), kThreads,
         queue.stream(), mesh, layout, count, act, large.data(), large_count.data());
  launch("listing triangles", act_on_large_triangles<Act>, 4 * queue.multiprocessors(), kThreads,
         queue.stream(), mesh, layout, act, large.data(), large_count.data());
}

}  // namespace

void prepare_triangles(Queue& queue, const DeviceArray<double>& vertices,
                       const DeviceArray<std::uint32_t>& corners,
                       DeviceArray<packing::GridTriangle>& triangles) {
  launch("preparing the triangles", make_triangles, blocks_for(triangles.size(), kThreads),
         kThreads, queue.stream(), vertices.data(), corners.data(),
         static_cast<std::uint32_t>(triangles.size()), triangles.data());
}

void count_triangles(Queue& queue, const GridScene& mesh, const GridLayout& layout,
                     std::uint32_t count, DeviceArray<std::uint32_t>& counts,
                     DeviceArray<std::int32_t>& crossings, DeviceArray<std::uint32_t>& large) {
  counts.fill_bytes(0);
  crossings.fill_bytes(0);
  act_on_all(queue, mesh, layout, count, CountTriangles{counts.data(), crossings.data()}, large);
}

void classify_rows(Queue& queue, const GridLayout& layout, const DeviceArray<std::uint32_t>& counts,
                   DeviceArray<std::int32_t>& windings, DeviceArray<std::uint32_t>& words) {
  const auto rows = static_cast<std::size_t>(layout.n[1]) * static_cast<std::size_t>(layout.n[2]);
  launch("classifying cells", classify_row_of_warp, blocks_for(rows, kWarps), kThreads,
         queue.stream(), layout, counts.data(), windings.data(), words.data());
}

void fill_triangle_lists(Queue& queue, const GridScene& mesh, const GridLayout& layout,
                         std::uint32_t count, const DeviceArray<std::uint32_t>& words,
                         const DeviceArray<CellRecord>& records, DeviceArray<std::int32_t>& filled,
                         DeviceArray<std::uint32_t>& large, DeviceArray<std::uint32_t>& lists) {
  filled.fill_bytes(0);
  act_on_all(queue, mesh, layout, count,
             ListTriangles{words.data(), records.data(), filled.data(), lists.data()}, large);
}

}  // namespace ist::gpu
