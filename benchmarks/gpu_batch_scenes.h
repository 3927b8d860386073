#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/shapes.h>

#include "support/batch_pair.h"
#include "support/oracle_rows.h"
#include "support/reference_sum.h"

// Solids and poses that gpu_batch asks about.

namespace ist::benchmark {

using ist::testing::BatchPair;

inline Asset baked(const TriangleMesh& mesh, const std::string& name, std::size_t spheres,
                   bool keep_mesh = false) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.keep_mesh = keep_mesh;
  return bake(close_mesh(mesh, name), settings);
}

/// Two solids and the poses at which B meets A.
struct Scene {
  std::string name;
  const Asset* a;  ///< of none if there is a field
  const Asset* b;
  std::vector<BatchPair> poses;
  double rate = 0, step_ms = 0;  ///< what one H200 is to reach: M/s of a million, ms of 4,096; 0: –
  const Shape* field = nullptr;  ///< in A's place
  std::uint32_t pair_budget = 0;
};

/// A nut on its bolt at any turn, its thread pushed a little way out of the middle of the gap.
inline std::vector<BatchPair> nut_poses(std::size_t count) {
  std::mt19937_64 random(5);
  std::vector<BatchPair> out;
  for (std::size_t k = 0; k < count; ++k) {
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const double turn = uniform(0, 1);
    const double half = std::numbers::pi * turn;
    BatchPair pair;
    pair.pose_b = {
        {std::cos(half), 0, 0, std::sin(half)},
        {uniform(-0.04, 0.04), uniform(-0.04, 0.04), 8 + 2 * turn + uniform(-0.08, 0.08)}};
    out.push_back(pair);
  }
  return out;
}

/// The same turns in the middle of the gap, B the second solid.
inline std::vector<BatchPair> clear_nut_poses(std::size_t count) {
  std::vector<BatchPair> out = nut_poses(count);
  for (BatchPair& pair : out) {
    const double turn = std::atan2(pair.pose_b.q[3], pair.pose_b.q[0]) / std::numbers::pi;
    pair.b = 1;
    pair.pose_b = {{pair.pose_b.q[0], 0, 0, pair.pose_b.q[3]}, {0, 0, 8 + 2 * turn}};
  }
  return out;
}

/// Rolling ground about z = 0, as large as all poses.
class Ground {
 public:
  Ground() {
    for (std::uint32_t j = 0; j < kPoints; ++j)
      for (std::uint32_t i = 0; i < kPoints; ++i)
        heights_.push_back(static_cast<float>(std::sin(0.7 * i) * std::cos(0.9 * j)));
  }

  /// Cells a tenth of the body's size across.
  Shape terrain(const Asset& body) {
    const double cell = 0.1 * std::cbrt(body.view().volume());
    for (float& height : heights_) height *= static_cast<float>(0.2 * cell);
    return HeightFieldShape{heights_.data(), kPoints, kPoints, {cell, cell}};
  }

 private:
  static constexpr std::uint32_t kPoints = 256;
  std::vector<float> heights_;
};

/// A solid at any turn, so deep in the half-space z ≤ 0: parts of its height, drawn from a range.
inline std::vector<BatchPair> poses_in_ground(const Asset& body, double least, double most) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<BatchPair> out;
  while (out.size() < 400) {
    BatchPair pair;
    double square = 0;
    for (double& q : pair.pose_b.q) {
      q = uniform(-1, 1);
      square += q * q;
    }
    if (!(square > 0.01 && square < 1)) continue;
    for (double& q : pair.pose_b.q) q /= std::sqrt(square);
    double bottom = 1e300, top = -1e300;
    for (const testing::WorldSphere& ball :
         testing::world_spheres({body.view(), pair.pose_b, 1}, Measure::matched)) {
      bottom = std::min(bottom, ball.centre.z() - ball.r);
      top = std::max(top, ball.centre.z() + ball.r);
    }
    pair.pose_b.t[2] = -bottom - uniform(least, most) * (top - bottom);
    out.push_back(pair);
  }
  return out;
}

/// Rows of a small solid on a large one (oracle/small) at a ratio of their sizes.
inline std::vector<BatchPair> small_poses(const std::string& key, const std::string& ratio) {
  std::vector<BatchPair> out;
  for (const auto& row :
       testing::read_csv(testing::shared_path("oracle/small/" + key + ".csv").string())) {
    if (!row.at("class").starts_with("r" + ratio + "_")) continue;
    const auto number = [&](const char* column) { return std::stod(row.at(column)); };
    BatchPair pair;
    pair.pose_b = {{number("qw"), number("qx"), number("qy"), number("qz")},
                   {number("tx"), number("ty"), number("tz")}};
    pair.scale_b = number("scale_b");
    out.push_back(pair);
  }
  return out;
}

/// Copies of a solid that stand apart by up to a part of its size, in any direction.
inline std::vector<BatchPair> poses_of_copies(const Asset& body, double most) {
  std::mt19937_64 random(9);
  std::vector<BatchPair> out;
  for (int i = 0; i < 400; ++i) {
    BatchPair pair;
    for (double& t : pair.pose_b.t)
      t = most * std::cbrt(body.view().volume()) *
          (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    out.push_back(pair);
  }
  return out;
}

/// `b`: the number of its second solid.
inline BatchPair pair_of(const testing::OracleRow& row, std::uint32_t b = 0) {
  BatchPair pair;
  pair.b = b;
  pair.pose_b = row.pose;
  pair.scale_b = row.scale_b;
  return pair;
}

inline std::vector<BatchPair> oracle_poses(const std::string& pose_class) {
  std::vector<BatchPair> out;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino"))
    if (row.pose_class == pose_class) out.push_back(pair_of(row));
  return out;
}

/// `count` of the poses in random order.
inline std::vector<BatchPair> drawn(const std::vector<BatchPair>& poses, std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<BatchPair> out;
  out.reserve(count);
  for (std::size_t k = 0; k < count; ++k) out.push_back(poses[random() % poses.size()]);
  return out;
}

/// B is the second solid.
inline std::vector<BatchPair> drawn_of_two(const std::vector<BatchPair>& poses, std::size_t count) {
  std::vector<BatchPair> out = drawn(poses, count);
  for (BatchPair& pair : out) pair.b = 1;
  return out;
}

}  // namespace ist::benchmark
