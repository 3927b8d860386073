#include "cuda/packing/calibrate/on_gpu.h"

#include "cuda/base/check.h"
#include "cuda/base/device_array.h"
#include "mesh/hierarchy/wide_searches.h"
#include "packing/calibrate/power_relaxation.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreads = 128;
/// Many threads draw a triangle over more lines than this.
constexpr std::uint64_t kManyLines = 64;

/// Receives crossings: counts them, or writes each to its line's segment.
struct CrossingSink {
  std::uint32_t* counts;  ///< of each line; decremented while writing
  const std::uint32_t* first;
  Crossing* crossings;  ///< null: count

  __device__ void add(std::uint64_t line, const Crossing& crossing) const {
    if (crossings == nullptr) {
      atomicAdd(counts + line, 1u);
    } else {
      crossings[first[line] + atomicSub(counts + line, 1u) - 1] = crossing;
    }
  }
};

__device__ void draw(const LineLattice& lines, const Corners& corners, std::uint32_t i,
                     std::uint32_t j, const CrossingSink& sink) {
  const Crossing crossing = crossing_of(lines, corners, i, j);
  if (crossing.sign != 0) sink.add(std::uint64_t{j} * lines.ny + i, crossing);
}

/// Lines that may pierce a triangle, estimated from its box.
__device__ std::uint64_t lines_over(const LineLattice& lines, const Corners& t,
                                    const LatticeRange& rows) {
  double low = t.p[0][1], high = low;
  for (int k = 1; k < 3; ++k) {
    low = t.p[k][1] < low ? t.p[k][1] : low;
    high = t.p[k][1] > high ? t.p[k][1] : high;
  }
  return static_cast<std::uint64_t>((high - low) / lines.step_y + 2) * (rows.last - rows.first);
}

/// One thread a triangle; large ones are appended to a list.
__global__ void __launch_bounds__(kThreads)
    draw_triangles(WideTree tree, LineLattice lines, CrossingSink sink, std::uint32_t* large,
                   std::uint32_t* large_count) {
  const std::uint32_t slot = blockIdx.x * kThreads + threadIdx.x;
  if (slot >= tree.block_count * kWideWidth || triangle_in(tree, slot) == kNoTriangle) return;
  const Corners corners = corners_in(tree, slot);
  const LatticeRange rows = rows_of(lines, corners);
  if (rows.first >= rows.last) return;
  if (lines_over(lines, corners, rows) > kManyLines) {
    large[atomicAdd(large_count, 1u)] = slot;
    return;
  }
  for (std::uint32_t j = rows.first; j < rows.last; ++j) {
    const LatticeRange in_row = lines_of(lines, corners, j);
    for (std::uint32_t i = in_row.first; i < in_row.last; ++i) draw(lines, corners, i, j, sink);
  }
}

/// The large triangles, one warp a row.
__global__ void __launch_bounds__(kThreads)
    draw_large(WideTree tree, LineLattice lines, CrossingSink sink, const std::uint32_t* large,
               const std::uint32_t* large_count) {
  constexpr unsigned kWarps = kThreads / 32;
  const std::uint32_t lane = threadIdx.x % 32;
  for (std::uint32_t n = blockIdx.x; n < *large_count; n += gridDim.x) {
    const Corners corners = corners_in(tree, large[n]);
    const LatticeRange rows = rows_of(lines, corners);
    for (std::uint32_t j = rows.first + blockIdx.y * kWarps + threadIdx.x / 32; j < rows.last;
         j += gridDim.y * kWarps) {
      const LatticeRange in_row = lines_of(lines, corners, j);
      for (std::uint32_t i = in_row.first + lane; i < in_row.last; i += 32)
        draw(lines, corners, i, j, sink);
    }
  }
}

/// Sorts in place; lines rarely have more than a few crossings.
__device__ void sort_crossings(Crossing* crossings, std::uint32_t count) {
  for (std::uint32_t gap = count > 32 ? count / 2 : 1; gap > 0; gap /= 2)  // Shell's
    for (std::uint32_t k = gap; k < count; ++k) {
      const Crossing moving = crossings[k];
      std::uint32_t place = k;
      for (; place >= gap && comes_before(moving, crossings[place - gap]); place -= gap)
        crossings[place] = crossings[place - gap];
      crossings[place] = moving;
    }
}

/// Sorts a line's crossings and counts its spans, one thread a line. Sums the spans' lengths.
__global__ void __launch_bounds__(kThreads)
    count_spans(Crossing* crossings, const std::uint32_t* first, std::uint64_t line_count,
                std::uint32_t* span_counts, unsigned long long* length) {
  const std::uint64_t line = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  unsigned long long units = 0;
  if (line < line_count) {
    const std::uint32_t begin = first[line], count = first[line + 1] - begin;
    std::uint32_t spans = 0;
    sort_crossings(crossings + begin, count);
    for_spans(crossings + begin, count, [&](const ColumnSpan& span) {
      ++spans;
      units += length_units(span);
    });
    span_counts[line] = spans;
  }
  for (int apart = 16; apart > 0; apart /= 2) units += __shfl_down_sync(~0u, units, apart);
  if (threadIdx.x % 32 == 0 && units > 0) atomicAdd(length, units);
}

__global__ void __launch_bounds__(kThreads)
    write_spans(const Crossing* crossings, const std::uint32_t* first, std::uint64_t line_count,
                const std::uint32_t* first_span, ColumnSpan* spans) {
  const std::uint64_t line = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (line >= line_count) return;
  std::uint32_t next = first_span[line];
  for_spans(crossings + first[line], first[line + 1] - first[line],
            [&](const ColumnSpan& span) { spans[next++] = span; });
}

__device__ void set_flag(std::uint32_t* flags, std::uint64_t flag) {
  atomicOr(flags + (flag >> 5), 1u << (flag & 31));
}

/// The finest level with flags, one thread a column.
__global__ void __launch_bounds__(kThreads)
    flag_spans(PowerGrid grid, std::uint64_t line_count, std::uint32_t* flags) {
  const std::uint64_t line = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (line >= line_count) return;
  const auto j = static_cast<std::uint32_t>(line / grid.columns.ny);
  const auto i = static_cast<std::uint32_t>(line % grid.columns.ny);
  for (std::uint32_t s = grid.first[line]; s < grid.first[line + 1]; ++s)
    for_flags(grid, grid.spans[s], i, j, [&](std::uint64_t flag) { set_flag(flags, flag); });
}

/// A coarser level, one thread a cell.
__global__ void __launch_bounds__(kThreads)
    flag_level(PowerGrid grid, int level, std::uint32_t* flags) {
  const std::uint64_t flag = std::uint64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (flag >= grid.cells(level)) return;
  const std::uint32_t ns = PowerGrid::cells(grid.nx, level);
  const std::uint32_t ni = PowerGrid::cells(grid.columns.ny, level);
  const PowerGridCell cell = {static_cast<std::uint32_t>(flag % ns),
                              static_cast<std::uint32_t>(flag / ns % ni),
                              static_cast<std::uint32_t>(flag / ns / ni), level};
  if (any_child(grid, cell)) set_flag(flags, flag);
}

}  // namespace

ColumnsOnGpu::ColumnsOnGpu(Queue& queue, const WideTree& mesh, const ColumnPlan& plan) {
  cut(queue, mesh, plan.lines);
  grid_ = plan_power_grid(plan, length_);
  grid_.first = first_.data();
  grid_.spans = spans_.data();
  if (length_ > 0) flag(queue);
}

void ColumnsOnGpu::cut(Queue& queue, const WideTree& mesh, const LineLattice& lines) {
  const cudaStream_t stream = queue.stream();
  const std::uint64_t line_count = lines.lines();
  const std::uint32_t slots = mesh.block_count * kWideWidth;
  DeviceArray<std::uint32_t> counts(queue, line_count + 1), first(queue, line_count + 1);
  DeviceArray<std::uint32_t> large(queue, slots), large_count(queue, 1);
  DeviceArray<unsigned long long> length(queue, 1);
  counts.fill_bytes(0);
  length.fill_bytes(0);
  const auto draw_all = [&](Crossing* crossings) {
    const CrossingSink sink = {counts.data(), first.data(), crossings};
    large_count.fill_bytes(0);
    launch("drawing the mesh onto columns", draw_triangles, blocks_for(slots, kThreads), kThreads,
           stream, mesh, lines, sink, large.data(), large_count.data());
    draw_large<<<dim3(64, 16), kThreads, 0, stream>>>(mesh, lines, sink, large.data(),
                                                      large_count.data());
    check_launch("drawing the mesh onto columns");
  };
  draw_all(nullptr);
  first.copy(counts, counts.size());
  exclusive_sum(queue, first);
  const std::uint32_t crossing_count = first.at(line_count);
  DeviceArray<Crossing> crossings(queue, crossing_count);
  draw_all(crossings.data());

  first_ = DeviceArray<std::uint32_t>(queue, line_count + 1);
  first_.fill_bytes(0);
  spans_ = DeviceArray<ColumnSpan>(queue, crossing_count / 2 + 1);
  launch("cutting columns", count_spans, blocks_for(line_count, kThreads), kThreads, stream,
         crossings.data(), first.data(), line_count, first_.data(), length.data());
  exclusive_sum(queue, first_);
  launch("cutting columns", write_spans, blocks_for(line_count, kThreads), kThreads, stream,
         crossings.data(), first.data(), line_count, first_.data(), spans_.data());
  length_ = static_cast<double>(length.at(0)) * kLengthUnit;
}

void ColumnsOnGpu::flag(Queue& queue) {
  for (int level = kFlagLevel; level < grid_.levels; ++level) {
    const std::uint64_t cells = grid_.cells(level);
    flags_.emplace_back(queue, (cells + 31) / 32);
    flags_.back().fill_bytes(0);
    if (level == kFlagLevel) {
      const std::uint64_t line_count = grid_.columns.lines();
      launch("flagging cells of columns", flag_spans, blocks_for(line_count, kThreads), kThreads,
             queue.stream(), grid_, line_count, flags_.back().data());
    } else {
      launch("flagging cells of columns", flag_level, blocks_for(cells, kThreads), kThreads,
             queue.stream(), grid_, level, flags_.back().data());
    }
    grid_.flags[level] = flags_.back().data();
  }
}

}  // namespace ist::gpu
