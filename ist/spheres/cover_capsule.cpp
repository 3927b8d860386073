#include <ist/cover_spheres.h>
#include <ist/error.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace ist {
namespace {

using Eigen::Vector3d;

double volume_of(double radius, double length) {
  return std::numbers::pi * radius * radius * (length + 4 * radius / 3);
}

/// A line through the solid's middle, and how much wider than needed the capsule around it is.
using Axis = std::array<double, 5>;  ///< turns of the start axis about two others, offsets along
                                     ///< these, share by which the radius grows

/// The shortest capsule of that axis that holds all points.
class Fit {
 public:
  Fit(std::span<const Vector3d> points, const Vector3d& middle, double size,
      const Eigen::Matrix3d& start)
      : points_(points), middle_(middle), size_(size), start_(start) {}

  CoverCapsule at(const Axis& x) const {
    const Vector3d along =
        (start_.col(0) + x[0] * start_.col(1) + x[1] * start_.col(2)).normalized();
    const Vector3d from = middle_ + size_ * (x[2] * start_.col(1) + x[3] * start_.col(2));
    double most = 0;
    for (const Vector3d& p : points_) most = std::max(most, beside(p - from, along));
    const double square = most * (1 + x[4] * x[4]) * (1 + x[4] * x[4]);
    double low = std::numeric_limits<double>::infinity(), high = -low;  // of the segment's ends
    for (const Vector3d& p : points_) {
      const double t = (p - from).dot(along);
      const double half = std::sqrt(std::max(0.0, square - beside(p - from, along)));
      low = std::min(low, t + half);
      high = std::max(high, t - half);
    }
    if (low > high) low = high = (low + high) / 2;
    return {from + low * along, from + high * along, std::sqrt(square)};
  }
  double volume(const Axis& x) const {
    const CoverCapsule c = at(x);
    return volume_of(c.radius, (c.end - c.begin).norm());
  }

 private:
  static double beside(const Vector3d& d, const Vector3d& along) {
    return (d - d.dot(along) * along).squaredNorm();
  }

  const std::span<const Vector3d> points_;
  const Vector3d middle_;
  const double size_;
  const Eigen::Matrix3d start_;
};

/// Steps along each number as long as that helps, then shorter ones.
Axis improved(const Fit& fit) {
  Axis best = {0, 0, 0, 0, 0};
  double least = fit.volume(best);
  for (double step = 0.25; step > 1e-5; step /= 2) {
    for (bool better = true; better;) {
      better = false;
      for (std::size_t k = 0; k < best.size(); ++k)
        for (const double sign : {-1.0, 1.0}) {
          Axis tried = best;
          tried[k] += sign * step;
          const double volume = fit.volume(tried);
          if (!(volume < least * (1 - 1e-9))) continue;
          best = tried;
          least = volume;
          better = true;
        }
    }
  }
  return best;
}

}  // namespace

CoverCapsule cover_with_capsule(const ClosedMesh& mesh) {
  std::vector<bool> used(mesh.mesh.vertices.size());
  for (const auto& t : mesh.mesh.triangles)
    for (const std::uint32_t v : t) used[v] = true;
  std::vector<Vector3d> points;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) points.push_back(mesh.mesh.vertices[v]);
  if (points.empty()) throw Error(mesh.name + ": no triangles");
  Eigen::AlignedBox3d box;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) {
    box.extend(p);
    mean += p / static_cast<double>(points.size());
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const double size = box.diagonal().norm() / 2;
  const Eigen::Matrix3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  CoverCapsule best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& axes : {principal, Eigen::Matrix3d(Eigen::Matrix3d::Identity())})
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d start;
      start << axes.col(k), axes.col((k + 1) % 3), axes.col((k + 2) % 3);
      const Fit fit(points, box.center(), size, start);
      const CoverCapsule found = fit.at(improved(fit));
      const double volume = volume_of(found.radius, (found.end - found.begin).norm());
      if (!(volume < least)) continue;
      best = found;
      least = volume;
    }
  // A capsule is convex: it holds the solid if it holds the vertices. What rounding may hide is a
  // millionth part of the margin.
  double most = 0;
  const Vector3d along = best.end - best.begin;
  for (const Vector3d& p : points) {
    const double t = along.isZero()
                         ? 0
                         : std::clamp((p - best.begin).dot(along) / along.squaredNorm(), 0.0, 1.0);
    most = std::max(most, (p - best.begin - t * along).norm());
  }
  best.radius = most + 1e-10 * (most + box.center().norm() + size);
  return best;
}

}  // namespace ist
