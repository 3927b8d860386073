#include <gtest/gtest.h>
#include <ist/query.h>
#include <ist/time_of_impact.h>

#include <cmath>
#include <limits>
#include <set>
#include <thread>

#include "support/float_traps.h"
#include "support/query_settings.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"

namespace ist {
namespace {

using testing::make_random_asset;
using testing::random_pose;

/// Every promise about the patches of one query.
void expect_patches(const PlacedAsset& a, const PlacedAsset& b, const PenetrationSettings& settings,
                    std::size_t most, Workspace& workspace) {
  const Penetration whole = penetration(a, b, settings, workspace);
  std::vector<ContactPatch> patches(most);
  const ContactPatches found = contact_patches(a, b, settings, workspace, patches);
  EXPECT_EQ(found.penetration.volume, whole.volume);
  EXPECT_EQ(found.penetration.volume_max, whole.volume_max);
  EXPECT_EQ(found.penetration.force, whole.force);
  EXPECT_EQ(found.penetration.torque, whole.torque);
  EXPECT_EQ(found.penetration.status, whole.status);
  ASSERT_LE(found.count, most);
  EXPECT_EQ(found.count > 0, most > 0 && whole.volume > 0);
  if (found.count == 0) return;
  patches.resize(found.count);

  std::set<std::uint64_t> ids;
  double volume = 0, force_scale = 0, torque_scale = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const ContactPatch& patch : patches) {
    ids.insert(patch.id);
    volume += patch.volume;
    force += patch.force;
    torque += patch.torque;
    moment += patch.volume * (patch.centroid - whole.centroid);
    force_scale += patch.force.norm();
    torque_scale += patch.torque.norm();
    EXPECT_GE(patch.volume, 0);
    EXPECT_NEAR(patch.area, patch.force.norm(), 1e-15 * patch.area);
    EXPECT_TRUE(patch.centroid.allFinite());
    if (patch.area > 0) {
      EXPECT_NEAR(patch.normal.norm(), 1, 1e-14);
      EXPECT_GT(patch.normal.dot(patch.force), 0);
      EXPECT_LE(patch.depth * patch.area, patch.volume * (1 + 1e-14));
    } else {
      EXPECT_EQ(patch.normal, Eigen::Vector3d::Zero());
      EXPECT_EQ(patch.depth, 0);
    }
  }
  EXPECT_EQ(ids.size(), patches.size()) << "ids of one query differ";
  EXPECT_NEAR(volume, whole.volume, 1e-14 * whole.volume);
  EXPECT_LE((force - whole.force).norm(), 1e-14 * force_scale);
  EXPECT_LE((torque - whole.torque).norm(), 1e-14 * torque_scale);
  if (whole.status == QueryStatus::ok) {
    EXPECT_LE(moment.norm(), 1e-6 * whole.volume);
  }
}

TEST(ContactPatchesTest, SumToTheWhole) {
  Workspace workspace, small(64);
  std::mt19937_64 random(1);
  for (const std::size_t n : {1u, 16u, 40u, 900u}) {
    const Asset a = make_random_asset({n, 0.1, {1, 2, 3}, 2}, 10);
    const Asset b = make_random_asset({n / 2 + 1, 0.3, {}, 0}, 11);
    for (int i = 0; i < 24; ++i) {
      PenetrationSettings settings;
      settings.measure = i % 2 == 0 ? Measure::matched : Measure::inner;
      if (i % 4 == 1) settings.max_visits = 1 + 3 * static_cast<std::uint32_t>(i);
      const PlacedAsset pa{a.view(), random_pose(random, 0.1 * i), 1.0};
      const PlacedAsset pb{b.view(), random_pose(random, 0.2 * i), i % 3 == 0 ? 0.01 : 3.0};
      for (const std::size_t most : {1u, 2u, 5u, 64u}) {
        SCOPED_TRACE(::testing::Message() << n << " spheres, pose " << i << ", " << most);
        expect_patches(pa, pb, settings, most, i % 5 == 4 ? small : workspace);
        expect_patches(pb, pa, settings, most, i % 5 == 4 ? small : workspace);
      }
    }
  }
}

TEST(ContactPatchesTest, SumOfGrazingSpheresIsTakenAgainInDouble) {
  // One lens so thin that float is not enough: the patches have to be those of the second sum.
  Workspace workspace;
  const Asset one = make_random_asset({1, 1, {}, 0}, 13);
  const PlacedAsset pa{one.view(), {}, 1.0};
  PlacedAsset pb = pa;
  const double r = testing::world_spheres(pa, Measure::matched)[0].r;
  pb.pose.t[0] = 2 * r * (1 - 1e-6);
  expect_patches(pa, pb, {}, 4, workspace);
  const testing::ReferenceSum sum = testing::reference_sum(pa, pb, Measure::matched);
  ContactPatch patch;
  ASSERT_EQ(contact_patches(pa, pb, {}, workspace, {&patch, 1}).count, 1u);
  EXPECT_NEAR(patch.volume, sum.volume, 1e-5 * sum.volume);
  EXPECT_NEAR(patch.area, sum.force.norm(), 1e-5 * patch.area);
  // Two equal balls: V = A·δ/2 to first order, for overlap δ.
  EXPECT_NEAR(patch.depth, 0.5 * 2e-6 * r, 1e-4 * 2e-6 * r);
}

/// An asset of these spheres, inner and matched.
Asset make_asset(const std::vector<Sphere>& spheres) {
  AssetArrays arrays;
  arrays.inner_spheres = arrays.matched_spheres = spheres;
  for (const Sphere& s : spheres) arrays.cover_radii.push_back(2 * s.r);
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.matched_spheres, {});
  arrays.header.volume = arrays.matched_tree.volume_sum;
  return Asset(asset_bytes(arrays), "made-up asset");
}

TEST(ContactPatchesTest, TellSeparateContactsApart) {
  // Two clumps about x = ±2 are pressed outward by a ball between them: forces that cancel unless
  // they are told apart.
  std::vector<Sphere> clumps;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
  for (int i = 0; i < 400; ++i)
    clumps.push_back(
        {uniform(random) + (i < 208 ? 2 : -2), uniform(random), uniform(random), 0.1f});
  const Asset bell = make_asset(clumps);
  const Asset ball = make_asset({{0, 0, 0, 2}});
  const PlacedAsset pa{ball.view(), {}, 1.0}, pb{bell.view(), {}, 1.0};
  Workspace workspace;
  std::vector<ContactPatch> patches(2);
  ASSERT_EQ(contact_patches(pa, pb, {}, workspace, patches).count, 2u);
  EXPECT_LT(patches[0].centroid.x() * patches[1].centroid.x(), 0);
  for (const ContactPatch& patch : patches) {
    EXPECT_NEAR(std::abs(patch.centroid.x()), 1.75, 0.2);
    EXPECT_GT(patch.normal.dot(patch.centroid.normalized()), 0.95);
  }
  ContactPatch one;
  ASSERT_EQ(contact_patches(pa, pb, {}, workspace, {&one, 1}).count, 1u);
  EXPECT_LT(one.area, 0.2 * patches[0].area);
}

TEST(ContactPatchesTest, AreEqualAndOppositeOnA) {
  Workspace workspace;
  std::mt19937_64 random(7);
  const Asset a = make_random_asset({500, 0.2, {}, 0}, 50);
  const Asset b = make_random_asset({200, 0.2, {}, 0}, 51);
  std::vector<ContactPatch> ab(8), ba(8);
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset pa{a.view(), random_pose(random, 0.5), 1.0};
    const PlacedAsset pb{b.view(), random_pose(random, 0.1 * i), 0.3};
    const std::size_t count = contact_patches(pa, pb, {}, workspace, ab).count;
    ASSERT_EQ(contact_patches(pb, pa, {}, workspace, ba).count, count);
    const double scale = testing::reference_sum(pa, pb, Measure::matched).force_scale;
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_EQ(ab[k].id, ba[k].id);
      EXPECT_LE((ab[k].force + ba[k].force).norm(), 1e-5 * scale);
      EXPECT_LE((ab[k].centroid - ba[k].centroid).norm(), 1e-3 * 0.3);
    }
  }
}

TEST(ContactPatchesTest, KeepTheirNamesUnderSmallMotions) {
  Workspace workspace;
  std::mt19937_64 random(8);
  const Asset a = make_random_asset({700, 0.2, {}, 0}, 60);
  const Asset b = make_random_asset({700, 0.2, {}, 0}, 61);
  std::vector<ContactPatch> here(8), there(8);
  int patches = 0, kept = 0;
  for (int i = 0; i < 100; ++i) {
    const PlacedAsset pa{a.view(), random_pose(random, 0.2), 1.0};
    PlacedAsset pb{b.view(), random_pose(random, 0.018 * i), 0.7};
    const std::size_t count = contact_patches(pa, pb, {}, workspace, here).count;
    pb.pose.t[0] += 1e-5;
    const std::size_t count_there = contact_patches(pa, pb, {}, workspace, there).count;
    for (std::size_t k = 0; k < count; ++k, ++patches)
      for (std::size_t l = 0; l < count_there; ++l)
        if (here[k].id == there[l].id) {
          ++kept;
          EXPECT_LE((here[k].centroid - there[l].centroid).norm(), 1e-3);
        }
  }
  EXPECT_GT(patches, 400);
  EXPECT_GE(kept, 0.98 * patches);
}

TEST(ContactPatchesTest, LargeTreesAreBinnedByLargerNodes) {
  Workspace workspace;
  AssetArrays arrays;  // a lattice in its own order: clustering it would take a while
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < 42 * 40 * 40; ++i) {
    const auto at = [](std::uint32_t k) { return 0.04f * static_cast<float>(k) - 0.8f; };
    arrays.inner_spheres.push_back({at(i / 1600), at(i / 40 % 40), at(i % 40), 0.019f});
    arrays.cover_radii.push_back(0.04f);
    order.push_back(i);
  }
  arrays.matched_spheres = arrays.inner_spheres;
  arrays.inner_tree = tree_from_order(arrays.inner_spheres, arrays.cover_radii, order);
  arrays.matched_tree = tree_from_order(arrays.matched_spheres, {}, order);
  arrays.header.volume = arrays.matched_tree.volume_sum;
  const Asset a(asset_bytes(arrays), "lattice");
  const Asset b = make_random_asset({100, 0.5, {}, 0}, 71);
  const PlacedAsset pa{a.view(), {}, 1.0}, pb{b.view(), {{1, 0, 0, 0}, {2, 0.1, 0}}, 1.5};
  expect_patches(pa, pb, {}, 16, workspace);
  PenetrationSettings stopped;
  stopped.max_visits = 40;
  expect_patches(pa, pb, stopped, 16, workspace);
}

TEST(ContactPatchesTest, RefusesWhatPenetrationRefuses) {
  Workspace workspace;
  const Asset a = make_random_asset({20, 0.5, {}, 0}, 90);
  PlacedAsset bad{a.view(), {}, 1.0};
  bad.pose.t[1] = std::numeric_limits<double>::quiet_NaN();
  ContactPatch patch;
  const ContactPatches answer = contact_patches({a.view(), {}, 1}, bad, {}, workspace, {&patch, 1});
  EXPECT_EQ(answer.count, 0u);
  EXPECT_EQ(answer.penetration.status, QueryStatus::invalid_input);
  EXPECT_TRUE(std::isnan(answer.penetration.volume));
  // Neither asset has a mesh.
  const PlacedAsset placed{a.view(), {}, 1};
  const ContactPatches exact =
      contact_patches(placed, placed, {.measure = Measure::exact}, workspace, {&patch, 1});
  EXPECT_EQ(exact.penetration.status, QueryStatus::missing_data);
  EXPECT_EQ(exact.count, 0u);
}

TEST(ContactPatchesTest, RefusesNumbersThatNameNothingAndNoCapacity) {
  Workspace workspace;
  const Asset a = make_random_asset({20, 0.5, {}, 0}, 90);
  const PlacedAsset placed{a.view(), {}, 1}, other{a.view(), {{1, 0, 0, 0}, {0.3, 0, 0}}, 1};
  ContactPatch patch;
  const PenetrationSettings settings{.measure = Measure{77}};
  const Penetration whole = penetration(placed, other, settings, workspace);
  EXPECT_EQ(whole.status, QueryStatus::invalid_input);
  EXPECT_TRUE(std::isnan(whole.volume));
  EXPECT_EQ(contact_patches(placed, other, settings, workspace, {&patch, 1}).penetration.status,
            QueryStatus::invalid_input);
  const ContactPatches none = contact_patches(placed, other, {}, workspace, {});
  EXPECT_EQ(none.penetration.status, QueryStatus::invalid_input);
  EXPECT_TRUE(std::isnan(none.penetration.volume));
  const testing::NoFloatTraps not_trapped;
  for (const double bad : {-1.0, -1e-300, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(penetration(placed, other, {.relative_error = bad}, workspace).status,
              QueryStatus::invalid_input);
    EXPECT_EQ(contact_patches(placed, other, {.relative_error = bad}, workspace, {&patch, 1})
                  .penetration.status,
              QueryStatus::invalid_input);
    EXPECT_EQ(separation(placed, other, {.max_distance = bad}, workspace).status,
              QueryStatus::invalid_input);
    EXPECT_EQ(
        time_of_impact(placed, other, {}, {.duration = 1, .tolerance = bad}, workspace).status,
        QueryStatus::invalid_input);
  }
}

#ifndef NDEBUG
TEST(WorkspaceDeathTest, TwoThreadsInOneAreSaid) {
  Workspace workspace;
  const Asset a = make_random_asset({20, 0.5, {}, 0}, 90);
  const PlacedAsset placed{a.view(), {}, 1};
  // A field that runs on another thread the query that its own query runs on this one.
  struct Both {
    Workspace& workspace;
    PlacedAsset placed;
  } both{workspace, placed};
  const FunctionShape field{
      [](const void* context, const Eigen::Vector3d&) noexcept {
        const auto& asked = *static_cast<const Both*>(context);
        std::thread([&] { penetration(asked.placed, asked.placed, {}, asked.workspace); }).join();
        return ShapeSample{-1, Eigen::Vector3d::UnitX()};
      },
      &both, 0};
  EXPECT_DEATH(penetration(PlacedShape{field, {}}, placed, {}, workspace), "two threads use one");
}
#endif

}  // namespace
}  // namespace ist
