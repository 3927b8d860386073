#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "support/surface_queries.h"

// Queries that meet a surface, stopped by limits and divided into patches.

namespace ist {
namespace {

using namespace testing;

std::vector<std::pair<const char*, PenetrationSettings>> limits() {
  std::vector<std::pair<const char*, PenetrationSettings>> all;
  for (const std::uint32_t visits : {1u, 3u, 10u, 40u, 200u, 1000u}) {
    PenetrationSettings s;
    s.max_visits = visits;
    all.emplace_back("max_visits", s);
  }
  return all;
}

void expect_bounds(const char* name, const char* limit, const Penetration& got,
                   const Penetration& full) {
  EXPECT_NE(got.status, QueryStatus::invalid_input);
  EXPECT_LE(got.volume_min, full.volume * (1 + 1e-6)) << name << ' ' << limit;
  EXPECT_GE(got.volume_max, full.volume * (1 - 1e-6)) << name << ' ' << limit;
  EXPECT_LE(got.volume_min, got.volume) << name << ' ' << limit;
  EXPECT_GE(got.volume_max, got.volume) << name << ' ' << limit;
  EXPECT_TRUE(std::isfinite(got.volume_max) && got.force.allFinite() && got.torque.allFinite() &&
              got.centroid.allFinite())
      << name << ' ' << limit;
  if (got.status == QueryStatus::ok) {
    EXPECT_NEAR(got.volume, full.volume, 1e-6 * full.volume) << name << ' ' << limit;
  }
}

TEST(FieldQuery, LimitsKeepTrueBounds) {
  std::mt19937_64 random(25);
  Workspace large, tiny(64);
  for (const auto& [name, field] : fields()) {
    for (int i = 0; i < 6; ++i) {
      const PlacedShape a{field, random_pose(random, 0.1), 1};
      const PlacedAsset b{(i % 2 == 0 ? cube() : torus()).view(), random_pose(random, 0.15 * i),
                          0.8};
      const Penetration full = penetration(a, b, {}, large);
      for (const auto& [limit, settings] : limits())
        expect_bounds(name, limit, penetration(a, b, settings, large), full);
      expect_bounds(name, "tiny", penetration(a, b, {}, tiny), full);
    }
  }
}

TEST(UnlikePairs, LimitsKeepTrueBounds) {
  std::mt19937_64 random(26);
  Workspace large, tiny(64);
  for (const SurfacePair& pair : pairs()) {
    for (int i = 0; i < 60; ++i) {
      const PlacedAsset a{pair.a.view(), random_pose(random, 0), 1};
      const PlacedAsset b{pair.b.view(), random_pose(random, (0.5 + 0.0133 * i) * pair.distance),
                          pair.scale_b};
      const Penetration full = penetration(a, b, {}, large);
      for (const auto& [limit, settings] : limits())
        expect_bounds(pair.name, limit, penetration(a, b, settings, large), full);
      // About as many visits as the lenses take: none is left for the meshes.
      const std::uint32_t visits = penetration(a, b, {.spheres_only = true}, large).node_visits;
      for (const std::uint32_t more : {0u, 1u, 2u, 3u, 5u})
        expect_bounds(pair.name, "lenses' visits",
                      penetration(a, b, {.max_visits = std::max(1u, visits + more - 1)}, large),
                      full);
      expect_bounds(pair.name, "tiny", penetration(a, b, {}, tiny), full);
    }
  }
}

void expect_shares(const char* name, const ContactPatches& got, const Penetration& whole,
                   std::span<const ContactPatch> patches) {
  EXPECT_EQ(got.penetration.volume, whole.volume) << name;
  EXPECT_EQ(got.penetration.status, whole.status) << name;
  EXPECT_EQ(got.penetration.node_visits, whole.node_visits) << name;
  EXPECT_EQ(got.penetration.force, whole.force) << name;
  EXPECT_EQ(got.penetration.torque, whole.torque) << name;
  // If a stopped query has summed nothing yet, there is nothing to divide.
  if (whole.status == QueryStatus::ok) {
    EXPECT_EQ(got.count > 0, whole.volume > 0) << name;
  }
  if (got.count == 0) return;
  double volume = 0, pull = 0, turn = 0;
  Vector3d force = Vector3d::Zero(), torque = force;
  for (const ContactPatch& patch : patches.first(got.count)) {
    volume += patch.volume;
    force += patch.force;
    torque += patch.torque;
    pull += patch.force.norm();
    turn += patch.torque.norm();
    EXPECT_TRUE(patch.normal.allFinite() && patch.centroid.allFinite());
    EXPECT_GE(patch.volume, 0) << name;
  }
  EXPECT_NEAR(volume, whole.volume, 1e-12 * whole.volume) << name;
  EXPECT_LE((force - whole.force).norm(), 1e-12 * pull) << name;
  EXPECT_LE((torque - whole.torque).norm(), 1e-12 * (turn + 2 * pull)) << name;
}

TEST(FieldQuery, PatchesAddUpToTheWhole) {
  Workspace workspace;
  std::mt19937_64 random(27);
  ContactPatch patches[12];
  for (const auto& [name, field] : fields()) {
    for (int i = 0; i < 8; ++i) {
      const PlacedShape a{field, random_pose(random, 0.1), 1};
      const PlacedAsset b{cube().view(), random_pose(random, 0.12 * i), 0.8};
      const Penetration whole = penetration(a, b, {}, workspace);
      const ContactPatches got = contact_patches(a, b, {}, workspace, patches);
      expect_shares(name, got, whole, patches);
    }
  }
}

TEST(UnlikePairs, PatchesAddUpToTheWhole) {
  Workspace workspace;
  std::mt19937_64 random(28);
  ContactPatch patches[12];
  for (const SurfacePair& pair : pairs()) {
    for (int i = 0; i < 24; ++i) {
      const PlacedAsset a{pair.a.view(), random_pose(random, 0.1), 1};
      const PlacedAsset b{pair.b.view(), random_pose(random, (0.2 + 0.04 * i) * pair.distance),
                          pair.scale_b};
      // A stopped query is divided too.
      const PenetrationSettings settings = {.max_visits =
                                                i % 3 == 0 ? 5u * static_cast<unsigned>(i) : 0};
      const Penetration whole = penetration(a, b, settings, workspace);
      expect_shares(pair.name, contact_patches(a, b, settings, workspace, patches), whole, patches);
    }
  }
}

void expect_no_normals(const PlacedShape& a, const PlacedAsset& b,
                       const ContactSettings& settings) {
  Workspace workspace;
  ContactPatch patches[8];
  const ContactPatches got = contact_patches(a, b, settings, workspace, patches);
  ASSERT_GT(got.count, 0u);
  for (const ContactPatch& patch : std::span(patches).first(got.count)) {
    EXPECT_EQ(patch.area, 0);
    EXPECT_EQ(patch.depth, 0);
    EXPECT_EQ(patch.normal, Vector3d::Zero());
    EXPECT_GT(patch.volume, 0);
  }
}

TEST(FieldQuery, PatchesInsideHaveNoNormal) {
  std::mt19937_64 random(29);
  for (int i = 0; i < 20; ++i) {
    const PlacedShape box{BoxShape{Vector3d(2, 2, 2)}, random_pose(random, 0.3), 1.7};
    expect_no_normals(box, {cube().view(), box.pose, 0.05 + 0.01 * i}, {});
  }
}

}  // namespace
}  // namespace ist
