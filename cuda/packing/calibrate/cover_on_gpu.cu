#include "cuda/base/atomics.h"
#include "cuda/base/check.h"
#include "cuda/base/device_array.h"
#include "cuda/base/warp_team.h"
#include "cuda/packing/calibrate/on_gpu.h"
#include "mesh/hierarchy/wide_searches.h"
#include "packing/calibrate/protrusion.h"
#include "packing/cover/cover_cells.h"

namespace ist::gpu {
namespace {

constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr double kAnywhere = 1e30;         // further than any distance, unit frame
constexpr unsigned kBlocksEach = 12;       // blocks a multiprocessor
constexpr std::uint32_t kShortList = 256;  // lists up to this long are filtered in shared memory

/// The solid in the form that cover_cell() uses.
struct DeviceCoverSurface {
  WarpTeam team;
  const WideTree& tree;

  __device__ bool nearest(const double point[3], double radius, double q[3]) const {
    const ExactReach reach(point);
    const WideNearest near = ist::nearest(team, tree, reach.p, reach.reach2(radius * radius));
    if (near.triangle == kNoTriangle) return false;
    const TriangleFrame<float> f = frame_in(tree, near.slot);
    const FramePoint<float> on = closest_in_frame(f, reach.p);
    for (int k = 0; k < 3; ++k) q[k] = f.origin[k] + (on.x * f.u[k] + on.y * f.v[k]);
    return true;
  }
  __device__ bool inside(const double point[3]) const { return ist::inside(team, tree, point); }
};

/// Cells to divide and the lists that their children filter, with their capacities.
struct Frontier {
  CoverCell* cells;
  std::uint32_t* lists;
  std::uint32_t cell_capacity, list_capacity;
};

/// Progress of a level. Counts continue beyond the capacities, so that the host learns the need.
struct Counters {
  std::uint32_t next;  ///< the next child to take
  std::uint32_t cells, listed;
  std::uint32_t scratch;
};

/// Makes each ball as large as the solid around its centre plus the slack, one warp a ball.
__global__ void __launch_bounds__(kThreads)
    clear_balls(WideTree tree, CoverBall* balls, std::uint32_t count, double slack) {
  const std::uint32_t k = blockIdx.x * kWarps + threadIdx.x / 32;
  if (k >= count) return;
  const WarpTeam team;
  CoverBall ball = balls[k];
  const double centre[3] = {ball.x, ball.y, ball.z};
  double clear = 0;
  if (inside(team, tree, centre)) clear = exact_nearest(team, tree, centre, kAnywhere).distance;
  ball.radius = (clear > ball.radius ? clear : ball.radius) + slack;
  if (team.lane() == 0) balls[k] = ball;
}

__global__ void list_all(std::uint32_t* list, std::uint32_t count) {
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k < count) list[k] = k;
}

/// Divides every cell of `from` into children, one warp each.
__global__ void __launch_bounds__(kThreads)
    divide(WideTree tree, CoverLevel level, Frontier from, std::uint32_t cell_count, Frontier to,
           std::uint32_t* scratch, std::uint32_t scratch_capacity, unsigned long long* raised,
           Counters* counters) {
  __shared__ std::uint32_t short_lists[kWarps][kShortList];
  const WarpTeam team;
  const DeviceCoverSurface surface{team, tree};
  for (;;) {
    const std::uint32_t child = take(team, &counters->next, 1);
    if (child >= 8 * cell_count) return;
    CoverCell cell = cover_child(from.cells[child / 8], static_cast<int>(child % 8), level.half);
    std::uint32_t* keep = short_lists[threadIdx.x / 32];
    if (cell.count > kShortList) {
      const std::uint32_t at = take(team, &counters->scratch, cell.count);
      if (at + cell.count > scratch_capacity) continue;  // the host sees it and tries again
      keep = scratch + at;
    }
    const CoverVerdict verdict =
        cover_cell(team, level, surface, cell, from.lists + cell.first, keep);
    if (verdict.demand.asks() && team.lane() == 0)
      atomicMax(&raised[verdict.demand.ball],
                static_cast<unsigned long long>(__double_as_longlong(verdict.demand.extension)));
    if (verdict.divide) {
      const std::uint32_t first = take(team, &counters->listed, verdict.count);
      const std::uint32_t place = take(team, &counters->cells, 1);
      if (first + verdict.count <= to.list_capacity && place < to.cell_capacity) {
        for (std::uint32_t i = static_cast<std::uint32_t>(team.lane()); i < verdict.count; i += 32)
          to.lists[first + i] = keep[i];
        cell.inside = verdict.inside;
        cell.first = first;
        cell.count = verdict.count;
        if (team.lane() == 0) to.cells[place] = cell;
      }
    }
    team.sync();  // before the next cell's list overwrites this one's
  }
}

struct FrontierArrays {
  DeviceArray<CoverCell> cells;
  DeviceArray<std::uint32_t> lists;

  FrontierArrays(Queue& queue, std::size_t cell_capacity, std::size_t list_capacity)
      : cells(queue, cell_capacity), lists(queue, list_capacity) {}
  Frontier view() const {
    return {cells.data(), lists.data(), static_cast<std::uint32_t>(cells.size()),
            static_cast<std::uint32_t>(lists.size())};
  }
};

/// Finds the largest protrusion of balls, one warp a ball.
__global__ void __launch_bounds__(kThreads)
    find_protrusion(WideTree tree, const Sphere* balls, std::uint32_t count,
                    unsigned long long* largest) {
  const std::uint32_t k = blockIdx.x * kWarps + threadIdx.x / 32;
  if (k >= count) return;
  const WarpTeam team;
  const double centre[3] = {balls[k].x, balls[k].y, balls[k].z};
  const double distance = exact_nearest(team, tree, centre, kAnywhere).distance;
  const double out = protrusion_of(balls[k].r, distance, inside(team, tree, centre));
  if (team.lane() == 0 && out > 0)  // positive doubles are ordered like their bits
    atomicMax(largest, static_cast<unsigned long long>(__double_as_longlong(out)));
}

}  // namespace

std::vector<double> cover_radii(Queue& queue, const WideTree& mesh, const CoverTask& task,
                                const std::function<void(int)>& report) {
  const cudaStream_t stream = queue.stream();
  const auto count = static_cast<std::uint32_t>(task.balls.size());
  const unsigned all_blocks = kBlocksEach * static_cast<unsigned>(queue.multiprocessors());
  DeviceArray<CoverBall> balls(queue, count);
  balls.upload(task.balls);
  launch("cover radii", clear_balls, blocks_for(count, kWarps), kThreads, stream, mesh,
         balls.data(), count, task.slack);
  DeviceArray<double> extension(queue, count), raised(queue, count);
  extension.fill_bytes(0);
  raised.fill_bytes(0);

  const std::size_t n = count;
  FrontierArrays from(queue, 16 * n + 65536, 128 * n + 65536),
      to(queue, from.cells.size(), from.lists.size());
  DeviceArray<std::uint32_t> scratch(queue, 256 * n + 65536);
  DeviceArray<Counters> counters(queue, 1);
  CoverCell first{task.middle[0], task.middle[1], task.middle[2], 0, count, false};
  from.cells.upload({&first, 1});
  launch("cover radii", list_all, blocks_for(count, kThreads), kThreads, stream, from.lists.data(),
         count);

  CoverLevel level;
  level.half = task.half;
  level.smallest = task.slack;
  level.balls = balls.data();
  level.extension = extension.data();
  std::uint32_t cells = 1;
  for (int depth = 1; cells > 0; ++depth) {
    report(depth);
    level.half *= 0.5;
    Counters seen{};
    for (;;) {
      counters.fill_bytes(0);
      launch("cover radii", divide, all_blocks, kThreads, stream, mesh, level, from.view(), cells,
             to.view(), scratch.data(), static_cast<std::uint32_t>(scratch.size()),
             reinterpret_cast<unsigned long long*>(raised.data()), counters.data());
      counters.download({&seen, 1});
      queue.wait();
      // If a capacity was too small, enlarges it and repeats the level; violations that were noted
      // already stay true.
      const bool fits = seen.cells <= to.cells.size() && seen.listed <= to.lists.size() &&
                        seen.scratch <= scratch.size();
      if (fits) break;
      to.cells.grow(std::size_t{seen.cells} * 3 / 2, 0);
      to.lists.grow(std::size_t{seen.listed} * 3 / 2, 0);
      scratch.grow(std::size_t{seen.scratch} * 3 / 2, 0);
    }
    extension.copy(raised, count);
    std::swap(from, to);
    cells = seen.cells;
  }

  std::vector<CoverBall> cleared(count);
  std::vector<double> radii(count);
  balls.download(std::span(cleared));
  extension.download(std::span(radii));
  queue.wait();
  for (std::size_t k = 0; k < radii.size(); ++k) radii[k] = cleared[k].radius + radii[k];
  return radii;
}

double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere> balls) {
  const auto count = static_cast<std::uint32_t>(balls.size());
  DeviceArray<Sphere> on_device(queue, count);
  on_device.upload(balls);
  DeviceArray<double> largest(queue, 1);
  largest.fill_bytes(0);
  launch("measuring protrusions", find_protrusion, blocks_for(count, kWarps), kThreads,
         queue.stream(), mesh, on_device.data(), count,
         reinterpret_cast<unsigned long long*>(largest.data()));
  return largest.at(0);
}

}  // namespace ist::gpu
