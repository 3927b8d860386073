#include "build/calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include <ist/error.h>

#include "build/column_lattice.h"
#include "build/power_cells.h"
#include "build/protrusion.h"
#include "build/turned_solid.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

constexpr double kStep = 0.15;  // distance of columns over the mean leaf radius
// Enough columns to measure the solid where spheres are few, and a bound where it is thin.
constexpr double kMinColumns = 1u << 14;
constexpr double kColumnsPerSphere = 64;
// Radius of a sphere whose cell is empty, over the mean leaf radius: legal, and counts for nothing.
constexpr double kEmptyCellRadius = 1e-4;

/// Shares by the inner spheres' own volumes, for a solid that columns cannot measure.
std::vector<double> inflated_shares(std::span<const Sphere> inner) {
  std::vector<double> shares;
  double sum = 0;
  for (const Sphere& s : inner) {
    shares.push_back(double{s.r} * s.r * s.r);
    sum += shares.back();
  }
  for (double& share : shares) share /= sum;
  return shares;
}

/// Relaxes the sites on the caller's threads.
RelaxedSites relax_sites(const MeshSolid& solid, const ColumnPlan& plan,
                         std::vector<PowerSite> sites, double volume,
                         const std::function<void(double)>& report) {
  const ColumnLattice lattice = cut_columns(solid, plan);
  if (!columns_measure(lattice.volume(), volume)) return {};
  const PowerOctree octree(lattice);
  std::vector<double> shares(sites.size());
  for (int round = 0; round < kRelaxations; ++round) {
    report(static_cast<double>(round) / kRelaxations);
    const std::vector<PowerSums> sums = octree.cell_sums(sites);
    std::int64_t total = 0;
    for (const PowerSums& sum : sums) total += sum.length;
    for (std::size_t k = 0; k < sites.size(); ++k) {
      shares[k] = share_of(sums[k], total);
      relax(sites[k], sums[k], total, volume);
    }
  }
  return {std::move(sites), std::move(shares)};
}

/// Distance by which a ball sticks out of the solid at most.
double protrusion(const MeshSolid& solid, const Sphere4& ball) {
  const Eigen::Vector3d centre(ball.x, ball.y, ball.z);
  return protrusion_of(ball.r, solid.closest_point(centre).distance, solid.inside(centre));
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
  ColumnPlan plan;
  arena.execute([&] {
    plan = plan_columns(turned.solid(), kStep * mean_radius, kMinColumns,
                        kMinColumns + kColumnsPerSphere * static_cast<double>(inner.size()));
  });
  RelaxedSites relaxed;
  arena.execute([&] {
    relaxed = relax_sites(turned.solid(), plan, sites, volume,
                          [&](double part) { report(0.2 + 0.8 * part); });
  });
  std::vector<double> shares = std::move(relaxed.shares);
  if (shares.empty()) {
    shares = inflated_shares(inner);
  } else {
    sites = std::move(relaxed.sites);
  }

  Calibration result;
  result.effective.resize(inner.size());
  for (std::size_t k = 0; k < sites.size(); ++k) {
    const double radius = shares[k] > 0 ? radius_of(shares[k] * solid.unit_volume())
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
