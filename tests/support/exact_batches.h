#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include <ist/query.h>

#include "support/exact_pair.h"
#include "support/host_batch.h"
#include "support/random_mates.h"
#include "support/random_pairs.h"
#include "support/test_meshes.h"

// Solids and poses that batches of exact penetrations are asked about, and what they say beside the
// CPU.

namespace ist::testing {

/// Fine and coarse, of one shell and of two, with a cavity, in a block and in many.
inline const std::vector<Asset>& exact_assets() {
  static const std::vector<Asset> made = [] {
    std::vector<Asset> out;
    out.push_back(surface(torus_mesh(1, 0.4, 48, 24), "torus"));
    out.push_back(baked(icosphere_mesh(3), "ball", 100));
    out.push_back(surface(cube_mesh(), "cube"));
    TriangleMesh hollow = icosphere_mesh(2);
    for (auto& t : hollow.triangles) std::swap(t[0], t[1]);
    for (Eigen::Vector3d& x : hollow.vertices) x *= 0.7;
    out.push_back(surface(joined(icosphere_mesh(2), hollow), "hollow"));
    out.push_back(
        surface(joined(box_mesh({-1, -1, -1}, {-0.2, 1, 1}), box_mesh({0.2, -1, -1}, {1, 1, 1})),
                "two boxes"));
    return out;
  }();
  return made;
}

inline std::vector<GpuSolid> views_of(const std::vector<Asset>& assets) {
  std::vector<GpuSolid> out;
  for (const Asset& asset : assets) out.emplace_back(asset.view());
  return out;
}
inline std::vector<GpuSolid> exact_solids() { return views_of(exact_assets()); }

inline std::vector<BatchPair> exact_pairs(unsigned seed, std::size_t count) {
  std::vector<BatchPair> pairs = RandomPairs(seed).pairs(count);
  for (std::size_t i = 0; i < count; ++i) {
    pairs[i].a = static_cast<std::uint32_t>(i % 5);
    pairs[i].b = static_cast<std::uint32_t>(i / 5 % 5);
  }
  return pairs;
}

struct Differences {
  double volume = 0, push = 0, turn = 0, centre = 0;
  double area = 0, normal = 0;  ///< of the CPU's
  std::size_t met = 0, touching = 0, flush = 0;
};

/// From the CPU's answers, in parts of the smaller solid's size.
inline Differences compare_exactly(const std::vector<Asset>& assets,
                                   const std::vector<BatchPair>& pairs,
                                   const std::vector<Penetration>& answers) {
  Differences worst;
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const BatchPair& pair = pairs[i];
    const PlacedAsset a = {assets[pair.a].view(), pair.pose_a, pair.scale_a};
    const PlacedAsset b = {assets[pair.b].view(), pair.pose_b, pair.scale_b};
    const Penetration cpu = exactly(a, b, workspace), &gpu = answers[i];
    EXPECT_EQ(gpu.status, cpu.status) << i;
    if (gpu.status != QueryStatus::ok) continue;
    const double size = std::min(size_of(a), size_of(b)), size2 = size * size;
    const double most = std::max(size_of(a), size_of(b));
    worst.met += cpu.volume > 0 ? 1 : 0;
    worst.volume = std::max(worst.volume, std::abs(gpu.volume - cpu.volume) / (size2 * size));
    worst.push = std::max(worst.push, (gpu.force - cpu.force).norm() / size2);
    worst.turn = std::max(worst.turn, (gpu.torque - cpu.torque).norm() / (size2 * most));
    if (cpu.volume > 1e-6 * size2 * size || cpu.contact_area > 1e-6 * size2)
      worst.centre = std::max(worst.centre, (gpu.centroid - cpu.centroid).norm() / size);
    EXPECT_EQ(gpu.touching, cpu.touching) << i;
    worst.touching += cpu.touching ? 1 : 0;
    worst.flush += cpu.contact_area > 0 ? 1 : 0;
    // An area that is only rounding has no correct digits.
    const double least = std::max(cpu.contact_area, 1e-9 * size2);
    worst.area = std::max(worst.area, std::abs(gpu.contact_area - cpu.contact_area) / least);
    if (cpu.contact_area > 1e-6 * size2)
      worst.normal = std::max(worst.normal, (gpu.contact_normal - cpu.contact_normal).norm());
    EXPECT_LE(gpu.volume_min, cpu.volume_max) << i;
    EXPECT_GE(gpu.volume_max, cpu.volume_min) << i;
    EXPECT_LE(gpu.volume_max - gpu.volume_min,
              20 * (cpu.volume_max - cpu.volume_min) + 1e-12 * size2 * size)
        << i;
  }
  std::printf(
      "%zu of %zu meet, %zu touch, %zu in faces; volume %.2g, push %.2g, turn %.2g, centroid %.2g, "
      "area %.2g, normal %.2g\n",
      worst.met, pairs.size(), worst.touching, worst.flush, worst.volume, worst.push, worst.turn,
      worst.centre, worst.area, worst.normal);
  return worst;
}

inline void expect_near(const Differences& worst) {
  EXPECT_LE(worst.volume, 1e-12);
  EXPECT_LE(worst.push, 1e-12);
  EXPECT_LE(worst.turn, 1e-12);
  EXPECT_LE(worst.centre, 1e-9);
  EXPECT_LE(worst.area, 1e-9);
  EXPECT_LE(worst.normal, 1e-9);
}

/// Random mates and their assets, each as it is and with A and B in each other's place; one in
/// three a little off.
struct MatedBatch {
  std::vector<Asset> assets;
  std::vector<BatchPair> pairs;

  MatedBatch(unsigned seed, std::uint32_t count) {
    RandomMates mates(seed);
    for (std::uint32_t k = 0; k < count; ++k) {
      const Mate mate = mates.next(12);
      for (const Extrusion* of : {&mate.a, &mate.b}) assets.push_back(surface(of->mesh(), "part"));
      const double off = mates.one_in(3) ? std::ldexp(1.0, -mates.whole(2, 40)) : 0;
      const Eigen::Vector3d t = mate.t + (mates.one_in(2) ? off : -off) * mate.direction;
      const Pose still = {{1, 0, 0, 0}, {0, 0, 0}};
      const Pose placed = {{mate.q.w(), mate.q.x(), mate.q.y(), mate.q.z()}, {t.x(), t.y(), t.z()}};
      pairs.push_back({2 * k, 2 * k + 1, still, placed, 1, 1});
      pairs.push_back({2 * k + 1, 2 * k, placed, still, 1, 1});
    }
  }
};

/// Cubes (exact_assets()[2]): a face, an edge and a corner on a face, and an edge across an edge,
/// apart or into each other by next to nothing. What is as far as rounding goes, 1e-14, is left
/// out: the CPU's limit is wider by what its planes of whole blocks round.
inline std::vector<BatchPair> grazing_pairs() {
  std::vector<BatchPair> pairs;
  const double half = std::numbers::pi / 4;
  const Eigen::Quaterniond still = Eigen::Quaterniond::Identity(),
                           edge(Eigen::AngleAxisd(half, Eigen::Vector3d::UnitX())),
                           across(Eigen::AngleAxisd(half, Eigen::Vector3d::UnitY())),
                           corner(Eigen::AngleAxisd(std::acos(std::sqrt(1.0 / 3)),
                                                    Eigen::Vector3d(1, -1, 0).normalized()));
  for (const auto& [of_a, of_b] : {std::pair{still, still},
                                   {still, edge},
                                   {still, corner},
                                   {edge, across},
                                   {edge, still},
                                   {corner, still}})
    for (int power = -60; power <= -8; power += 4)
      for (const double sign : {-1.0, 0.0, 1.0}) {
        const auto height = [](const Eigen::Quaterniond& q) {
          return 0.5 * q.toRotationMatrix().row(2).lpNorm<1>();
        };
        const double up = height(of_a) + height(of_b) + sign * std::ldexp(1.0, power);
        pairs.push_back({2,
                         2,
                         {{of_a.w(), of_a.x(), of_a.y(), of_a.z()}, {0, 0, 0}},
                         {{of_b.w(), of_b.x(), of_b.y(), of_b.z()}, {0.1, 0.05, up}},
                         1,
                         1});
      }
  return pairs;
}

/// Poses that engineers draw: turned by right angles, moved by parts of a side, scaled by powers of
/// two, copies in place.
inline std::vector<BatchPair> aligned_pairs(unsigned seed, std::size_t count) {
  RandomPairs random(seed);
  const auto pick = [&](int n) { return static_cast<int>(random.uniform(0, n)); };
  std::vector<BatchPair> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    BatchPair pair = {static_cast<std::uint32_t>(pick(5)),
                      static_cast<std::uint32_t>(pick(5)),
                      Pose{{1, 0, 0, 0}, {0, 0, 0}},
                      Pose{{1, 0, 0, 0}, {0, 0, 0}},
                      1,
                      1};
    if (i % 3 == 0) pair.b = pair.a;
    double* const q = pair.pose_b.q;
    if (const int axis = pick(6); axis < 4) q[axis] = 1, q[0] = axis == 0 || i % 2 == 0 ? 1 : 0;
    if (i % 4 != 0)
      for (double& t : pair.pose_b.t) t = 0.25 * (pick(9) - 4);
    pair.scale_b = std::ldexp(1, pick(3) - 1);
    if (i % 5 == 0) pair.pose_b.t[pick(3)] += std::ldexp(1.0, -20 - 10 * pick(4));
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace ist::testing
