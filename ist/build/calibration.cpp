#include "build/calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include <ist/error.h>

#include "build/column_lattice.h"
#include "build/cube_root.h"
#include "build/power_cells.h"
#include "build/turned_solid.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

constexpr int kRelaxations = 16;
constexpr double kStep = 0.15;  // distance of columns over the mean leaf radius
// Enough columns to measure the solid where spheres are few, and a bound where it is thin.
constexpr double kMinColumns = 1u << 14;
constexpr double kColumnsPerSphere = 64;
// Columns that see less or more of the volume than this are too few: a sliver at a slant.
constexpr double kLargestMiss = 0.1;
// Radius of a sphere whose cell is empty, over the mean leaf radius: legal, and counts for nothing.
constexpr double kEmptyCellRadius = 1e-4;
constexpr double kMargin = 1e-12;  // unit frame, above the rounding of any distance here

double radius_of(double volume) { return cube_root(3 * volume / (4 * std::numbers::pi)); }

/// Shares by the inner spheres' own volumes, for a solid that columns cannot measure.
std::vector<PowerCell> inflated_spheres(std::span<const Sphere> inner) {
  std::vector<PowerCell> cells;
  double sum = 0;
  for (const Sphere& s : inner) {
    cells.push_back({double{s.r} * s.r * s.r, s.x, s.y, s.z});
    sum += cells.back().share;
  }
  for (PowerCell& cell : cells) cell.share /= sum;
  return cells;
}

/// Distance by which a ball sticks out of the solid at most, rounding included; negative if it lies
/// inside.
double protrusion(const MeshSolid& solid, const Sphere4& ball) {
  const Eigen::Vector3d centre(ball.x, ball.y, ball.z);
  const double distance = solid.closest_point(centre).distance;
  return ball.r + (solid.inside(centre) ? -distance : distance) + kMargin;
}

}  // namespace

Calibration calibrate(const MeshSolid& solid, std::span<const Sphere> inner, unsigned threads,
                      const ProgressCallback& progress) {
  if (inner.empty()) throw Error("calibration: no inner spheres");
  const auto start = std::chrono::steady_clock::now();
  const auto report = [&](double fraction) {
    if (!progress) return;
    Progress now;
    now.stage = "calibrate";
    now.spheres = inner.size();
    now.fraction = fraction;
    now.elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!progress(now)) throw Error("calibration: cancelled");
  };
  tbb::task_arena arena = thread_arena(threads);

  // The cells are found in the frame of the turned solid.
  report(0);
  const TurnedSolid turned(solid);
  const double volume = turned.solid().unit_volume();
  const double mean_radius = radius_of(volume / static_cast<double>(inner.size()));
  std::vector<PowerSite> sites;
  for (const Sphere& s : inner) {
    const Eigen::Vector3d x = turned.turn({s.x, s.y, s.z});
    const double radius = s.r / turned.scale();
    sites.push_back({x.x(), x.y(), x.z(), radius * radius});
  }
  ColumnLattice lattice;
  arena.execute([&] {
    lattice = cut_columns(turned.solid(), kStep * mean_radius, kMinColumns,
                          kMinColumns + kColumnsPerSphere * static_cast<double>(inner.size()));
  });
  if (std::abs(lattice.volume() - volume) > kLargestMiss * volume) lattice = {};

  std::vector<PowerCell> cells = inflated_spheres(inner);
  for (int round = 0; round < kRelaxations && lattice.length > 0; ++round) {
    report(0.2 + 0.8 * round / kRelaxations);
    arena.execute([&] { cells = power_cells(lattice, sites); });
    for (std::size_t k = 0; k < sites.size(); ++k) {
      if (cells[k].share <= 0) continue;  // keeps its place, and may win some back
      const double radius = radius_of(cells[k].share * volume);
      sites[k] = {cells[k].x, cells[k].y, cells[k].z, radius * radius};
    }
  }

  Calibration result;
  result.effective.resize(inner.size());
  for (std::size_t k = 0; k < sites.size(); ++k) {
    const double radius = cells[k].share > 0 ? radius_of(cells[k].share * solid.unit_volume())
                                             : kEmptyCellRadius * mean_radius * turned.scale();
    const Eigen::Vector3d x = turned.turn_back({sites[k].x, sites[k].y, sites[k].z});
    result.effective[k] = {static_cast<float>(x.x()), static_cast<float>(x.y()),
                           static_cast<float>(x.z()), static_cast<float>(radius)};
  }
  std::vector<double> out(inner.size());
  arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, out.size(),
                      [&](std::size_t k) { out[k] = protrusion(solid, result.effective[k]); });
  });
  result.protrusion = std::max(0.0, *std::max_element(out.begin(), out.end()));
  report(1);
  return result;
}

}  // namespace ist
