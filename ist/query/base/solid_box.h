#pragma once

#include "query/base/pair_place.h"

// Boxes around placed solids, for broad phases on the CPU and on the GPU.

namespace ist {

/// A float below x, by more than the rounding of doubles.
IST_HD inline float float_below(double x) noexcept {
  const auto nearest = static_cast<float>(x);
  return nearest - ::fabsf(nearest) * 1.2e-7f - 1e-37f;
}

/// A box along the world's axes [u].
struct WorldBox {
  Vec3 low, high;

  static constexpr double kMost = 1e37;

  /// True if floats can represent it.
  IST_HD bool fits() const noexcept {
    for (int k = 0; k < 3; ++k)
      if (!(low[k] >= -kMost) || !(high[k] <= kMost)) return false;
    return true;
  }
  /// Rounded outward.
  template <class Floats>
  IST_HD void write(Floats& lower, Floats& upper) const noexcept {
    for (int k = 0; k < 3; ++k) {
      lower[static_cast<unsigned>(k)] = float_below(low[k]);
      upper[static_cast<unsigned>(k)] = -float_below(-high[k]);
    }
  }
};

/// The box of a solid in its own frame, and its margins.
struct SolidBox {
  Vec3 middle = {0, 0, 0}, half = {0, 0, 0};  ///< [u]
  double protrusion = 0;                      ///< [u] of matched spheres out of the solid
  double mesh_error = 0;                      ///< [u]
  bool endless = false;                       ///< no box bounds it
  bool is_shape = false;
  bool empty = false;

  IST_HD void scale(double s) noexcept {
    middle = {s * middle.x, s * middle.y, s * middle.z};
    half = {s * half.x, s * half.y, s * half.z};
    protrusion *= s;
    mesh_error *= s;
  }
  /// The world's box around it, wider by `wider` [u] on each side.
  IST_HD WorldBox placed(const Rotation& rotation, const double (&t)[3],
                         double wider) const noexcept {
    WorldBox box;
    formulas::box_around(rotation.w, rotation.v, vec3(t), middle, half, wider, box.low, box.high);
    return box;
  }
};

}  // namespace ist
