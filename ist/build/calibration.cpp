#include "build/calibration.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
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

/// Calibrates prefixes of a packing; holds what is made of the solid for all of them.
class Calibrator {
 public:
  Calibrator(const MeshSolid& solid, unsigned threads, gpu::MeshOnGpu* gpu)
      : solid_(solid), arena_(thread_arena(threads)), gpu_(gpu), turned_gpu_(gpu) {
    // The cells are found in the frame of the turned solid.
    arena_.execute([&] { turned_.emplace(solid); });
    if (gpu == nullptr || &turned_->solid() == &solid) return;
    own_gpu_ = std::make_unique<gpu::MeshOnGpu>(turned_->solid(), gpu->settings());
    turned_gpu_ = own_gpu_.get();
  }

  Calibration run(std::span<const Sphere> inner, const std::function<void(double)>& report) {
    const double volume = turned_->solid().unit_volume();
    const double mean_radius = radius_of(volume / static_cast<double>(inner.size()));
    std::vector<PowerSite> sites;
    for (const Sphere& s : inner) {
      const Eigen::Vector3d x = turned_->turn({s.x, s.y, s.z});
      const double radius = s.r / turned_->scale();
      sites.push_back({x.x(), x.y(), x.z(), radius * radius});
    }
    RelaxedSites relaxed = relax(sites, mean_radius, volume, report);
    std::vector<double> shares = std::move(relaxed.shares);
    if (shares.empty()) {
      shares = inflated_shares(inner);
    } else {
      sites = std::move(relaxed.sites);
    }

    Calibration result;
    result.effective.resize(inner.size());
    for (std::size_t k = 0; k < sites.size(); ++k) {
      const double radius = shares[k] > 0 ? radius_of(shares[k] * solid_.unit_volume())
                                          : kEmptyCellRadius * mean_radius * turned_->scale();
      const Eigen::Vector3d x = turned_->turn_back({sites[k].x, sites[k].y, sites[k].z});
      result.effective[k] = {static_cast<float>(x.x()), static_cast<float>(x.y()),
                             static_cast<float>(x.z()), static_cast<float>(radius)};
    }
    if (gpu_ != nullptr) {
      result.protrusion = gpu_->largest_protrusion(result.effective);
    } else {
      arena_.execute([&] { result.protrusion = largest_protrusion(solid_, result.effective); });
    }
    return result;
  }

 private:
  RelaxedSites relax(const std::vector<PowerSite>& sites, double mean_radius, double volume,
                     const std::function<void(double)>& report) {
    ColumnPlan plan;
    arena_.execute([&] {
      plan = plan_columns(turned_->solid(), kStep * mean_radius, kMinColumns,
                          kMinColumns + kColumnsPerSphere * static_cast<double>(sites.size()));
    });
    if (gpu_ != nullptr) return turned_gpu_->relax_sites(plan, sites, volume, report);
    RelaxedSites relaxed;
    arena_.execute([&] { relaxed = relax_sites(turned_->solid(), plan, sites, volume, report); });
    return relaxed;
  }

  const MeshSolid& solid_;
  tbb::task_arena arena_;
  gpu::MeshOnGpu* const gpu_;
  std::optional<TurnedSolid> turned_;
  std::unique_ptr<gpu::MeshOnGpu> own_gpu_;  ///< null where the solid is not turned
  gpu::MeshOnGpu* turned_gpu_;
};

}  // namespace

std::vector<Calibration> calibrate_prefixes(const MeshSolid& solid, std::span<const Sphere> inner,
                                            std::span<const std::size_t> counts, unsigned threads,
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
  report(0);
  Calibrator calibrator(solid, threads, gpu);
  const double total =
      static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::size_t{0}));
  double done = 0;
  std::vector<Calibration> results;
  for (const std::size_t count : counts) {
    const double part = static_cast<double>(count) / total;
    results.push_back(calibrator.run(
        inner.first(count), [&](double of_part) { report(0.2 + 0.8 * (done + part * of_part)); }));
    done += part;
  }
  report(1);
  return results;
}

Calibration calibrate(const MeshSolid& solid, std::span<const Sphere> inner, unsigned threads,
                      const ProgressCallback& progress, gpu::MeshOnGpu* gpu) {
  const std::size_t all = inner.size();
  return calibrate_prefixes(solid, inner, {&all, 1}, threads, progress, gpu).front();
}

}  // namespace ist
