#include "build/cover.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <ist/error.h>

#include "build/cube_root.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

// Every ball starts this much larger than it need be, over the mean leaf radius: cells that it
// holds then need not be divided down to the surface.
constexpr double kSlack = 0.1;
// A cell is small enough once its half-diagonal is this part of the extension that it asks for.
constexpr double kRefinement = 0.2;
constexpr double kMargin = 1e-12;  // unit frame, above the rounding of any distance here
constexpr int kTaskDepth = 3;      // cells of this depth are handed to threads and reported

/// A ball that may be enlarged.
struct Ball {
  Eigen::Vector3d centre;
  double radius = 0;  // unit frame, before extension
};

struct Cell {
  Eigen::Vector3d centre;
  double half = 0;      // half edge, unit frame
  bool inside = false;  // known to lie wholly inside the solid
  int depth = 0;
};

using BallList = std::vector<std::uint32_t>;

class Coverer {
 public:
  Coverer(const MeshSolid& solid, std::vector<Ball> balls, double smallest)
      : solid_(solid),
        balls_(std::move(balls)),
        smallest_(smallest),
        extension_(std::vector<double>(balls_.size(), 0.0)) {}

  /// Divides a cell until it is proven covered. `leaf` cells are collected instead.
  void cover(Cell cell, const BallList& parent_list,
             std::vector<std::pair<Cell, BallList>>* later) {
    const double reach = std::sqrt(3.0) * cell.half + kMargin;
    if (!cell.inside && outside(cell, reach)) return;
    const BallList list = near(cell, reach, parent_list);
    if (list.empty()) return;
    // The ball that needs the least extension to hold the cell.
    std::uint32_t best = list[0];
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t k : list) {
      const double need = farthest(cell, balls_[k].centre) - balls_[k].radius;
      if (need < least) {
        least = need;
        best = k;
      }
    }
    if (least + kMargin <= 0) return;
    const double gap = least - reach;
    if (reach <= std::max(smallest_, kRefinement * gap)) {
      double& extension = extension_.local()[best];
      extension = std::max(extension, least + kMargin);
      return;
    }
    if (later != nullptr && cell.depth == kTaskDepth) {
      later->push_back({cell, list});
      return;
    }
    const double half = 0.5 * cell.half;
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d shift((k & 1) != 0 ? half : -half, (k & 2) != 0 ? half : -half,
                                  (k & 4) != 0 ? half : -half);
      cover({cell.centre + shift, half, cell.inside, cell.depth + 1}, list, later);
    }
  }

  std::vector<double> extensions() const {
    std::vector<double> result(balls_.size(), 0.0);
    for (const std::vector<double>& part : extension_)
      for (std::size_t k = 0; k < result.size(); ++k) result[k] = std::max(result[k], part[k]);
    return result;
  }

 private:
  static double farthest(const Cell& cell, const Eigen::Vector3d& x) {
    const double dx = std::abs(cell.centre.x() - x.x()) + cell.half;
    const double dy = std::abs(cell.centre.y() - x.y()) + cell.half;
    const double dz = std::abs(cell.centre.z() - x.z()) + cell.half;
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  }

  /// True if the cell certainly lies outside; notes in the cell if it certainly lies inside.
  bool outside(Cell& cell, double reach) const {
    if (solid_.closest_point(cell.centre, reach).distance < reach) return false;
    cell.inside = solid_.inside(cell.centre);
    return !cell.inside;
  }

  /// The listed balls that may be the nearest somewhere in the cell.
  BallList near(const Cell& cell, double reach, const BallList& list) const {
    std::vector<double> gaps(list.size());
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < list.size(); ++k) {
      const Ball& ball = balls_[list[k]];
      gaps[k] = (cell.centre - ball.centre).norm() - ball.radius;
      least = std::min(least, gaps[k]);
    }
    if (least + reach + kMargin <= 0) return {};  // one ball holds the cell
    BallList kept;
    for (std::size_t k = 0; k < list.size(); ++k)
      if (gaps[k] <= least + 2 * reach) kept.push_back(list[k]);
    return kept;
  }

  const MeshSolid& solid_;
  std::vector<Ball> balls_;
  double smallest_;
  tbb::enumerable_thread_specific<std::vector<double>> extension_;
};

float round_up(double x) {
  const float f = static_cast<float>(x);
  return double{f} < x ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace

std::vector<float> cover_radii(const MeshSolid& solid, std::span<const Sphere> inner,
                               unsigned threads, const ProgressCallback& progress) {
  if (inner.empty()) throw Error("cover radii: no inner spheres");
  const auto start = std::chrono::steady_clock::now();
  const auto report = [&](double fraction) {
    if (!progress) return;
    Progress now;
    now.stage = "cover";
    now.spheres = inner.size();
    now.fraction = fraction;
    now.elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!progress(now)) throw Error("cover radii: cancelled");
  };
  tbb::task_arena arena = thread_arena(threads);

  const double mean_volume = solid.unit_volume() / static_cast<double>(inner.size());
  const double slack = kSlack * cube_root(3 * mean_volume / (4 * std::numbers::pi));
  // A ball up to the surface is part of the solid: it costs the separation bound nothing.
  std::vector<Ball> balls(inner.size());
  report(0);
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t k) {
      const Eigen::Vector3d centre(inner[k].x, inner[k].y, inner[k].z);
      const double clear = solid.inside(centre) ? solid.closest_point(centre).distance : 0;
      balls[k] = {centre, std::max(double{inner[k].r}, clear) + slack};
    });
  });

  Coverer coverer(solid, balls, slack);
  std::vector<std::pair<Cell, BallList>> tasks;
  BallList all(balls.size());
  std::iota(all.begin(), all.end(), 0u);
  const Eigen::AlignedBox3d box(solid.frame().to_unit(solid.bounds().min()),
                                solid.frame().to_unit(solid.bounds().max()));
  // The cells start as the cube around the box, rounding included.
  const double half = 0.5 * box.sizes().maxCoeff() + 1e-9;
  coverer.cover({box.center(), half, false, 0}, all, &tasks);
  constexpr std::size_t kBatch = 64;
  for (std::size_t first = 0; first < tasks.size(); first += kBatch) {
    report(static_cast<double>(first) / static_cast<double>(tasks.size()));
    const std::size_t last = std::min(tasks.size(), first + kBatch);
    arena.execute([&] {
      tbb::parallel_for(first, last, [&](std::size_t k) {
        coverer.cover(tasks[k].first, tasks[k].second, nullptr);
      });
    });
  }

  const std::vector<double> extensions = coverer.extensions();
  std::vector<float> radii(inner.size());
  for (std::size_t k = 0; k < radii.size(); ++k)
    radii[k] = round_up(balls[k].radius + extensions[k]);
  report(1);
  return radii;
}

}  // namespace ist
