#include "packing/calibrate/turned_solid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/exact_triangle.h"

namespace ist {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A turned copy of the mesh costs memory and time: only for a shadow along x that is smaller than
// this part of the largest, or than that part of the box.
constexpr double kSmallShadow = 0.25;
constexpr double kEmptyBox = 0.02;

/// The surface's area seen along each axis, and its second moments.
struct SurfaceMoments {
  Vector3d shadow = Vector3d::Zero();  // a point counts as often as a line enters the surface there
  Matrix3d covariance = Matrix3d::Zero();
};

struct MomentSums {
  Vector3d shadow = Vector3d::Zero(), first = Vector3d::Zero();
  double area = 0;
  Matrix3d second = Matrix3d::Zero();

  void add(const MomentSums& other) {
    shadow += other.shadow;
    first += other.first;
    area += other.area;
    second += other.second;
  }
};

MomentSums moments_of(const MeshView& mesh, std::uint32_t begin, std::uint32_t end) {
  MomentSums sums;
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
  // In parts of fixed size, added in their order: the same bits for any number of threads.
  constexpr std::uint32_t kPart = 1u << 13;
  std::vector<MomentSums> parts((mesh.triangle_count + kPart - 1) / kPart);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    const auto begin = static_cast<std::uint32_t>(p * kPart);
    parts[p] = moments_of(mesh, begin, std::min(begin + kPart, mesh.triangle_count));
  });
  MomentSums sums;
  for (const MomentSums& part : parts) sums.add(part);
  sums.first /= sums.area;
  SurfaceMoments moments;
  moments.shadow = sums.shadow;
  moments.covariance = sums.second / sums.area - sums.first * sums.first.transpose();
  return moments;
}

/// Rows: the eigenvectors of a symmetric matrix by rising eigenvalue, right-handed. Jacobi's method
/// by + − × ÷ sqrt: the same bits everywhere.
Matrix3d principal_axes(Matrix3d m) {
  Matrix3d axes = Matrix3d::Identity();
  for (int sweep = 0; sweep < 12; ++sweep)
    for (int k = 0; k < 3; ++k) {
      const int p = k, q = (k + 1) % 3;
      // Turns nothing, and the square of theta may be no double.
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

}  // namespace

TurnedSolid::TurnedSolid(const MeshSolid& solid) : original_(solid) {
  const MeshView& view = solid.arrays();
  const SurfaceMoments moments = surface_moments(view);
  const Vector3d size = solid.bounds().sizes() / solid.frame().scale();
  if (moments.shadow.x() >= kSmallShadow * moments.shadow.maxCoeff() &&
      moments.shadow.x() >= kEmptyBox * size.y() * size.z())
    return;
  axes_ = principal_axes(moments.covariance);
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

Vector3d TurnedSolid::turn(const Vector3d& x) const {
  return turned_ ? turned_->frame().to_unit(axes_ * x) : x;
}

Vector3d TurnedSolid::turn_back(const Vector3d& x) const {
  return turned_ ? Vector3d(axes_.transpose() * turned_->frame().from_unit(x)) : x;
}

}  // namespace ist
