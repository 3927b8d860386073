#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include "support/baked.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

// Bodies, fields and pairs of trees of unlike sizes, and the work that is done on one that
// moves.

namespace ist::testing {

using Eigen::Quaterniond;
using Eigen::Vector3d;

inline const Asset& cube() {
  static const Asset asset = baked(cube_mesh(), "cube", 1000);
  return asset;
}
inline const Asset& torus() {
  static const Asset asset = baked(torus_mesh(0.35, 0.14, 40, 20), "torus", 800);
  return asset;
}
inline const Asset& coarse_torus() {
  static const Asset asset = baked(torus_mesh(0.35, 0.14, 40, 20), "torus", 60);
  return asset;
}
inline const Asset& plate() {
  static const Asset asset = baked(box_mesh({-1, -1, -0.01}, {1, 1, 0.01}), "plate", 1000);
  return asset;
}
inline const Asset& slab() {
  static const Asset asset = baked(box_mesh({-1, -1, -0.2}, {1, 1, 0.2}), "slab", 1000);
  return asset;
}

inline Vector3d position(const Pose& pose) { return {pose.t[0], pose.t[1], pose.t[2]}; }
inline Quaterniond rotation(const Pose& pose) {
  return {pose.q[0], pose.q[1], pose.q[2], pose.q[3]};
}
inline Pose pose_of(const Quaterniond& q, const Vector3d& t) {
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

/// A motion of a body from a pose on: along `v` and about `w`, by s.
struct Sweep {
  Pose start;
  Vector3d v = Vector3d::Zero(), w = Vector3d::Zero();
  Pose at(double s) const {
    const double angle = w.norm();
    const Quaterniond turn =
        angle > 0 ? Quaterniond(Eigen::AngleAxisd(angle * s, w / angle)) : Quaterniond::Identity();
    return pose_of(turn * rotation(start), position(start) + s * v);
  }
};

using Ask = std::function<Penetration(const Pose&)>;

struct Work {
  double done = 0;    ///< ∫ of the forces and torques
  double moved = 0;   ///< ∫ of their magnitudes, whatever the direction
  double change = 0;  ///< of the volume
  double most = 0;    ///< largest volume along the motion
};

/// Integrates by Simpson's rule from s = 0 to 1.
inline Work work_of(const Ask& ask, const Sweep& motion, int steps) {
  Work work;
  for (int i = 0; i <= 2 * steps; ++i) {
    const double weight = (i == 0 || i == 2 * steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) / (6.0 * steps);
    const Penetration p = ask(motion.at(0.5 * i / steps));
    work.most = std::max(work.most, p.volume);
    work.done -= weight * (p.force.dot(motion.v) + p.torque.dot(motion.w));
    work.moved += weight * (p.force.norm() * motion.v.norm() + p.torque.norm() * motion.w.norm());
  }
  work.change = ask(motion.at(1)).volume - ask(motion.at(0)).volume;
  return work;
}

inline Vector3d random_direction(std::mt19937_64& random) {
  const Pose pose = random_pose(random, 1);
  return position(pose);
}

/// Terrain of `points` heights a side, a quarter apart.
inline HeightFieldShape terrain_of(const std::vector<float>& heights, std::uint32_t points) {
  return {heights.data(), points, points, {0.25, 0.25}};
}

/// A grid of `points` distances a side, from −1 to 1.
inline DistanceGridShape grid_of(const std::vector<float>& distances, std::uint32_t points) {
  return {distances.data(), {points, points, points}, Vector3d::Constant(-1), 2.0 / (points - 1)};
}

inline std::vector<std::pair<const char*, Shape>> fields() {
  static const std::vector<float> heights = [] {
    std::vector<float> h;
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i)
        h.push_back(static_cast<float>(0.1 * std::sin(1.3 * i) * std::cos(0.9 * j)));
    return h;
  }();
  static const std::vector<float> distances = [] {
    std::vector<float> d;
    for (int k = 0; k < 21; ++k)
      for (int j = 0; j < 21; ++j)
        for (int i = 0; i < 21; ++i)
          d.push_back(
              static_cast<float>(0.1 * Vector3d(i - 10.0, j - 10.0, k - 10.0).norm() - 0.5));
    return d;
  }();
  HeightFieldShape terrain = terrain_of(heights, 9);
  terrain.lowest = -0.11, terrain.highest = 0.11;
  FunctionShape function;
  function.sample = [](const void*, const Vector3d& x) noexcept {
    const double d = x.norm();
    return ShapeSample{d - 0.5, d > 0 ? Vector3d(x / d) : Vector3d::Zero().eval()};
  };
  return {{"half-space", HalfSpaceShape{Vector3d(0.6, 0, 0.8), 0.1}},
          {"box", BoxShape{Vector3d(0.5, 0.4, 0.3)}},
          {"thin box", BoxShape{Vector3d(0.5, 0.4, 0.01)}},
          {"ball", BallShape{0.5}},
          {"capsule", CapsuleShape{0.3, 0.4}},
          {"cylinder", CylinderShape{0.4, 0.3}},
          {"terrain", terrain},
          {"grid", grid_of(distances, 21)},
          {"function", function}};
}

struct SurfacePair {
  const char* name;
  const Asset &a, &b;
  double scale_b;
  double distance;
};

inline std::vector<SurfacePair> pairs() {
  return {{"fine on coarse", cube(), torus(), 0.2, 0.5},
          {"coarse on fine", coarse_torus(), cube(), 1.0, 0.5},
          {"like sizes", cube(), torus(), 1.0, 0.7},
          {"like sizes turned", torus(), cube(), 1.0, 0.7},
          {"large on small", torus(), cube(), 6.0, 2.9},
          {"thin", plate(), torus(), 0.5, 0.1}};
}

}  // namespace ist::testing
