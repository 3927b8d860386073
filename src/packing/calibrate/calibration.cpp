#include "packing/calibrate/calibration.h"

#include <functional>
#include <memory>
#include <numeric>
#include <utility>

#include <ist/error.h>

#include "packing/calibrate/column_lattice.h"
#include "packing/calibrate/power_relaxation.h"
#include "packing/calibrate/turned_solid.h"
#include "stage/stage.h"

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

/// Calibrates prefixes of a packing; holds what is made of the solid for all of them.
class Calibrator {
 public:
  Calibrator(const MeshSolid& solid, SolidBackend& backend)
      : solid_(solid), turned_(solid), backend_(backend) {
    // The cells are found in the frame of the turned solid.
    if (&turned_.solid() != &solid) turned_backend_ = backend.with(turned_.solid());
  }

  Calibration run(std::span<const Sphere> inner, const std::function<void(double)>& report) {
    const double volume = turned_.solid().unit_volume();
    const double mean_radius = radius_of(volume / static_cast<double>(inner.size()));
    std::vector<PowerSite> sites;
    for (const Sphere& s : inner) {
      const Eigen::Vector3d x = turned_.turn({s.x, s.y, s.z});
      const double radius = s.r / turned_.scale();
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
    result.matched.resize(inner.size());
    for (std::size_t k = 0; k < sites.size(); ++k) {
      const double radius = shares[k] > 0 ? radius_of(shares[k] * solid_.unit_volume())
                                          : kEmptyCellRadius * mean_radius * turned_.scale();
      const Eigen::Vector3d x = turned_.turn_back({sites[k].x, sites[k].y, sites[k].z});
      result.matched[k] = {static_cast<float>(x.x()), static_cast<float>(x.y()),
                           static_cast<float>(x.z()), static_cast<float>(radius)};
    }
    result.protrusion = backend_.largest_protrusion(result.matched);
    return result;
  }

 private:
  RelaxedSites relax(const std::vector<PowerSite>& sites, double mean_radius, double volume,
                     const std::function<void(double)>& report) {
    RelaxTask task;
    task.columns =
        plan_columns(turned_.solid(), kStep * mean_radius, kMinColumns,
                     kMinColumns + kColumnsPerSphere * static_cast<double>(sites.size()));
    task.sites = sites;
    task.volume = volume;
    return (turned_backend_ ? *turned_backend_ : backend_).relax_sites(task, report);
  }

  const MeshSolid& solid_;
  const TurnedSolid turned_;
  SolidBackend& backend_;
  std::unique_ptr<SolidBackend> turned_backend_;  ///< null where the solid is not turned
};

}  // namespace

void calibrate_prefixes(const MeshSolid& solid, SolidBackend& backend,
                        std::span<const Sphere> inner, std::span<const std::size_t> counts,
                        const ProgressCallback& progress,
                        const std::function<void(std::size_t, Calibration)>& take) {
  if (inner.empty()) throw Error("calibrate: no inner spheres");
  Stage stage("calibrate", progress);
  stage.step(inner.size(), 0);
  Calibrator calibrator(solid, backend);
  const double total =
      static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::size_t{0}));
  double done = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double part = static_cast<double>(counts[i]) / total;
    take(i, calibrator.run(inner.first(counts[i]), [&](double of_part) {
      stage.step(inner.size(), 0.2 + 0.8 * (done + part * of_part));
    }));
    done += part;
  }
  stage.step(inner.size(), 1);
}

Calibration calibrate(const MeshSolid& solid, SolidBackend& backend, std::span<const Sphere> inner,
                      const ProgressCallback& progress) {
  const std::size_t all = inner.size();
  Calibration result;
  calibrate_prefixes(solid, backend, inner, {&all, 1}, progress,
                     [&](std::size_t, Calibration made) { result = std::move(made); });
  return result;
}

}  // namespace ist
