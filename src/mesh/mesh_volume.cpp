#include "mesh/mesh_volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "mesh/line_lattice.h"
#include "mesh/winding.h"

namespace ist {
namespace {

constexpr std::size_t kIntervals = 200;  ///< along y and along z before any is halved
constexpr int kMaxHalvings = 30;
constexpr double kTolerance = 1e-7;  ///< of an interval, relative to the bounding box

/// Adaptive integral of f over [a, b], whose values at both ends and in the middle are known:
/// halves where f is not linear, so that a step is found like a root.
template <class Function>
MeshVolume integrate(const Function& f, double a, double b, double at_a, double at_middle,
                     double at_b, double tolerance, int halvings) {
  const double bend = std::abs(at_middle - (at_a + at_b) / 2) * (b - a);
  if (bend <= tolerance || halvings == 0)
    return {(at_a + at_b + 4 * at_middle) / 6 * (b - a), bend};
  const double middle = (a + b) / 2;
  const MeshVolume left =
      integrate(f, a, middle, at_a, f((a + middle) / 2), at_middle, tolerance, halvings - 1);
  const MeshVolume right =
      integrate(f, middle, b, at_middle, f((middle + b) / 2), at_b, tolerance, halvings - 1);
  return {left.value + right.value, left.error + right.error};
}

/// ∫ (winding − [winding ≥ 1]) dx along the line (·, y, z).
double line_excess(std::span<const Crossing> crossings) {
  double excess = 0;
  int winding = 0;
  for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
    winding += crossings[i].sign;
    const int counted_twice = winding - (winding >= 1 ? 1 : 0);
    if (counted_twice != 0) excess += counted_twice * (crossings[i + 1].x - crossings[i].x);
  }
  return excess;
}

struct MeshBox {
  double lower[3], upper[3];
};

MeshBox box_of(const MeshView& mesh) {
  const double* p = mesh.vertices;
  MeshBox box = {{p[0], p[1], p[2]}, {p[0], p[1], p[2]}};
  for (const double* end = p + 3 * std::size_t{mesh.vertex_count}; p != end; p += 3)
    for (int k = 0; k < 3; ++k) {
      box.lower[k] = std::min(box.lower[k], p[k]);
      box.upper[k] = std::max(box.upper[k], p[k]);
    }
  return box;
}

/// Integrals of the excess: along x exactly, along y and z adaptively. The lines that are looked at
/// in any case are drawn in one go; only where they find an excess is the hierarchy asked for more.
class ExcessIntegral {
 public:
  ExcessIntegral(const MeshView& arrays, const HierarchyMaker& hierarchy)
      : hierarchy_(hierarchy), box_(box_of(arrays)) {
    lattice_.y0 = box_.lower[1];
    lattice_.z0 = box_.lower[2];
    lattice_.step_y = size(1) / double(2 * kIntervals);
    lattice_.step_z = size(2) / double(2 * kIntervals);
    lattice_.ny = lattice_.nz = 2 * kIntervals + 1;
    const bool flat = !(lattice_.step_y > 0 && lattice_.step_z > 0);
    if (flat) return;
    const LatticeCrossings lines = cross_lattice(arrays, lattice_);
    at_line_.resize(lattice_.lines());
    tbb::parallel_for(std::size_t{0}, at_line_.size(), [&](std::size_t line) {
      at_line_[line] =
          line_excess(std::span(lines.crossings)
                          .subspan(lines.first[line], lines.first[line + 1] - lines.first[line]));
    });
  }

  double plane() const { return size(1) * size(2); }

  MeshVolume value() const {
    if (at_line_.empty()) return {};
    std::vector<MeshVolume> slices(lattice_.nz);
    tbb::parallel_for(std::uint32_t{0}, lattice_.nz,
                      [&](std::uint32_t j) { slices[j] = lattice_slice(j); });
    std::vector<MeshVolume> parts(kIntervals);
    tbb::parallel_for(std::size_t{0}, kIntervals, [&](std::size_t i) {
      const MeshVolume &lower = slices[2 * i], &middle = slices[2 * i + 1],
                       &upper = slices[2 * i + 2];
      double slice_error = std::max({lower.error, middle.error, upper.error});
      const auto area = [&](double z) {
        const MeshVolume s = free_slice(z);
        slice_error = std::max(slice_error, s.error);
        return s.value;
      };
      const auto j = static_cast<std::uint32_t>(2 * i);
      parts[i] = integrate(area, lattice_.z(j), lattice_.z(j + 2), lower.value, middle.value,
                           upper.value, kTolerance * size(0) * plane(), kMaxHalvings);
      parts[i].error += slice_error * 2 * lattice_.step_z;
    });
    MeshVolume sum;
    for (const MeshVolume& part : parts) {
      sum.value += part.value;
      sum.error += part.error;
    }
    return sum;
  }

 private:
  double size(int axis) const { return box_.upper[axis] - box_.lower[axis]; }

  double excess_at(double y, double z, std::vector<Crossing>& scratch) const {
    line_crossings(hierarchy_(), y, z, scratch);
    return line_excess(scratch);
  }

  /// The excess of the plane (·, ·, z), an area, from its values at the lattice's lines.
  template <class Known>
  MeshVolume slice(double z, const Known& known) const {
    std::vector<Crossing> scratch;
    const auto excess = [&](double y) { return excess_at(y, z, scratch); };
    MeshVolume sum;
    for (std::uint32_t i = 0; i + 2 < lattice_.ny; i += 2) {
      const MeshVolume part =
          integrate(excess, lattice_.y(i, 0), lattice_.y(i + 2, 0), known(i), known(i + 1),
                    known(i + 2), kTolerance * size(0) * size(1), kMaxHalvings);
      sum.value += part.value;
      sum.error += part.error;
    }
    return sum;
  }

  MeshVolume lattice_slice(std::uint32_t j) const {
    return slice(lattice_.z(j),
                 [&](std::uint32_t i) { return at_line_[std::size_t{j} * lattice_.ny + i]; });
  }

  MeshVolume free_slice(double z) const {
    std::vector<Crossing> scratch;
    std::vector<double> at(lattice_.ny);
    for (std::uint32_t i = 0; i < lattice_.ny; ++i) at[i] = excess_at(lattice_.y(i, 0), z, scratch);
    return slice(z, [&](std::uint32_t i) { return at[i]; });
  }

  const HierarchyMaker& hierarchy_;
  MeshBox box_;
  LineLattice lattice_;
  std::vector<double> at_line_;  // the excess of every line
};

/// Neumaier's compensated sum.
struct CompensatedSum {
  double high = 0, lost = 0;

  void add(double term) {
    const double next = high + term;
    lost += std::abs(high) >= std::abs(term) ? (high - next) + term : (term - next) + high;
    high = next;
  }
};

/// The largest extent of a triangle along x.
double longest_triangle(const MeshView& mesh) {
  double longest = 0;
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    const Extent x(corners_of(mesh, t));
    longest = std::max(longest, x.high - x.low);
  }
  return longest;
}

}  // namespace

MeshVolume enclosed_volume(const MeshView& mesh) {
  struct Part {
    CompensatedSum sum;
    double magnitude = 0;
  };
  // In parts of fixed size, each in index order: the same bits for any number of threads.
  constexpr std::size_t kPart = 1u << 14;
  std::vector<Part> parts((mesh.triangle_count + kPart - 1) / kPart);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    Part& part = parts[p];
    const auto end = std::min<std::size_t>((p + 1) * kPart, mesh.triangle_count);
    for (std::size_t t = p * kPart; t < end; ++t) {
      const Corners corner = corners_of(mesh, static_cast<std::uint32_t>(t));
      const double *a = corner.p[0], *b = corner.p[1], *c = corner.p[2];
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double left = b[j] * c[k], right = b[k] * c[j];
        part.sum.add(a[i] * (left - right) / 6);
        part.magnitude += std::abs(a[i]) * (std::abs(left) + std::abs(right)) / 6;
      }
    }
  });
  Part all;
  for (const Part& part : parts) {
    all.sum.add(part.sum.high);
    all.sum.add(part.sum.lost);
    all.magnitude += part.magnitude;
  }
  return {all.sum.high + all.sum.lost, 8 * 0x1p-53 * all.magnitude};
}

MeshVolume winding_set_volume(const MeshView& mesh, bool meets_itself,
                              const HierarchyMaker& hierarchy) {
  const MeshVolume enclosed = enclosed_volume(mesh);
  const ExcessIntegral integral(mesh, hierarchy);
  const MeshVolume excess = integral.value();
  MeshVolume volume = {enclosed.value - excess.value, enclosed.error + excess.error};
  // What n columns did not meet covers less than 3 / n of the plane, 95 times in 100. A fold is
  // taken to be no deeper than the longest triangle.
  constexpr double kColumns = 4.0 * kIntervals * kIntervals;
  if (meets_itself) volume.error += 3 / kColumns * integral.plane() * longest_triangle(mesh);
  return volume;
}

}  // namespace ist
