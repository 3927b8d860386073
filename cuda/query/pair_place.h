#pragma once

#include <cmath>

#include <ist/pose.h>

#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"
#include "query/asset/shared_constants.h"

namespace ist::gpu {

/// x ↦ scale · R x + t, the matrix stored scaled, row by row.
struct PairMap {
  double m[9], t[3], scale;

  IST_HD void apply(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i) y[i] = along(i, x, t[i]);
  }
  /// Without the translation.
  IST_HD void turn(const double (&x)[3], double (&y)[3]) const {
    for (int i = 0; i < 3; ++i) y[i] = along(i, x, 0);
  }

 private:
  IST_HD double along(int i, const double (&x)[3], double from) const {
    return std::fma(m[3 * i], x[0],
                    std::fma(m[3 * i + 1], x[1], std::fma(m[3 * i + 2], x[2], from)));
  }
};

/// What a pose needs to know of an asset.
struct AssetFrame {
  double centre[3];  ///< [u] origin of the unit frame
  double unit;       ///< [u]
};

/// Two placed assets seen from A's unit frame (RelativePose, query/base/relative_pose.h, in plain
/// numbers).
struct PairPlace {
  PairMap a_from_b, b_from_a;
  double rotation_a[9];  ///< world from A
  double origin_a[3];    ///< [u] of A's unit frame, world
  double offset_b[3];    ///< [u] from B's origin to its unit frame's, world
  double unit_a;         ///< [u]

  /// False where a pose or scale cannot be used (QueryStatus::invalid_input).
  IST_HD bool place(const AssetFrame& a, const Pose& pose_a, double scale_a, const AssetFrame& b,
                    const Pose& pose_b, double scale_b) {
    double qa[4], qb[4];
    if (!usable(pose_a, scale_a, qa) || !usable(pose_b, scale_b, qb)) return false;
    double rb[9];
    matrix_of(qa, rotation_a);
    matrix_of(qb, rb);
    unit_a = scale_a * a.unit;
    const double unit_b = scale_b * b.unit;
    double between[3];
    for (int i = 0; i < 3; ++i) {
      const double in_a =
          scale_a * (rotation_a[3 * i] * a.centre[0] + rotation_a[3 * i + 1] * a.centre[1] +
                     rotation_a[3 * i + 2] * a.centre[2]);
      offset_b[i] = scale_b * (rb[3 * i] * b.centre[0] + rb[3 * i + 1] * b.centre[1] +
                               rb[3 * i + 2] * b.centre[2]);
      origin_a[i] = pose_a.t[i] + in_a;
      between[i] = pose_b.t[i] - pose_a.t[i];
    }
    const double scale = unit_b / unit_a, per_scale = unit_a / unit_b, per_unit = 1 / unit_a;
    double far = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        double sum = 0;
        for (int k = 0; k < 3; ++k) sum += rotation_a[3 * k + i] * rb[3 * k + j];
        a_from_b.m[3 * i + j] = scale * sum;
        b_from_a.m[3 * j + i] = sum * per_scale;
      }
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += rotation_a[3 * k + i] * (between[k] + offset_b[k]);
      a_from_b.t[i] = (sum - scale_a * a.centre[i]) * per_unit;
      const double size = a_from_b.t[i] < 0 ? -a_from_b.t[i] : a_from_b.t[i];
      far = size > far ? size : far;
    }
    for (int i = 0; i < 3; ++i)
      b_from_a.t[i] =
          -((b_from_a.m[3 * i] * a_from_b.t[0] + b_from_a.m[3 * i + 1] * a_from_b.t[1]) +
            b_from_a.m[3 * i + 2] * a_from_b.t[2]);
    a_from_b.scale = scale;
    b_from_a.scale = per_scale;
    return far <= kFarthestPose && scale <= kFarthestPose && scale >= 1 / kFarthestPose;
  }

 private:
  IST_HD static bool usable(const Pose& pose, double scale, double (&q)[4]) {
    const double norm = std::sqrt((pose.q[0] * pose.q[0] + pose.q[1] * pose.q[1]) +
                                  (pose.q[2] * pose.q[2] + pose.q[3] * pose.q[3]));
    constexpr double kLargest = 1.7976931348623157e308;
    bool good =
        norm >= kShortestDirection && norm <= kLongestDirection && scale > 0 && scale <= kLargest;
    for (int i = 0; i < 3; ++i) good = good && pose.t[i] >= -kLargest && pose.t[i] <= kLargest;
    const double per_norm = 1 / norm;
    for (int i = 0; i < 4; ++i) q[i] = pose.q[i] * per_norm;
    return good;
  }

  IST_HD static void matrix_of(const double (&q)[4], double (&m)[9]) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    m[0] = 1 - 2 * (y * y + z * z);
    m[1] = 2 * (x * y - w * z);
    m[2] = 2 * (x * z + w * y);
    m[3] = 2 * (x * y + w * z);
    m[4] = 1 - 2 * (x * x + z * z);
    m[5] = 2 * (y * z - w * x);
    m[6] = 2 * (x * z - w * y);
    m[7] = 2 * (y * z + w * x);
    m[8] = 1 - 2 * (x * x + y * y);
  }
};

}  // namespace ist::gpu
