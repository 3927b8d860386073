#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <ist/bake.h>
#include <ist/pose_eigen.h>
#include <ist/time_of_impact.h>

#include "query/impact/impact_side.h"
#include "support/baked.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

// Bodies that fly at each other, and their known impacts without conservative advancement.

namespace ist::testing {

using Eigen::Vector3d;

inline const Asset& cube() {
  static const Asset asset = baked(cube_mesh(), "cube", 400);
  return asset;
}
inline const Asset& torus() {
  static const Asset asset = baked(torus_mesh(0.5, 0.15, 24, 12), "torus", 400);
  return asset;
}
inline const Asset& ball() {
  static const Asset asset = baked(icosphere_mesh(2), "ball", 300);
  return asset;
}
inline const Asset& ball_of_spheres() {
  static const Asset asset = baked(icosphere_mesh(2), "ball", 300, false);
  return asset;
}
inline const Asset& torus_of_spheres() {
  static const Asset asset = baked(torus_mesh(0.5, 0.15, 24, 12), "torus", 400, false);
  return asset;
}
/// 1 thick along z.
inline const Asset& wall() {
  static const Asset asset = baked(box_mesh({-50, -50, 0}, {50, 50, 1}), "wall", 400);
  return asset;
}
inline const Asset& rod() {
  static const Asset asset = baked(box_mesh({-1, -0.05, -0.05}, {1, 0.05, 0.05}), "rod", 100);
  return asset;
}

inline Workspace& workspace() {
  static Workspace one;
  return one;
}

inline Pose at(const Vector3d& t) { return {{1, 0, 0, 0}, {t.x(), t.y(), t.z()}}; }

inline Motion straight(const Vector3d& velocity) {
  return {velocity, Vector3d::Zero(), Vector3d::Zero()};
}

/// The corners of all triangles of an asset's mesh at a pose, three in a row.
inline std::vector<Vector3d> corners(const PlacedAsset& placed) {
  const ImpactSide side(placed.asset);
  const AssetHeader& header = placed.asset.header();
  const Eigen::Isometry3d to_world = to_isometry(placed.pose);
  std::vector<Vector3d> all;
  for (std::uint32_t block = 0; block < side.mesh()->count; ++block) {
    for (std::uint32_t lane = 0; lane < side.mesh()->blocks[block].triangles; ++lane) {
      const ConvexPiece piece = side.piece(kWidth * block + lane);
      for (const Vector3d& x : piece.corner)
        all.push_back(to_world * (placed.scale *
                                  (std::ldexp(1, header.exponent) * x + Vector3d(header.centre))));
    }
  }
  return all;
}

/// Distance of two surfaces, all pairs; 0 where they cross.
inline double distance(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double best = std::numeric_limits<double>::infinity();
  const auto triangle = [](const std::vector<Vector3d>& from, std::size_t i) {
    return ConvexPiece{{from[i], from[i + 1], from[i + 2]}, 3, 0, 0};
  };
  const auto middle_and_reach = [](const ConvexPiece& t) {
    const Vector3d m = (t.corner[0] + t.corner[1] + t.corner[2]) / 3;
    return std::pair(m, std::max({(t.corner[0] - m).norm(), (t.corner[1] - m).norm(),
                                  (t.corner[2] - m).norm()}));
  };
  for (std::size_t i = 0; i < a.size(); i += 3) {
    const ConvexPiece ta = triangle(a, i);
    const auto [ma, ra] = middle_and_reach(ta);
    for (std::size_t j = 0; j < b.size(); j += 3) {
      const ConvexPiece tb = triangle(b, j);
      const auto [mb, rb] = middle_and_reach(tb);
      if ((mb - ma).norm() - ra - rb > best) continue;
      if (triangles_cross(ta, tb)) return 0;
      best = std::min(best, nearest_points(ta, tb).distance);
    }
  }
  return best;
}

inline Motion random_motion(std::mt19937_64& random, double speed, double spin) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  return {speed * random_vector(draw), spin * random_vector(draw), 0.3 * random_vector(draw)};
}

}  // namespace ist::testing
