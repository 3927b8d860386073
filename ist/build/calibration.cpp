#include "build/calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include <ist/error.h>

#include "build/column_lattice.h"
#include "build/power_cells.h"
#include "build/protrusion.h"
#include "build/turned_solid.h"
#include "mesh_on_gpu.h"
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

/// How far any of the balls sticks out of the solid at most, at least 0.
double largest_protrusion(const MeshSolid& solid, std::span<const Sphere4> balls) {
  std::vector<double> out(balls.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t k) {
    const Eigen::Vector3d centre(balls[k].x, balls[k].y, balls[k].z);
    out[k] = protrusion_of(balls[k].r, solid.closest_point(centre).distance, solid.inside(centre));
  });
  return std::max(0.0, *std::max_element(out.begin(), out.end()));
}

}  // namespace

Calibration calibrate(const MeshSolid& solid, std::span<const Sphere> inner, unsigned threads,
                      const ProgressCallback& progress, gpu::MeshOnGpu* gpu) {
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
  std::optional<TurnedSolid> turned_solid;
  arena.execute([&] { turned_solid.emplace(solid); });
  const TurnedSolid& turned = *turned_solid;
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
  const auto report_round = [&](double part) { report(0.2 + 0.8 * part); };
  if (gpu != nullptr) {
    std::unique_ptr<gpu::MeshOnGpu> turned_gpu;
    if (&turned.solid() != &solid)
      turned_gpu = std::make_unique<gpu::MeshOnGpu>(turned.solid(), gpu->settings());
    relaxed = (turned_gpu ? *turned_gpu : *gpu).relax_sites(plan, sites, volume, report_round);
  } else {
    arena.execute(
        [&] { relaxed = relax_sites(turned.solid(), plan, sites, volume, report_round); });
  }
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
  if (gpu != nullptr) {
    result.protrusion = gpu->largest_protrusion(result.effective);
  } else {
    arena.execute([&] { result.protrusion = largest_protrusion(solid, result.effective); });
  }
  report(1);
  return result;
}

}  // namespace ist
