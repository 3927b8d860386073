#pragma once

#include <cmath>

#include "query/base/pair_place.h"
#include "query/base/smooth_step.h"

namespace ist {

/// The weight of unlike levels of detail for two copies of one asset that nearly coincide. If each
/// sphere lies on its copy, the sum of lenses is ∫ρ², where ρ, the number of spheres at a point, is
/// 1 in the mean but not everywhere: 6 to 9 % too much (docs/design.md 5). A level against the next
/// coarser one has other spheres and no such excess. So as copies approach coincidence, such unlike
/// levels take over: the mean of both orders, which has no force at coincidence.
struct CoincidenceWeight {
  double weight = 0;  ///< [0, 1]; 0 from a displacement of 1.6 mean radii on
  PoseSlope slope;
};

/// The weight for two copies of a tree: smooth in the pose, by the root mean square displacement of
/// equal points of the two, as if the tree filled its root ball.
IST_HD inline CoincidenceWeight coincidence_weight(const double (&root)[4], double mean_radius,
                                                   const Similarity& a_from_b) noexcept {
  const double(&m)[9] = a_from_b.m;
  const double(&t0)[3] = a_from_b.t;
  const double centre[3] = {root[0], root[1], root[2]};
  double moved[3];
  a_from_b.apply(centre, moved);
  const Vec3 displacement = {moved[0] - centre[0], moved[1] - centre[1], moved[2] - centre[2]};
  const Vec3 lever = {moved[0] - t0[0], moved[1] - t0[1], moved[2] - t0[2]};
  // The mean square of each coordinate over a ball is r²/5.
  const double spread = root[3] * root[3] / 5, scale = a_from_b.scale;
  const double turned = 3 * (scale * scale + 1) - 2 * ((m[0] + m[4]) + m[8]);
  const double square = dot(displacement, displacement) + spread * (turned > 0 ? turned : 0);
  CoincidenceWeight result;
  if (!(square < (kCopyApart * kCopyApart) * (mean_radius * mean_radius))) return result;
  const double distance = std::sqrt(square);
  const double part = (kCopyApart - distance / mean_radius) / (kCopyApart - kCopyAlone);
  result.weight = smooth_step(part);
  if (part >= 1) return result;
  const double slope = -smooth_slope(part) / ((kCopyApart - kCopyAlone) * mean_radius) / distance;
  result.slope.by_translation = slope * displacement;
  result.slope.by_rotation =
      slope * (cross(lever, displacement) - spread * Vec3{m[5] - m[7], m[6] - m[2], m[1] - m[3]});
  return result;
}

}  // namespace ist
