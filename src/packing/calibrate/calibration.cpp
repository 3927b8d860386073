#include "packing/calibrate/calibration.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "base/stage.h"
#include "mesh/geometry/exact_triangle.h"
#include "packing/calibrate/column_lattice.h"
#include "packing/calibrate/power_relaxation.h"

namespace ist {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A rotated copy of the mesh costs memory and time. It is made only for a shadow along x that is
// smaller than this part of the largest shadow, or of the box.
constexpr double kSmallShadow = 0.25;
constexpr double kEmptyBox = 0.02;

/// The surface's area, its projections along each axis, and its moments.
struct SurfaceMoments {
  Vector3d shadow = Vector3d::Zero();  // a point counts as often as a line enters the surface there
  Vector3d first = Vector3d::Zero();
  double area = 0;
  Matrix3d second = Matrix3d::Zero();

  void add(const SurfaceMoments& other) {
    shadow += other.shadow;
    first += other.first;
    area += other.area;
    second += other.second;
  }
};

SurfaceMoments moments_of(const MeshView& mesh, std::uint32_t begin, std::uint32_t end) {
  SurfaceMoments sums;
  for (std::uint32_t t = begin; t < end; ++t) {
    const Corners corners = corners_of(mesh, t);
    const Vector3d p[3] = {Vector3d(corners.p[0]), Vector3d(corners.p[1]), Vector3d(corners.p[2])};
    const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const double area = 0.5 * normal.norm();
    const Vector3d sum = p[0] + p[1] + p[2];
    sums.shadow += 0.25 * normal.cwiseAbs();  // half the parallelogram, half of it entered
    sums.area += area;
    sums.first += area / 3 * sum;
    sums.second += area / 12 * (sum * sum.transpose());
    for (const Vector3d& x : p) sums.second += area / 12 * (x * x.transpose());
  }
  return sums;
}

SurfaceMoments surface_moments(const MeshView& mesh) {
  // Summed in parts of fixed size, in order: the same bits for any number of threads.
  constexpr std::uint32_t kPart = 1u << 13;
  std::vector<SurfaceMoments> parts((mesh.triangle_count + kPart - 1) / kPart);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    const auto begin = static_cast<std::uint32_t>(p * kPart);
    parts[p] = moments_of(mesh, begin, std::min(begin + kPart, mesh.triangle_count));
  });
  SurfaceMoments sums;
  for (const SurfaceMoments& part : parts) sums.add(part);
  return sums;
}

/// Rows: the eigenvectors of a symmetric matrix by rising eigenvalue, right-handed. Jacobi's method
/// with + − × ÷ sqrt: the same bits everywhere.
Matrix3d principal_axes(Matrix3d m) {
  Matrix3d axes = Matrix3d::Identity();
  for (int sweep = 0; sweep < 12; ++sweep)
    for (int k = 0; k < 3; ++k) {
      const int p = k, q = (k + 1) % 3;
      // The rotation is negligible, and the square of theta may overflow.
      if (std::abs(m(p, q)) <= 1e-150 * std::abs(m(q, q) - m(p, p))) continue;
      const double theta = (m(q, q) - m(p, p)) / (2 * m(p, q));
      const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
      const double c = 1 / std::sqrt(t * t + 1), s = t * c;
      Matrix3d rotation = Matrix3d::Identity();
      rotation(p, p) = rotation(q, q) = c;
      rotation(p, q) = -s;
      rotation(q, p) = s;
      m = rotation * m * rotation.transpose();
      axes = rotation * axes;
    }
  int order[3] = {0, 1, 2};
  std::sort(order, order + 3, [&](int a, int b) { return m(a, a) < m(b, b); });
  Matrix3d sorted;
  sorted.row(0) = axes.row(order[0]);
  sorted.row(1) = axes.row(order[1]);
  sorted.row(2) = sorted.row(0).cross(sorted.row(1));
  return sorted;
}

/// A solid rotated so that lines along x intersect it well. A thin plate is measured exactly by
/// lines that pierce it and badly by lines along it, a needle by none if it is slanted in its box.
/// So if few lines of the box along x meet the solid, it is rotated: x is then the principal axis
/// along which its surface extends least, z the one along which it extends most.
class TurnedSolid {
 public:
  explicit TurnedSolid(const MeshSolid& solid) : original_(solid) {
    const MeshView& view = solid.arrays();
    const SurfaceMoments moments = surface_moments(view);
    const Vector3d size = solid.bounds().sizes() / solid.frame().scale();
    if (moments.shadow.x() >= kSmallShadow * moments.shadow.maxCoeff() &&
        moments.shadow.x() >= kEmptyBox * size.y() * size.z())
      return;
    const Vector3d mean = moments.first / moments.area;
    axes_ = principal_axes(moments.second / moments.area - mean * mean.transpose());
    ClosedMesh mesh;
    mesh.name = "turned mesh";
    mesh.report.closed = true;
    for (std::size_t v = 0; v < view.vertex_count; ++v)
      mesh.mesh.vertices.push_back(axes_ * Vector3d(view.vertices + 3 * v));
    for (std::size_t t = 0; t < view.triangle_count; ++t) {
      const std::uint32_t* corner = view.triangles + 3 * t;
      mesh.mesh.triangles.push_back({corner[0], corner[1], corner[2]});
    }
    turned_ = std::make_unique<MeshSolid>(mesh);
  }

  const MeshSolid& solid() const { return turned_ ? *turned_ : original_; }
  /// Length of solid()'s unit in the original's unit frame.
  double scale() const { return turned_ ? turned_->frame().scale() : 1; }
  /// From the unit frame of the original to that of solid(), and back.
  Vector3d turn(const Vector3d& x) const {
    return turned_ ? turned_->frame().to_unit(axes_ * x) : x;
  }

  Vector3d turn_back(const Vector3d& x) const {
    return turned_ ? Vector3d(axes_.transpose() * turned_->frame().from_unit(x)) : x;
  }

 private:
  const MeshSolid& original_;
  std::unique_ptr<MeshSolid> turned_;                   // null: the original is used
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  // rows
};

constexpr double kStep = 0.15;  // distance of columns over the mean leaf radius
// Enough columns to measure the solid with few spheres, and a bound if it is thin.
constexpr double kMinColumns = 1u << 14;
constexpr double kColumnsPerSphere = 64;
// Radius of a sphere with an empty cell, over the mean leaf radius: valid, but negligible.
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

/// Calibrates prefixes of a packing; keeps the solid's data that all of them use.
class Calibrator {
 public:
  Calibrator(const MeshSolid& solid, SolidBackend& backend)
      : solid_(solid), turned_(solid), backend_(backend) {
    // The cells are computed in the frame of the rotated solid.
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
  std::unique_ptr<SolidBackend> turned_backend_;  ///< null if the solid is not rotated
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

}  // namespace ist
