#include "packing/cover/cover.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/elementary.h"
#include "base/stage.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "packing/base/unit_field.h"
#include "packing/cover/cover_cells.h"

namespace ist {
namespace {

/// A mesh in the form that cover_cell() uses.
class MeshCover {
 public:
  explicit MeshCover(const MeshSolid& solid) : solid_(solid), view_(solid.view()) {}

  bool nearest(const double point[3], double radius, double q[3]) const {
    const ExactReach reach(point);
    const NearestTriangle near = nearest_triangle(view_, reach.p, reach.reach2(radius * radius));
    for (int k = 0; k < 3; ++k) q[k] = near.point[k];
    return near.triangle != kNoTriangle;
  }
  bool inside(const double point[3]) const { return solid_.inside(Eigen::Vector3d(point)); }
  /// Distance of an inside point from the surface; 0 for a point outside.
  double depth(const Eigen::Vector3d& point) const {
    return solid_.inside(point) ? solid_.closest_point(point).distance : 0;
  }

 private:
  const MeshSolid& solid_;
  const MeshView& view_;
};

/// A signed distance in the form that cover_cell() uses.
struct FieldCover : packing::UnitField {
  bool nearest(const double point[3], double radius, double q[3]) const {
    const Eigen::Vector3d x(point);
    const double s = value(x);
    if (std::abs(s) > radius) return false;
    Eigen::Vector3d::Map(q) = foot(x, s);
    return true;
  }
  bool inside(const double point[3]) const { return value(Eigen::Vector3d(point)) < 0; }
  double depth(const Eigen::Vector3d& point) const { return std::max(0.0, -value(point)); }
};

/// Cells to divide, and the lists that their children filter.
struct Frontier {
  std::vector<CoverCell> cells;
  std::vector<std::uint32_t> lists;
};

void raise_to(double& extension, double value) {
  std::atomic_ref<double> shared(extension);
  double now = shared.load(std::memory_order_relaxed);
  while (now < value && !shared.compare_exchange_weak(now, value, std::memory_order_relaxed)) {
  }
}

/// One level of the subdivision: the children of every cell of `from`, on all threads.
template <class Surface>
Frontier divide(const Frontier& from, const CoverLevel& level, const Surface& surface,
                std::vector<double>& raised) {
  tbb::enumerable_thread_specific<Frontier> parts;
  tbb::parallel_for(std::size_t{0}, from.cells.size(), [&](std::size_t c) {
    Frontier& part = parts.local();
    for (int octant = 0; octant < 8; ++octant) {
      CoverCell cell = cover_child(from.cells[c], octant, level.half);
      const std::size_t first = part.lists.size();
      part.lists.resize(first + cell.count);
      const CoverVerdict verdict =
          cover_cell(SerialTeam(), level, surface, cell, from.lists.data() + cell.first,
                     part.lists.data() + first);
      if (verdict.demand.asks()) raise_to(raised[verdict.demand.ball], verdict.demand.extension);
      part.lists.resize(first + verdict.count);
      if (!verdict.divide) continue;
      cell.inside = verdict.inside;
      cell.first = static_cast<std::uint32_t>(first);
      cell.count = verdict.count;
      part.cells.push_back(cell);
    }
  });
  Frontier all;
  for (const Frontier& part : parts) {
    const auto shift = static_cast<std::uint32_t>(all.lists.size());
    for (CoverCell cell : part.cells) {
      cell.first += shift;
      all.cells.push_back(cell);
    }
    all.lists.insert(all.lists.end(), part.lists.begin(), part.lists.end());
  }
  return all;
}

template <class Surface>
std::vector<double> cover(const Surface& surface, const CoverTask& task,
                          const std::function<void(int)>& report) {
  std::vector<CoverBall> balls(task.balls.begin(), task.balls.end());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t k) {
    CoverBall& ball = balls[k];
    const Eigen::Vector3d centre(ball.x, ball.y, ball.z);
    // A ball up to the surface is part of the solid: the separation bound loses nothing by it.
    ball.radius = std::max(ball.radius, surface.depth(centre)) + task.slack;
  });
  const auto count = static_cast<std::uint32_t>(balls.size());
  Frontier frontier;
  frontier.cells.push_back({task.middle[0], task.middle[1], task.middle[2], 0, count, false});
  frontier.lists.resize(count);
  std::iota(frontier.lists.begin(), frontier.lists.end(), 0u);
  std::vector<double> extensions(count, 0.0), raised = extensions;
  CoverLevel level;
  level.half = task.half;
  level.smallest = task.slack;
  level.balls = balls.data();
  level.extension = extensions.data();
  for (int depth = 1; !frontier.cells.empty(); ++depth) {
    report(depth);
    level.half *= 0.5;
    frontier = divide(frontier, level, surface, raised);
    extensions = raised;
  }
  for (std::size_t k = 0; k < count; ++k) extensions[k] = balls[k].radius + extensions[k];
  return extensions;
}

}  // namespace

std::vector<float> cover_radii(const MeshSolid& solid, SolidBackend& backend,
                               std::span<const Sphere> inner, const ProgressCallback& progress) {
  if (inner.empty()) throw Error("cover: no inner spheres");
  Stage stage("cover", progress);
  stage.step(inner.size(), 0);

  std::vector<CoverBall> balls;
  for (const Sphere& s : inner) balls.push_back({s.x, s.y, s.z, s.r});
  const Eigen::AlignedBox3d box(solid.frame().to_unit(solid.bounds().min()),
                                solid.frame().to_unit(solid.bounds().max()));
  const Eigen::Vector3d middle = box.center();
  const double mean_volume = solid.unit_volume() / static_cast<double>(inner.size());
  CoverTask task;
  task.balls = balls;
  task.slack = kCoverSlack * cube_root(3 * mean_volume / (4 * std::numbers::pi));
  for (int k = 0; k < 3; ++k) task.middle[k] = middle[k];
  task.half = 0.5 * box.sizes().maxCoeff() + 1e-9;  // the cube around the box, rounding included
  const std::vector<double> exact =
      backend.cover_radii(task, [&](int depth) { stage.step(inner.size(), 1 - 1.0 / depth); });
  std::vector<float> radii(inner.size());
  for (std::size_t k = 0; k < radii.size(); ++k) radii[k] = rounded_up(exact[k]);
  stage.step(inner.size(), 1);
  return radii;
}

std::vector<double> cover_on_host(const MeshSolid& solid, const CoverTask& task,
                                  const std::function<void(int)>& report) {
  return cover(MeshCover(solid), task, report);
}

std::vector<double> cover_on_host(const Solid& solid, const UnitFrame& frame, const CoverTask& task,
                                  const std::function<void(int)>& report) {
  return cover(FieldCover{{solid, frame}}, task, report);
}

}  // namespace ist
