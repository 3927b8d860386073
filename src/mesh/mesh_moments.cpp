#include "mesh/mesh_moments.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "mesh/hierarchy/line_lattice.h"
#include "mesh/hierarchy/winding.h"

namespace ist {
namespace {

constexpr std::size_t kIntervals = 200;  ///< along y and along z before any is halved
constexpr int kMaxHalvings = 30;
constexpr double kTolerance = 1e-7;  ///< of an interval, relative to the bounding box

template <int N>
using Values = Eigen::Array<double, N, 1>;

/// Integrals, starting with the volume.
template <int N>
struct Measured {
  Values<N> value = Values<N>::Zero(), error = Values<N>::Zero();

  void add(const Measured& part) {
    value += part.value;
    error += part.error;
  }
};

/// Adaptive integral of f over [a, b], given its values at both ends and in the middle. It halves
/// intervals where the volume's integrand is not linear, so a step is found like a root.
template <int N, class Function>
Measured<N> integrate(const Function& f, double a, double b, const Values<N>& at_a,
                      const Values<N>& at_middle, const Values<N>& at_b, double tolerance,
                      int halvings) {
  const Values<N> bend = (at_middle - (at_a + at_b) / 2).abs() * (b - a);
  if (bend[0] <= tolerance || halvings == 0)
    return {(at_a + at_b + 4 * at_middle) / 6 * (b - a), bend};
  const double middle = (a + b) / 2;
  Measured<N> sum =
      integrate<N>(f, a, middle, at_a, f((a + middle) / 2), at_middle, tolerance, halvings - 1);
  sum.add(
      integrate<N>(f, middle, b, at_middle, f((middle + b) / 2), at_b, tolerance, halvings - 1));
  return sum;
}

/// ∫ (winding − [winding ≥ 1]) · (1, x, x²) dx along the line (·, y, z).
Values<3> line_excess(std::span<const Crossing> crossings) {
  Values<3> excess = Values<3>::Zero();
  int winding = 0;
  for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
    winding += crossings[i].sign;
    const int counted_twice = winding - (winding >= 1 ? 1 : 0);
    if (counted_twice == 0) continue;
    const double a = crossings[i].x, b = crossings[i + 1].x;
    const double length = counted_twice * (b - a);
    excess += Values<3>(length, length * (a + b) / 2, length * (a * a + a * b + b * b) / 3);
  }
  return excess;
}

/// The integrands 1, x, x², y, y², xy from those of a line.
Values<6> along_y(const Values<3>& line, double y) {
  Values<6> values;
  values << line[0], line[1], line[2], y * line[0], y * y * line[0], y * line[1];
  return values;
}

/// The integrands of the ten moments from those of a plane.
Moments along_z(const Values<6>& plane, double z) {
  Moments values;
  values << plane[0], plane[1], plane[3], z * plane[0], plane[2], plane[4], z * z * plane[0],
      plane[5], z * plane[1], z * plane[3];
  return values;
}

Eigen::AlignedBox3d box_of(const MeshView& mesh) {
  const Eigen::Map<const Eigen::Matrix3Xd> points(mesh.vertices, 3, mesh.vertex_count);
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff()};
}

/// Integrals of the excess: along x exactly, along y and z adaptively. The initial lines are
/// intersected together; the hierarchy is needed only where they find an excess.
class ExcessIntegral {
 public:
  ExcessIntegral(const MeshView& arrays, const HierarchyMaker& hierarchy)
      : hierarchy_(hierarchy), box_(box_of(arrays)) {
    lattice_.y0 = box_.min()[1];
    lattice_.z0 = box_.min()[2];
    lattice_.step_y = size(1) / double(2 * kIntervals);
    lattice_.step_z = size(2) / double(2 * kIntervals);
    lattice_.ny = lattice_.nz = 2 * kIntervals + 1;
    const bool flat = !(lattice_.step_y > 0 && lattice_.step_z > 0);
    if (flat) return;
    at_line_.resize(lattice_.lines());
    cross_lattice(arrays, lattice_, [&](std::uint32_t row, const LatticeCrossings& lines) {
      tbb::parallel_for(std::size_t{0}, lines.size(), [&](std::size_t line) {
        at_line_[std::size_t{row} * lattice_.ny + line] = line_excess(lines[line]);
      });
    });
  }

  double plane() const { return size(1) * size(2); }

  Measured<10> value() const {
    if (at_line_.empty()) return {};
    std::vector<Measured<10>> slices(lattice_.nz);
    tbb::parallel_for(std::uint32_t{0}, lattice_.nz,
                      [&](std::uint32_t j) { slices[j] = lattice_slice(j); });
    std::vector<Measured<10>> parts(kIntervals);
    tbb::parallel_for(std::size_t{0}, kIntervals, [&](std::size_t i) {
      const Measured<10>&lower = slices[2 * i], &middle = slices[2 * i + 1],
            &upper = slices[2 * i + 2];
      Moments slice_error = lower.error.max(middle.error).max(upper.error);
      const auto area = [&](double z) {
        const Measured<10> s = free_slice(z);
        slice_error = slice_error.max(s.error);
        return s.value;
      };
      const auto j = static_cast<std::uint32_t>(2 * i);
      parts[i] = integrate<10>(area, lattice_.z(j), lattice_.z(j + 2), lower.value, middle.value,
                               upper.value, kTolerance * size(0) * plane(), kMaxHalvings);
      parts[i].error += slice_error * 2 * lattice_.step_z;
    });
    Measured<10> sum;
    for (const Measured<10>& part : parts) sum.add(part);
    return sum;
  }

 private:
  double size(int axis) const { return box_.sizes()[axis]; }

  Values<3> excess_at(double y, double z, std::vector<Crossing>& scratch) const {
    line_crossings(hierarchy_(), y, z, scratch);
    return line_excess(scratch);
  }

  /// The excess of the plane (·, ·, z), areas, from its values at the lattice's lines.
  template <class Known>
  Measured<10> slice(double z, const Known& known) const {
    std::vector<Crossing> scratch;
    const auto excess = [&](double y) { return along_y(excess_at(y, z, scratch), y); };
    const auto at = [&](std::uint32_t i) { return along_y(known(i), lattice_.y(i, 0)); };
    Measured<6> sum;
    for (std::uint32_t i = 0; i + 2 < lattice_.ny; i += 2)
      sum.add(integrate<6>(excess, lattice_.y(i, 0), lattice_.y(i + 2, 0), at(i), at(i + 1),
                           at(i + 2), kTolerance * size(0) * size(1), kMaxHalvings));
    return {along_z(sum.value, z), along_z(sum.error, std::abs(z))};
  }

  Measured<10> lattice_slice(std::uint32_t j) const {
    return slice(lattice_.z(j),
                 [&](std::uint32_t i) { return at_line_[std::size_t{j} * lattice_.ny + i]; });
  }

  Measured<10> free_slice(double z) const {
    std::vector<Crossing> scratch;
    std::vector<Values<3>> at(lattice_.ny);
    for (std::uint32_t i = 0; i < lattice_.ny; ++i) at[i] = excess_at(lattice_.y(i, 0), z, scratch);
    return slice(z, [&](std::uint32_t i) { return at[i]; });
  }

  const HierarchyMaker& hierarchy_;
  Eigen::AlignedBox3d box_;
  LineLattice lattice_;
  std::vector<Values<3>> at_line_;  // the excess of every line
};

/// The largest extent of a triangle along x.
double longest_triangle(const MeshView& mesh) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::uint32_t>(0, mesh.triangle_count), 0.0,
      [&](const tbb::blocked_range<std::uint32_t>& range, double longest) {
        for (std::uint32_t t = range.begin(); t < range.end(); ++t) {
          const Extent x(corners_of(mesh, t));
          longest = std::max(longest, x.high - x.low);
        }
        return longest;
      },
      [](double a, double b) { return std::max(a, b); });
}

using Eigen::Vector3d;

constexpr double kRounding = 0x1p-53;

/// Compensated summation (Knuth): keeps what each addition loses.
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

/// Sums of terms, and of their magnitudes, which determine rounding.
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

/// Edges are differences of near points, almost exact: so is the volume, however thin the
/// tetrahedron.
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

/// The moments that the mesh encloses, minus an excess.
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

WindingExcess winding_excess(const MeshView& mesh, const HierarchyMaker& hierarchy) {
  const ExcessIntegral integral(mesh, hierarchy);
  const Measured<10> sum = integral.value();
  // With a probability of 95 %, folds that n columns missed cover less than 3 / n of the plane. A
  // fold is assumed to be no deeper than the longest triangle.
  constexpr double kColumns = 4.0 * kIntervals * kIntervals;
  return {sum.value, sum.error, 3 / kColumns * integral.plane() * longest_triangle(mesh)};
}

MeshMoments enclosed_moments(const MeshView& mesh) { return less(mesh, {}); }

MeshMoments winding_set_moments(const MeshView& mesh, bool meets_itself,
                                const HierarchyMaker& hierarchy) {
  WindingExcess excess = winding_excess(mesh, hierarchy);
  if (!meets_itself) excess.hidden = 0;
  return less(mesh, excess);
}

MeshMoments moments_near(const MeshView& mesh, MeshMoments moments, double distance) {
  // The added or missing volume lies in the slab and no further than the reach.
  const double slab = slab_volume(mesh, distance);
  const double reach = std::sqrt(squared_reach(mesh, moments.centre)) + distance;
  // The solid's volume is at least this; if it is not positive, the centre may be anywhere.
  const double sure = moments.volume - moments.volume_error - slab;
  moments.centre_error =
      sure > 0 ? std::min(reach, moments.centre_error + slab * reach / sure) : reach;
  moments.inertia_error += 2 * slab * reach * reach;  // once about this centre, once for its error
  return moments;
}

}  // namespace ist
