#pragma once

#include <ist/bake.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

#include "mesh/mesh_files.h"
#include "support/box_overlap.h"
#include "support/extremes.h"
#include "support/reference_sum.h"
#include "support/test_meshes.h"
#include "support/turns.h"

namespace ist::testing {

using Eigen::Vector3d;

constexpr std::size_t kExtremeSpheres = 1000;
constexpr double kNoPromise = std::numeric_limits<double>::infinity();
inline const Vector3d kHalfA(0.5, 0.4, 0.3), kHalfB(0.3, 0.5, 0.6);

/// The largest value so far; NaN stays.
class Worst {
 public:
  void add(double value) {
    if (!(value <= value_)) value_ = value;
  }
  double value() const { return value_; }

 private:
  double value_ = 0;
};

inline double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

inline Asset baked(const ClosedMesh& mesh, std::size_t spheres = kExtremeSpheres) {
  return bake(mesh, {.max_spheres = spheres});
}

inline double violations(const Asset& asset, const ClosedMesh& mesh) {
  std::size_t sum = 0;
  for (const Invariant& invariant : check(asset, mesh)) sum += invariant.violations;
  return static_cast<double>(sum);
}

/// Matched volumes must sum to the solid's.
inline double calibration_error(const Asset& asset) {
  double sum = 0;
  for (const WorldSphere& s : world_spheres({asset.view(), {}, 1}, Measure::matched))
    sum += 4 * std::numbers::pi / 3 * s.r * s.r * s.r;
  return std::abs(sum / asset.view().volume() - 1);
}

/// The mesh as an OBJ file of 17 digits gives it.
inline ClosedMesh read_back(const TriangleMesh& mesh) {
  std::string text;
  char line[120];
  for (const Vector3d& v : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", v.x(), v.y(), v.z());
    text += line;
  }
  for (const auto& t : mesh.triangles) {
    std::snprintf(line, sizeof line, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
    text += line;
  }
  return close_mesh(read_mesh({"extreme.obj", text}, {}), "extreme.obj");
}

/// Two boxes: meshes of the given size, their centres `offset` sizes from the mesh frame's origin.
class Boxes {
 public:
  explicit Boxes(double size, double offset = 0, double size_b = 0)
      : size_a_(size),
        size_b_(size_b > 0 ? size_b : size),
        centre_a_(offset * size * Vector3d(1, -0.7, 0.3)),
        centre_b_(offset * size * Vector3d(-0.4, 1, -0.9)),
        mesh_a_(read_back(box_mesh(centre_a_ - size_a_ * kHalfA, centre_a_ + size_a_ * kHalfA))),
        mesh_b_(read_back(box_mesh(centre_b_ - size_b_ * kHalfB, centre_b_ + size_b_ * kHalfB))),
        a_(baked(mesh_a_)),
        b_(baked(mesh_b_)) {}

  /// B's centre at `shift` [A's size] from A's, turned by q.
  Pose pose(const Eigen::Quaterniond& q, const Vector3d& shift) const {
    const Vector3d t = centre_a_ + size_a_ * shift - q * centre_b_;
    return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
  }
  double exact(const Eigen::Quaterniond& q, const Vector3d& shift) const {
    // In units of A's size and about A's centre, where no digits are lost.
    const OrientedBox a{Vector3d::Zero(), kHalfA, Eigen::Matrix3d::Identity()};
    const OrientedBox b{shift, size_b_ / size_a_ * kHalfB, q.toRotationMatrix()};
    return overlap_volume(a, b) * std::pow(size_a_, 3);
  }
  PlacedAsset a() const { return {a_.view(), {}, 1}; }
  PlacedAsset b(const Pose& pose) const { return {b_.view(), pose, 1}; }
  double volume_b() const { return b_.view().volume(); }

  Claim soundness() const {
    return {"violations that `ist check` finds", violations(a_, mesh_a_) + violations(b_, mesh_b_),
            0};
  }

  /// Volume, force and distance at poses made from the given seed.
  std::vector<Claim> answers(unsigned seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Workspace workspace;
    std::vector<double> errors;
    const double smaller = std::min(8 * kHalfA.prod() * std::pow(size_a_, 3), volume_b());
    while (errors.size() < 40) {
      const Eigen::Quaterniond q = random_turn(random);
      const Vector3d shift(uniform(random), uniform(random), uniform(random));
      const double want = exact(q, shift);
      if (want < 0.01 * smaller) continue;
      const Penetration got = penetration(a(), b(pose(q, shift)), {}, workspace);
      errors.push_back(std::abs(got.volume / want - 1));
    }
    std::size_t outside = 0;
    for (const double gap : {1e-3, 0.03, 0.3, 3.0}) {  // face to face along x
      const Pose apart = pose(Eigen::Quaterniond::Identity(),
                              {kHalfA.x() + size_b_ / size_a_ * kHalfB.x() + gap, 0.1, -0.1});
      const Separation got = separation(a(), b(apart), {}, workspace);
      // The rounding of t moves B by that much.
      const double rounding = 4e-16 * (centre_a_.norm() + centre_b_.norm());
      outside += got.distance_min > gap * size_a_ + rounding;
      outside += got.distance_max < gap * size_a_ - rounding;
    }
    return {{"median volume error, 40 poses that overlap by ≥ 1 %", quantile(errors, 0.5), 3e-3},
            {"largest", quantile(errors, 1), 5e-2},
            {"true distances outside the certified interval", static_cast<double>(outside), 0},
            soundness()};
  }

  double size_a_, size_b_;
  Vector3d centre_a_, centre_b_;
  ClosedMesh mesh_a_, mesh_b_;
  Asset a_, b_;
};

// The rows: extreme_solids.cpp …
std::vector<Claim> of_thin_box(const Vector3d& half, bool turned);
std::vector<Claim> of_crack();
std::vector<Claim> of_touching_shells();
// … and extreme_poses.cpp.
std::vector<Claim> of_size_ratio();
std::vector<Claim> of_touching_faces();
std::vector<Claim> of_coincident_copies();
std::vector<Claim> of_half_turns();
std::vector<Claim> of_loose_quaternions();
std::vector<Claim> of_uniform_scales();

}  // namespace ist::testing
