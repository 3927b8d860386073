#include "mesh/mesh_moments.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 0x1p-53;

/// Knuth's sum: what each addition loses is kept.
template <int N>
struct CompensatedSum {
  using Values = Eigen::Array<double, N, 1>;
  Values high = Values::Zero(), lost = Values::Zero();

  void add(const Values& term) {
    const Values next = high + term;
    const Values added = next - high;
    lost += (high - (next - added)) + (term - added);
    high = next;
  }
  void add(const CompensatedSum& other) {
    add(other.high);
    add(other.lost);
  }
  Values value() const { return high + lost; }
};

/// Sums of terms, and of their magnitudes, on which rounding depends.
template <int N>
struct Sum {
  CompensatedSum<N> terms;
  double magnitude = 0;
};

Vector3d vertex(const MeshView& mesh, std::size_t t, std::size_t corner) {
  const double* p = mesh.vertices + 3 * std::size_t{mesh.triangles[3 * t + corner]};
  return {p[0], p[1], p[2]};
}

/// A tetrahedron over a triangle, its apex at the origin.
struct Tetrahedron {
  Vector3d a, b, c;   ///< from the apex
  double volume = 0;  ///< signed
  double magnitude = 0;
};

/// Edges are differences of near points, almost exact: so is the volume, however thin.
Tetrahedron tetrahedron(const MeshView& mesh, std::size_t t, const Vector3d& apex) {
  const Vector3d a = vertex(mesh, t, 0), b = vertex(mesh, t, 1), c = vertex(mesh, t, 2);
  const Vector3d u = b - a, v = c - a;
  Tetrahedron result{a - apex, b - apex, c - apex};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double left = u[j] * v[k], right = u[k] * v[j];
    result.volume += result.a[i] * (left - right) / 6;
    result.magnitude += std::abs(result.a[i]) * (std::abs(left) + std::abs(right)) / 6;
  }
  return result;
}

/// Sums visit(tetrahedron, magnitude) over all triangles, in parts of fixed size, each in index
/// order: the same bits for any number of threads.
template <int N, class Visit>
Sum<N> over_triangles(const MeshView& mesh, const Vector3d& apex, const Visit& visit) {
  constexpr std::size_t kPart = 1u << 14;
  std::vector<Sum<N>> parts((mesh.triangle_count + kPart - 1) / kPart);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    const auto end = std::min<std::size_t>((p + 1) * kPart, mesh.triangle_count);
    for (std::size_t t = p * kPart; t < end; ++t)
      parts[p].terms.add(visit(tetrahedron(mesh, t, apex), parts[p].magnitude));
  });
  Sum<N> all;
  for (const Sum<N>& part : parts) {
    all.terms.add(part.terms);
    all.magnitude += part.magnitude;
  }
  return all;
}

/// Volume and first moments.
Sum<4> first_moments(const MeshView& mesh) {
  return over_triangles<4>(mesh, Vector3d::Zero(), [](const Tetrahedron& t, double& magnitude) {
    magnitude += t.magnitude;
    const Vector3d first = t.volume * (t.a + t.b + t.c) / 4;
    return Eigen::Array4d(t.volume, first.x(), first.y(), first.z());
  });
}

/// ∫ of x², y², z², xy, xz, yz about a point.
Sum<6> second_moments(const MeshView& mesh, const Vector3d& about) {
  return over_triangles<6>(mesh, about, [](const Tetrahedron& t, double& magnitude) {
    const Vector3d s = t.a + t.b + t.c;
    magnitude += t.magnitude *
                 (s.squaredNorm() + t.a.squaredNorm() + t.b.squaredNorm() + t.c.squaredNorm()) / 20;
    const auto second = [&](int i, int j) {
      return t.volume * (s[i] * s[j] + (t.a[i] * t.a[j] + t.b[i] * t.b[j] + t.c[i] * t.c[j])) / 20;
    };
    Eigen::Array<double, 6, 1> values;
    values << second(0, 0), second(1, 1), second(2, 2), second(0, 1), second(0, 2), second(1, 2);
    return values;
  });
}

Eigen::Matrix3d symmetric(const Eigen::Array<double, 6, 1>& m) {
  Eigen::Matrix3d result;
  result << m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2];
  return result;
}

/// Largest distance from a point to one of the mesh, squared.
double squared_reach(const MeshView& mesh, const Vector3d& from) {
  double most = 0;
  for (std::uint32_t v = 0; v < mesh.vertex_count; ++v) {
    const double* p = mesh.vertices + 3 * std::size_t{v};
    most = std::max(most, (Vector3d(p[0], p[1], p[2]) - from).squaredNorm());
  }
  return most;
}

/// Bound on the volume of what lies within `distance` of the surface: by Steiner's formula for each
/// triangle.
double slab_volume(const MeshView& mesh, double distance) {
  constexpr double kPi = std::numbers::pi;
  const double e = distance;
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const Vector3d a = vertex(mesh, t, 0), b = vertex(mesh, t, 1), c = vertex(mesh, t, 2);
    const double area = (b - a).cross(c - a).norm() / 2;
    const double rim = (b - a).norm() + (c - b).norm() + (a - c).norm();
    sum += 2 * e * area + kPi / 2 * e * e * rim + 4 * kPi / 3 * e * e * e;
  }
  return sum;
}

/// What the mesh encloses less an excess.
MeshMoments less(const MeshView& mesh, const WindingExcess& excess) {
  const Sum<4> enclosed = first_moments(mesh);
  const Eigen::Array4d sums = enclosed.terms.value() - excess.value.head<4>();
  MeshMoments result;
  result.volume = sums[0];
  result.volume_error = 8 * kRounding * enclosed.magnitude + excess.error[0] + excess.hidden;
  if (!(result.volume > 0)) return result;
  result.centre = sums.tail<3>().matrix() / result.volume;
  // All coordinates are within ±1.
  const double first_error =
      16 * kRounding * enclosed.magnitude + excess.error.segment<3>(1).maxCoeff() + excess.hidden;
  result.centre_error = (first_error + result.volume_error) / result.volume + 2 * kRounding;

  const Vector3d& c = result.centre;
  const Sum<6> about_centre = second_moments(mesh, c);
  const Vector3d first = excess.value.segment<3>(1).matrix();
  const Eigen::Matrix3d excess_about_centre = symmetric(excess.value.tail<6>()) -
                                              c * first.transpose() - first * c.transpose() +
                                              excess.value[0] * (c * c.transpose());
  const Eigen::Matrix3d second = symmetric(about_centre.terms.value()) - excess_about_centre;
  result.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  double second_error = 32 * kRounding * about_centre.magnitude +
                        excess.error.tail<6>().maxCoeff() +
                        2 * excess.error.segment<3>(1).maxCoeff() + excess.error[0] +
                        result.volume * result.centre_error * result.centre_error;
  if (excess.hidden > 0) second_error += excess.hidden * squared_reach(mesh, c);
  result.inertia_error = 2 * second_error;
  return result;
}

}  // namespace

MeshMoments enclosed_moments(const MeshView& mesh) { return less(mesh, {}); }

MeshMoments winding_set_moments(const MeshView& mesh, bool meets_itself,
                                const HierarchyMaker& hierarchy) {
  WindingExcess excess = winding_excess(mesh, hierarchy);
  if (!meets_itself) excess.hidden = 0;
  return less(mesh, excess);
}

MeshMoments moments_near(const MeshView& mesh, MeshMoments moments, double distance) {
  // What is added or missing lies in the slab and no further than the reach.
  const double slab = slab_volume(mesh, distance);
  const double reach = std::sqrt(squared_reach(mesh, moments.centre)) + distance;
  // No less than this is the solid's volume; where nothing is left, its centre may be anywhere.
  const double sure = moments.volume - moments.volume_error - slab;
  moments.centre_error =
      sure > 0 ? std::min(reach, moments.centre_error + slab * reach / sure) : reach;
  moments.inertia_error += 2 * slab * reach * reach;  // once about this centre, once for its error
  return moments;
}

}  // namespace ist
