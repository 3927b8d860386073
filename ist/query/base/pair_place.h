#pragma once

#include <ist/asset_layout.h>
#include <ist/types.h>
#include <cmath>

#include "base/vec3.h"
#include "query/asset/shared_constants.h"

// The relative pose of two placed solids in plain numbers, on the CPU and on the GPU.

namespace ist {

/// True if no coordinate exceeds kFarthestPose.
IST_HD inline bool in_pose_range(const Vec3& x) noexcept {
  for (int k = 0; k < 3; ++k)
    if (!(x[k] <= kFarthestPose) || !(x[k] >= -kFarthestPose)) return false;
  return true;
}
IST_HD inline bool ratio_in_range(double ratio) noexcept {
  return ratio <= kFarthestPose && ratio >= 1 / kFarthestPose;
}

namespace formulas {

using Real = double;
IST_HD inline double constant(double x) { return x; }
IST_HD inline double magnitude(double x) { return std::fabs(x); }
#define IST_FORMULA IST_HD inline
#include "query/base/rotation_formulas-inl.h"
#undef IST_FORMULA

}  // namespace formulas
using formulas::turned;

/// (s M) x.
IST_HD inline Vec3 turned(double s, const double (&m)[9], const Vec3& x) noexcept {
  double scaled[9];
  for (int k = 0; k < 9; ++k) scaled[k] = s * m[k];
  return turned(scaled, x);
}

/// x ↦ scale · R x + t with the matrix stored scaled.
struct Similarity {
  double m[9];  ///< scale · R, row by row
  double t[3];
  double scale;

  static Similarity identity() noexcept { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, 1}; }

  [[gnu::always_inline]] IST_HD void apply(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i)
      y[i] = (m[3 * i] * x[0] + m[3 * i + 1] * x[1]) + m[3 * i + 2] * x[2] + t[i];
  }

  // On the GPU a fused product is one instruction.
  IST_HD void apply_fused(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i) y[i] = fused(i, x, t[i]);
  }
  /// Applies the linear part only.
  IST_HD void turn_fused(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i) y[i] = fused(i, x, 0);
  }

 private:
  IST_HD double fused(int i, const double (&x)[3], double from) const {
    return std::fma(m[3 * i], x[0],
                    std::fma(m[3 * i + 1], x[1], std::fma(m[3 * i + 2], x[2], from)));
  }
};

/// The gradient of a number by motions of B, in A's unit frame.
struct PoseSlope {
  Vec3 by_translation = {0, 0, 0};
  Vec3 by_rotation = {0, 0, 0};  ///< about B's unit-frame origin
};

/// The CPU divides each component of a vector; the GPU, where a division takes a dozen
/// instructions, multiplies by the reciprocal.
enum class Quotients { divided, by_reciprocal };

template <Quotients kBy>
IST_HD inline Vec3 over(const Vec3& x, double y) noexcept {
  if constexpr (kBy == Quotients::divided) return x / y;
  return (1 / y) * x;
}

/// A rotation as a unit quaternion. Sums are in Eigen's order.
struct Rotation {
  double w;
  Vec3 v;

  /// Normalises q; NaN if its length is out of range.
  template <Quotients kBy = Quotients::divided>
  IST_HD static Rotation of(const double (&q)[4]) noexcept {
    const double norm = std::sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
    if (!(norm >= kShortestDirection) || !(norm <= kLongestDirection))
      return {NAN, {NAN, NAN, NAN}};
    return {over<kBy>(Vec3{q[0], 0, 0}, norm).x, over<kBy>(Vec3{q[1], q[2], q[3]}, norm)};
  }
  IST_HD Rotation back() const { return {w, -v}; }
  IST_HD Vec3 operator*(const Vec3& x) const {
    const Vec3 half = cross(v, x), arc = half + half;
    return (x + w * arc) + cross(v, arc);
  }
  IST_HD Rotation operator*(const Rotation& b) const {
    const Vec3& a = v;
    return {(w * b.w - a.y * b.v.y) - (a.z * b.v.z + a.x * b.v.x),
            {(w * b.v.x + a.y * b.v.z) - (a.z * b.v.y - a.x * b.w),
             (w * b.v.y + a.y * b.w) + (a.z * b.v.x - a.x * b.v.z),
             (w * b.v.z - a.y * b.v.x) + (a.z * b.w + a.x * b.v.y)}};
  }
  IST_HD void matrix(double (&m)[9]) const { formulas::rotation_matrix(w, v, m); }
};

/// True if a pose and a scale are valid, apart from the ranges above.
IST_HD inline bool usable(const Rotation& rotation, const double (&t)[3], double scale) noexcept {
  return std::isfinite(rotation.w) && std::isfinite(t[0]) && std::isfinite(t[1]) &&
         std::isfinite(t[2]) && scale > 0 && std::isfinite(scale);
}

struct AssetFrame {
  Vec3 centre;  ///< [u] origin of the unit frame
  double unit;  ///< [u]
};

inline AssetFrame frame_of(const AssetHeader& header) noexcept {
  return {vec3(header.centre), std::ldexp(1.0, header.exponent)};
}

/// Two placed solids, seen from A's unit frame (docs/design.md 3.4): poses, scales and both unit
/// frames are folded into one map, in double.
struct PairPlace {
  Similarity a_from_b;  ///< unit frame of B → unit frame of A
  Similarity b_from_a;
  double rotation_a[9];  ///< world from A, row by row
  Vec3 origin_a;         ///< [u] of A's unit frame, world
  Vec3 offset_b;         ///< [u] from B's origin to its unit frame's, world
  double unit_a;         ///< [u] length of one unit of A's unit frame

  /// False if a pose or scale is not usable (QueryStatus::invalid_input).
  template <Quotients kBy = Quotients::divided>
  IST_HD bool place(const AssetFrame& a, const Pose& pose_a, double scale_a, const AssetFrame& b,
                    const Pose& pose_b, double scale_b) noexcept {
    const Rotation turn_a = Rotation::of<kBy>(pose_a.q), turn_b = Rotation::of<kBy>(pose_b.q);
    if (!usable(turn_a, pose_a.t, scale_a) || !usable(turn_b, pose_b.t, scale_b)) return false;
    unit_a = scale_a * a.unit;
    const double scale = scale_b * b.unit / unit_a;
    const Vec3 t_a = vec3(pose_a.t), t_b = vec3(pose_b.t);
    const Vec3 off_a = scale_a * a.centre, off_b = scale_b * b.centre;
    double r[9];
    (turn_a.back() * turn_b).matrix(r);
    const Vec3 t = over<kBy>(turn_a.back() * (t_b - t_a) + (turned(r, off_b) - off_a), unit_a);
    if (!in_pose_range(t) || !ratio_in_range(scale)) return false;
    a_from_b.scale = scale;
    b_from_a.scale = 1 / scale;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        a_from_b.m[3 * i + j] = scale * r[3 * i + j];
        b_from_a.m[3 * i + j] = b_from_a.scale * r[3 * j + i];
      }
      a_from_b.t[i] = t[i];
    }
    const Vec3 back = {(r[0] * t.x + r[3] * t.y) + r[6] * t.z,
                       (r[1] * t.x + r[4] * t.y) + r[7] * t.z,
                       (r[2] * t.x + r[5] * t.y) + r[8] * t.z};
    const Vec3 t_back = over<kBy>(-back, scale);
    for (int i = 0; i < 3; ++i) b_from_a.t[i] = t_back[i];
    turn_a.matrix(rotation_a);
    origin_a = t_a + turn_a * off_a;
    offset_b = turn_b * off_b;
    return true;
  }

  IST_HD double unit3() const noexcept { return unit_a * unit_a * unit_a; }  ///< [u³]

  /// Bound on the rounding of world coordinates, A's unit frame.
  IST_HD double rounding_of_world() const noexcept { return 1e-15 * norm(origin_a) / unit_a; }

  /// [u] The world position of a point of A's unit frame.
  IST_HD Vec3 to_world(const Vec3& x) const noexcept {
    return turned(rotation_a, unit_a * x) + origin_a;
  }
};

/// The gradient by rotations of A about another origin. `arm`: [u] from that origin to the old one.
IST_HD inline Vec3 turned_over(const Vec3& arm, const Vec3& push, const Vec3& turn) noexcept {
  return -(turn + cross(arm, push));
}

/// An overlap or a part of it in world units.
struct WorldSums {
  double volume;
  Vec3 centroid;              ///< zero without volume
  Vec3 translation_gradient;  ///< by a motion of B
  Vec3 rotation_gradient;     ///< likewise, about B's origin

  /// From sums in A's unit frame (Overlap, query/kernel/overlap.h).
  IST_HD static WorldSums of(const PairPlace& place, double volume, const Vec3& force,
                             const Vec3& torque, const Vec3& moment) noexcept {
    const double unit = place.unit_a, unit3 = unit * unit * unit;
    WorldSums sums = {unit3 * volume, {0, 0, 0}, turned(unit * unit, place.rotation_a, force), {}};
    if (volume > 0) sums.centroid = place.to_world(moment / volume + vec3(place.a_from_b.t));
    sums.rotation_gradient =
        turned(unit3, place.rotation_a, torque) + cross(place.offset_b, sums.translation_gradient);
    return sums;
  }
};

}  // namespace ist
