#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <ist/query.h>

#include <ist/asset_layout.h>
#include "query/kernel/lens.h"

namespace ist::testing {

/// A sphere in world units.
struct WorldSphere {
  Eigen::Vector3d centre;
  double r = 0;
  double cover = 0;  ///< of an inner sphere
};

/// Every sphere of a placed tree, read from the asset's tables and not from its tree; of the
/// matched measure those of a level of detail.
inline std::vector<WorldSphere> world_spheres(const PlacedAsset& placed, Measure measure,
                                              std::uint32_t detail = 0) {
  const AssetHeader& header = placed.asset.header();
  const bool inner = measure == Measure::inner;
  const Sphere* spheres =
      inner ? at<Sphere>(header, header.inner_spheres) : matched_spheres(header, detail);
  const std::uint64_t count = detail_spheres(header.sphere_count, inner ? 0 : detail);
  const float* covers = at<float>(header, header.cover_radii);
  const Eigen::Quaterniond q =
      Eigen::Quaterniond(placed.pose.q[0], placed.pose.q[1], placed.pose.q[2], placed.pose.q[3])
          .normalized();
  const Eigen::Vector3d t(placed.pose.t[0], placed.pose.t[1], placed.pose.t[2]);
  const double unit = std::ldexp(1.0, header.exponent);
  std::vector<WorldSphere> out;
  for (std::uint64_t i = 0; i < count; ++i) {
    const Sphere& s = spheres[i];
    const Eigen::Vector3d mesh =
        unit * Eigen::Vector3d(s.x, s.y, s.z) +
        Eigen::Vector3d(header.centre[0], header.centre[1], header.centre[2]);
    out.push_back({q * (placed.scale * mesh) + t, placed.scale * unit * static_cast<double>(s.r),
                   placed.scale * unit * static_cast<double>(covers[i])});
  }
  return out;
}

struct ReferenceSum {
  double volume = 0;
  std::size_t lenses = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  double force_scale = 0;  ///< Σ |gradient| of single lenses: what cancels in the sum

  Eigen::Vector3d centroid() const { return moment / volume; }
};

/// The sum that `penetration` answers, over all pairs in double: no tree, no frame but the world.
inline ReferenceSum reference_sum(const PlacedAsset& a, const PlacedAsset& b, Measure measure,
                                  std::uint32_t detail_a = 0, std::uint32_t detail_b = 0) {
  const auto spheres_a = world_spheres(a, measure, detail_a);
  const auto spheres_b = world_spheres(b, measure, detail_b);
  const Eigen::Vector3d origin(b.pose.t[0], b.pose.t[1], b.pose.t[2]);
  ReferenceSum sum;
  for (const WorldSphere& i : spheres_a) {
    for (const WorldSphere& j : spheres_b) {
      const Eigen::Vector3d between = j.centre - i.centre;
      const double reach = i.r + j.r;
      if (between.squaredNorm() >= reach * reach) continue;
      const double d = between.norm();
      const Lens<double> l = lens(i.r, j.r, d);
      const double volume = l.volume();
      if (!(volume > 0)) continue;
      sum.volume += volume;
      ++sum.lenses;
      sum.moment += volume * ((l.cap_a * i.centre + l.cap_b * j.centre) / (l.cap_a + l.cap_b));
      if (d > 0) {
        const Eigen::Vector3d force = l.derivative() / d * between;
        sum.force -= force;
        sum.torque -= (j.centre - origin).cross(force);
        sum.force_scale += force.norm();
      }
    }
  }
  return sum;
}

struct ReferenceGap {
  double distance = std::numeric_limits<double>::infinity();  ///< min |xi − xj| − ri − rj
  double covered = std::numeric_limits<double>::infinity();   ///< min |xi − xj| − ci − cj
};

inline ReferenceGap reference_gap(const PlacedAsset& a, const PlacedAsset& b) {
  const auto spheres_a = world_spheres(a, Measure::inner);
  const auto spheres_b = world_spheres(b, Measure::inner);
  ReferenceGap gap;
  for (const WorldSphere& i : spheres_a) {
    for (const WorldSphere& j : spheres_b) {
      const double d = (j.centre - i.centre).norm();
      gap.distance = std::min(gap.distance, d - i.r - j.r);
      gap.covered = std::min(gap.covered, d - i.cover - j.cover);
    }
  }
  return gap;
}

}  // namespace ist::testing
