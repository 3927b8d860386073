#include <gtest/gtest.h>
#include <ist/query.h>
#include <ist/types.h>

#include <algorithm>
#include <new>
#include <random>
#include <vector>

#include "support/answer_bits.h"
#include "support/baked.h"
#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

/// Address space of a workspace.
std::size_t bytes_of(std::size_t capacity) {
  std::size_t taken = 0;
  Workspace workspace(capacity, {[](void* bytes, std::size_t size, std::size_t alignment) {
                                   *static_cast<std::size_t*>(bytes) += size;
                                   return ::operator new(size, std::align_val_t(alignment));
                                 },
                                 [](void*, void* memory, std::size_t, std::size_t alignment) {
                                   ::operator delete(memory, std::align_val_t(alignment));
                                 },
                                 &taken});
  return taken;
}

/// Every answer that a capacity may stop, and whether it did.
class Answers {
 public:
  Answers(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace) {
    std::vector<ContactPatch> patches(16);
    for (const Measure measure : {Measure::matched, Measure::inner})
      for (const std::uint32_t budget : {0u, 500u}) {
        const PenetrationSettings settings = {
            .measure = measure, .spheres_only = true, .pair_budget = budget};
        add(penetration(a, b, settings, workspace));
        const ContactPatches contact = contact_patches(a, b, settings, workspace, patches);
        add(contact.penetration);
        for (std::size_t i = 0; i < contact.count; ++i) bits_.add(patches[i]);
      }
    for (const bool spheres : {false, true}) add(separation(a, b, {0, spheres}, workspace));
    bits_.add(static_cast<std::uint64_t>(overlap(a, b, workspace).answer));
  }

  std::uint64_t bits() const { return bits_.value(); }
  int stopped() const { return stopped_; }

 private:
  template <class Answer>
  void add(const Answer& answer) {
    stopped_ += answer.status == QueryStatus::budget_exhausted;
    bits_.add(answer);
  }

  testing::AnswerBits bits_;
  int stopped_ = 0;
};

class WorkspaceCapacity : public ::testing::Test {
 protected:
  void expect_enough(const PlacedAsset& a, const PlacedAsset& b) {
    Workspace enough(workspace_capacity(a, b)), little(64);
    std::mt19937_64 random(3);
    const double reach = std::min(a.scale, b.scale);
    for (int i = 0; i < 8; ++i) {
      PlacedAsset moved = b;
      if (i > 0) moved.pose = testing::random_pose(random, i < 4 ? 0.0 : 0.1 * reach * i);
      const Answers found(a, moved, enough);
      EXPECT_EQ(found.stopped(), 0) << i;
      EXPECT_EQ(found.bits(), Answers(a, moved, ample_).bits()) << i;
      too_little_ += Answers(a, moved, little).stopped();
    }
  }

  Workspace ample_;
  int too_little_ = 0;
};

TEST_F(WorkspaceCapacity, ServesEveryPose) {
  std::vector<Asset> assets;
  assets.push_back(testing::make_random_asset({.spheres = 10'000, .details = 2}, 1));
  assets.push_back(testing::make_random_asset({.spheres = 300, .smallest = 0.02}, 2));
  assets.push_back(testing::baked(testing::torus_mesh(0.7, 0.3, 150, 80), "torus", 3000));
  assets.push_back(testing::baked(testing::cube_mesh(), "cube", 40));
  for (std::size_t i = 0; i < assets.size(); ++i)
    for (std::size_t k = i; k < assets.size(); ++k)
      for (const double scale : {1.0, 0.2})
        expect_enough({assets[i].view(), {}, 1}, {assets[k].view(), {}, scale});
  EXPECT_GT(too_little_, 500);
}

TEST_F(WorkspaceCapacity, ServesFields) {
  const Asset ball = testing::make_random_asset({.spheres = 30'000}, 4);
  const PlacedAsset tree{ball.view(), {}, 1};
  for (const double scale : {0.3, 1.0, 10.0}) {
    const PlacedShape placed{BoxShape{{1, 1, 1}}, {}, scale};
    EXPECT_EQ(workspace_capacity(placed, tree), workspace_capacity(tree, placed));
    Workspace enough(workspace_capacity(placed, tree));
    EXPECT_EQ(Answers(placed, tree, enough).stopped(), 0);
    EXPECT_EQ(Answers(tree, placed, enough).bits(), Answers(tree, placed, ample_).bits());
  }
}

TEST_F(WorkspaceCapacity, IsSmallForSmallTreesAndKnowsPosesNot) {
  const Asset small = testing::make_random_asset({.spheres = 500}, 5);
  const Asset large = testing::make_random_asset({.spheres = 20'000}, 6);
  const Pose far = {{0, 1, 0, 0}, {7, 8, 9}};
  const PlacedAsset one{small.view(), {}, 1}, other{large.view(), {}, 1};
  EXPECT_LT(20 * bytes_of(workspace_capacity(one, one)) / 3, bytes_of(1 << 20));
  EXPECT_LT(workspace_capacity(other, other), 1u << 18);
  EXPECT_EQ(workspace_capacity({large.view(), far, 2}, {small.view(), {}, 1}),
            workspace_capacity({small.view(), far, 1}, {large.view(), far, 2}));
  // The number of bytes in the documentation of Workspace.
  for (const std::size_t capacity : {4096, 1 << 16, 1 << 20})
    EXPECT_NEAR(static_cast<double>(bytes_of(capacity)), 9e6 + 173 * static_cast<double>(capacity),
                0.5e6);
}

TEST_F(WorkspaceCapacity, RefusesWhatNoQueryTakes) {
  const Asset asset = testing::make_random_asset({.spheres = 30}, 7);
  const PlacedAsset tree{asset.view(), {}, 1};
  const PlacedShape ball{BallShape{1}, {}, 1};
  EXPECT_THROW(workspace_capacity(tree, PlacedAsset{}), Error);
  EXPECT_THROW(workspace_capacity(tree, PlacedAsset{asset.view(), {}, 0}), Error);
  EXPECT_THROW(workspace_capacity(tree, PlacedShape{ball.shape, {}, -1}), Error);
  EXPECT_THROW(workspace_capacity(ball, ball), Error);
  const Asset bare = bake_mesh_only(close_mesh(testing::box_mesh({0, 0, 0}, {1, 1, 1}), "box"));
  const PlacedAsset mesh{bare.view(), {}, 1};
  EXPECT_THROW(workspace_capacity(mesh, tree), Error);
  EXPECT_THROW(workspace_capacity(tree, mesh), Error);
  EXPECT_THROW(workspace_capacity(ball, mesh), Error);
}

}  // namespace
}  // namespace ist
