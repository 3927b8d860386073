#include "mesh/mesh_volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mesh/winding.h"

namespace ist {
namespace {

constexpr std::size_t kIntervals = 200;  ///< along y and along z before any is halved
constexpr int kMaxHalvings = 30;
constexpr double kTolerance = 1e-7;  ///< of an interval, relative to the bounding box

/// Adaptive integral of f over [a, b], whose values at both ends are known: halves where f is not
/// linear, so that a step is found like a root.
template <class Function>
MeshVolume integrate(const Function& f, double a, double b, double at_a, double at_b,
                     double tolerance, int halvings) {
  const double middle = (a + b) / 2;
  const double at_middle = f(middle);
  const double bend = std::abs(at_middle - (at_a + at_b) / 2) * (b - a);
  if (bend <= tolerance || halvings == 0)
    return {(at_a + at_b + 4 * at_middle) / 6 * (b - a), bend};
  const MeshVolume left = integrate(f, a, middle, at_a, at_middle, tolerance, halvings - 1);
  const MeshVolume right = integrate(f, middle, b, at_middle, at_b, tolerance, halvings - 1);
  return {left.value + right.value, left.error + right.error};
}

/// ∫ (winding − [winding ≥ 1]) dx along the line (·, y, z).
double line_excess(const MeshView& mesh, double y, double z, std::vector<Crossing>& scratch) {
  line_crossings(mesh, y, z, scratch);
  double excess = 0;
  int winding = 0;
  for (std::size_t i = 0; i + 1 < scratch.size(); ++i) {
    winding += scratch[i].sign;
    const int counted_twice = winding - (winding >= 1 ? 1 : 0);
    if (counted_twice != 0) excess += counted_twice * (scratch[i + 1].x - scratch[i].x);
  }
  return excess;
}

struct Extent {
  double lower[3], upper[3];
};

Extent extent_of(const MeshView& mesh) {
  Extent extent;
  for (int k = 0; k < 3; ++k) {
    extent.lower[k] = extent.upper[k] = mesh.vertices_exact[k];
    for (std::size_t v = 1; v < mesh.vertex_count; ++v) {
      extent.lower[k] = std::min(extent.lower[k], mesh.vertices_exact[3 * v + std::size_t(k)]);
      extent.upper[k] = std::max(extent.upper[k], mesh.vertices_exact[3 * v + std::size_t(k)]);
    }
  }
  return extent;
}

/// Integrals of the excess: along x exactly, along y and z adaptively.
class ExcessIntegral {
 public:
  explicit ExcessIntegral(const MeshView& mesh) : mesh_(mesh), extent_(extent_of(mesh)) {}

  double plane() const { return size(1) * size(2); }

  MeshVolume value() const {
    std::vector<double> slices(kIntervals + 1);
    tbb::parallel_for(std::size_t{0}, slices.size(),
                      [&](std::size_t i) { slices[i] = slice(grid(2, i)).value; });
    std::vector<MeshVolume> parts(kIntervals);
    tbb::parallel_for(std::size_t{0}, kIntervals, [&](std::size_t i) {
      MeshVolume& part = parts[i];
      double slice_error = 0;  // the largest of the slices that were looked at
      const auto area = [&](double z) {
        const MeshVolume s = slice(z);
        slice_error = std::max(slice_error, s.error);
        return s.value;
      };
      const double lower = grid(2, i), upper = grid(2, i + 1);
      part = integrate(area, lower, upper, slices[i], slices[i + 1], kTolerance * size(0) * plane(),
                       kMaxHalvings);
      part.error += slice_error * (upper - lower);
    });
    MeshVolume sum;
    for (const MeshVolume& part : parts) {
      sum.value += part.value;
      sum.error += part.error;
    }
    return sum;
  }

 private:
  double size(int axis) const { return extent_.upper[axis] - extent_.lower[axis]; }

  double grid(int axis, std::size_t i) const {
    return extent_.lower[axis] + size(axis) * static_cast<double>(i) / double(kIntervals);
  }

  /// The excess of the plane (·, ·, z): an area.
  MeshVolume slice(double z) const {
    std::vector<Crossing> scratch;
    const auto excess = [&](double y) { return line_excess(mesh_, y, z, scratch); };
    MeshVolume sum;
    double at_lower = excess(grid(1, 0));
    for (std::size_t i = 0; i < kIntervals; ++i) {
      const double lower = grid(1, i), upper = grid(1, i + 1);
      const double at_upper = excess(upper);
      const MeshVolume part = integrate(excess, lower, upper, at_lower, at_upper,
                                        kTolerance * size(0) * size(1), kMaxHalvings);
      sum.value += part.value;
      sum.error += part.error;
      at_lower = at_upper;
    }
    return sum;
  }

  const MeshView& mesh_;
  Extent extent_;
};

/// The largest extent of a triangle along x.
double longest_triangle(const MeshView& mesh) {
  double longest = 0;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const auto x = [&](std::size_t i) {
      return mesh.vertices_exact[3 * std::size_t{mesh.triangles[3 * t + i]}];
    };
    const auto [low, high] = std::minmax({x(0), x(1), x(2)});
    longest = std::max(longest, high - low);
  }
  return longest;
}

}  // namespace

MeshVolume enclosed_volume(const MeshView& mesh) {
  double sum = 0, lost = 0, magnitude = 0;  // Neumaier's compensated sum, in index order
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const auto corner = [&](std::size_t i) {
      return mesh.vertices_exact + 3 * std::size_t{mesh.triangles[3 * t + i]};
    };
    const double *a = corner(0), *b = corner(1), *c = corner(2);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const double left = b[j] * c[k], right = b[k] * c[j];
      const double term = a[i] * (left - right) / 6;
      magnitude += std::abs(a[i]) * (std::abs(left) + std::abs(right)) / 6;
      const double next = sum + term;
      lost += std::abs(sum) >= std::abs(term) ? (sum - next) + term : (term - next) + sum;
      sum = next;
    }
  }
  return {sum + lost, 8 * 0x1p-53 * magnitude};
}

MeshVolume winding_set_volume(const MeshView& mesh, bool meets_itself) {
  const MeshVolume enclosed = enclosed_volume(mesh);
  const ExcessIntegral integral(mesh);
  const MeshVolume excess = integral.value();
  MeshVolume volume = {enclosed.value - excess.value, enclosed.error + excess.error};
  // What n columns did not meet covers less than 3 / n of the plane, 95 times in 100. A fold is
  // taken to be no deeper than the longest triangle.
  constexpr double kColumns = 4.0 * kIntervals * kIntervals;
  if (meets_itself) volume.error += 3 / kColumns * integral.plane() * longest_triangle(mesh);
  return volume;
}

}  // namespace ist
