// Nothing inside a query may wait: every path to the heap, to a lock and to the system is trapped
// while queries of all kinds run, and every trap is shown to spring.
#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/c.h>
#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/scene.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <vector>

#include "support/query_settings.h"
#include "support/random_assets.h"
#include "support/real_time_traps.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using testing::Trapped;

class RealTime : public ::testing::Test {
 protected:
  /// One query of each kind, at a pose that depends on `i`.
  void ask(int i, const PenetrationSettings& settings) {
    const PlacedAsset a{a_.view(), poses_a_[i], 1.0};
    const PlacedAsset b{b_.view(), poses_b_[i], i % 3 == 0 ? 0.01 : 1.0};
    volume_[i] = penetration(a, b, settings, workspaces_[0]).volume;
    separation(a, b, testing::for_separation(settings), workspaces_[0]);
    overlap(a, b, workspaces_[0]);
    query(a, b, testing::for_both(settings), workspaces_[0]);
    contact_patches(a, b, settings, workspaces_[0], patches_);
    const PlacedPair pairs[] = {{a, b}, {b, a}};
    penetration_batch(pairs, settings, workspaces_, answers_);

    // The C functions.
    const ist_placed_t c_a = {sizeof c_a, &c_tree_a_, nullptr, std::bit_cast<ist_pose_t>(a.pose),
                              1};
    const ist_placed_t c_b = {sizeof c_b, &c_tree_b_, nullptr, std::bit_cast<ist_pose_t>(b.pose),
                              1};
    ist_penetration_t c_penetration = {};
    ist_separation_t c_separation = {};
    c_penetration.size = sizeof c_penetration;
    c_separation.size = sizeof c_separation;
    if (ist_query(&c_a, &c_b, nullptr, nullptr, &c_workspace_, &c_penetration, &c_separation) < 0)
      ADD_FAILURE() << ist_describe(c_penetration.status);

    // Queries of a surface: a field and a tree, and trees by the surface of either.
    const PlacedShape field{fields_[static_cast<std::size_t>(i) % fields_.size()], poses_a_[i], 1};
    volume_[i] += penetration(field, b, settings, workspaces_[0]).volume;
    query(field, b, testing::for_both(settings), workspaces_[0]);
    contact_patches(field, b, settings, workspaces_[0], patches_);
    const PlacedPair field_pairs[] = {{field, b}, {a, field}};
    penetration_batch(field_pairs, settings, workspaces_, answers_);
    // Many bodies, some of which move; what a step finds depends on `settings` by its measure.
    for (std::uint32_t k = 0; k < kBodies; k += 1 + static_cast<std::uint32_t>(i) % 7)
      scene_.set_pose(k, poses_b_[(i + static_cast<int>(k)) % kPoses]);
    volume_[i] += static_cast<double>(scene_.step().pairs.size());
    scene_.raycast(Ray{{0, 0, 0}, {1, 2, 3}});
    const Motions motions{{{0.1, 0.2, 0}, {1, 0, 2}, {}}, {{-1, 0, 1}, {0, 1, 0}, {0.1, 0, 0}}};
    ImpactSettings until;
    until.max_visits = settings.max_visits != 0 ? settings.max_visits : 3000;
    time_of_impact(a, b, motions, until, workspaces_[0]);
    time_of_impact(field, b, motions, until, workspaces_[0]);
    const PlacedAsset solid{box_.view(), poses_a_[i], 1.0};
    const PlacedAsset other{box_.view(), poses_b_[(i + 20) % kPoses], 1.0};
    // Queries of meshes: across, in place, and with little memory.
    PenetrationSettings exact = settings;
    exact.measure = Measure::exact;
    const PlacedAsset ball{ball_.view(), poses_b_[i], 1.0};
    volume_[i] += penetration(solid, ball, exact, workspaces_[0]).volume_max;
    penetration(solid, solid, exact, workspaces_[0]);
    penetration(ball, ball, exact, small_);
    separation(solid, ball, testing::for_separation(settings), workspaces_[0]);
    separation(ball, ball, testing::for_separation(settings), small_);
    const Eigen::Vector3d at(b.pose.t[0], b.pose.t[1], b.pose.t[2]);
    raycast(solid, Ray{at, {1, 2, 3}});
    closest_point(ball, at);
    contains(ball, at);
    raycast(field, Ray{at, {1, 2, 3}});
    closest_point(field, at);
    time_of_impact(solid, other, motions, until, workspaces_[0]);
    time_of_impact(field, other, motions, until, workspaces_[0]);
    for (const double scale : {1.0, 0.1}) {  // where spheres answer, and where meshes do
      const PlacedAsset small{box_.view(), b.pose, scale};
      volume_[i] += penetration(solid, small, settings, workspaces_[0]).volume +
                    penetration(small, solid, settings, workspaces_[0]).volume;
      contact_patches(solid, small, settings, workspaces_[0], patches_);
    }
  }

  static ShapeSample sample(const void*, const Eigen::Vector3d& x) noexcept {
    return {x.z() - 0.2, Eigen::Vector3d::UnitZ()};
  }

  static constexpr int kPoses = 40;
  const Asset a_ = testing::make_random_asset({600, 0.2, {}, 0, 2}, 1);
  const Asset b_ = testing::make_random_asset({600, 0.2, {}, 0, 1}, 2);
  const Asset box_ = bake(close_mesh(testing::cube_mesh(), "cube"), {.max_spheres = 60});
  const Asset ball_ = bake_mesh_only(close_mesh(testing::icosphere_mesh(4), "ball"));
  const std::vector<float> numbers_ = std::vector<float>(125, 0.1f);
  const std::vector<Shape> fields_ = {
      HalfSpaceShape{},
      BoxShape{{0.5, 0.4, 0.05}},
      BallShape{0.6},
      CapsuleShape{0.4, 0.4},
      CylinderShape{0.4, 0.4},
      HeightFieldShape{numbers_.data(), 5, 5, {0.3, 0.3}},
      DistanceGridShape{numbers_.data(), {5, 5, 5}, Eigen::Vector3d::Constant(-1), 0.5, 0},
      FunctionShape{sample, nullptr, 0}};
  Workspace workspaces_[1], small_{16};
  ist_workspace_t c_workspace_ = {};
  ist_asset_t c_tree_a_ = {}, c_tree_b_ = {};
  ContactPatch patches_[8];
  Penetration answers_[2];
  double volume_[kPoses] = {};
  Pose poses_a_[kPoses], poses_b_[kPoses];

  static constexpr std::uint32_t kBodies = 20;
  Scene scene_{{.max_bodies = kBodies, .max_pairs = 400}};

  RealTime() {
    SceneRule rule;
    rule.margin = 0.1;
    scene_.set_rule(0, 1, rule);
    rule.answer = SceneAnswer::patches;
    scene_.set_rule(0, 0, rule);
    rule.penetration.measure = Measure::exact;
    scene_.set_rule(1, 1, rule);
    for (std::uint32_t k = 0; k < kBodies; ++k) {
      SceneBody body;
      body.number = k;
      body.group = k % 2;
      const Shape floor = HalfSpaceShape{{0, 0, 1}, -0.5};
      body.solid = k == 0       ? PlacedSolid(floor, Pose{})
                   : k % 4 == 1 ? PlacedSolid(ball_.view(), Pose{})
                                : PlacedSolid(k % 4 == 3 ? box_.view() : a_.view(), Pose{});
      scene_.add(body);
    }
    ist_workspace_make(0, nullptr, &c_workspace_);
    ist_asset_view(a_.bytes().data(), a_.bytes().size(), &c_tree_a_);
    ist_asset_view(b_.bytes().data(), b_.bytes().size(), &c_tree_b_);
    std::mt19937_64 random(4);
    for (int i = 0; i < kPoses; ++i) {
      poses_a_[i] = testing::random_pose(random, 0.0);
      poses_b_[i] = testing::random_pose(random, 0.06 * i);
    }
  }
  ~RealTime() override { ist_workspace_release(&c_workspace_); }
};

// The first one, so that it covers a process's first query.
TEST_F(RealTime, QueriesMakeNoSystemCall) {
  if (!testing::kTrapsWork) GTEST_SKIP() << "the sanitizer owns the traps";
  const auto all = [&] {
    for (int i = 0; i < kPoses; ++i) {
      PenetrationSettings settings;
      if (i % 3 == 1) settings.max_visits = 40;
      if (i % 3 == 2) settings.relative_error = 0.1;
      if (i % 2 == 1) settings.pair_budget = 200;
      ask(i, settings);
    }
  };
  const testing::SystemCall none = testing::first_system_call(all);
  if (!none.watched) GTEST_SKIP() << "this system has no seccomp filters";
  EXPECT_EQ(none.number, -1) << "system call " << none.number << " inside a query";

  // The filter sees what a query might do by accident.
  const auto sees = [](auto violation) { return testing::first_system_call(violation).number; };
  EXPECT_NE(sees([] { std::this_thread::yield(); }), -1);
  EXPECT_NE(sees([] { std::fputs("a query may not print\n", stderr); }), -1);
  void* volatile kept = nullptr;
  EXPECT_NE(sees([&] { kept = std::malloc(std::size_t{1} << 30); }), -1);
}

TEST_F(RealTime, QueriesTouchNeitherHeapNorLock) {
  if (!testing::kTrapsWork) GTEST_SKIP() << "the sanitizer owns the traps";
  for (int i = 0; i < kPoses; ++i) {
    PenetrationSettings settings;
    if (i % 4 == 1) settings.max_visits = 40;
    if (i % 4 == 2) settings.relative_error = 0.1;
    if (i % 5 >= 3) settings.pair_budget = 200;
    const Trapped trapped = testing::trapped_by([&] { ask(i, settings); });
    EXPECT_EQ(trapped.heap, 0) << "pose " << i;
    EXPECT_EQ(trapped.locks, 0) << "pose " << i;
  }
  int overlapping = 0;
  for (const double volume : volume_) overlapping += volume > 0 ? 1 : 0;
  EXPECT_GT(overlapping, kPoses / 2) << "the poses ask for no work";
}

TEST_F(RealTime, EveryTrapSprings) {
  if (!testing::kTrapsWork) GTEST_SKIP() << "the sanitizer owns the traps";
  void* volatile kept = nullptr;  // or the compiler leaves the pair out
  const auto heap = [&](auto get) {
    const Trapped trapped = testing::trapped_by([&] { kept = get(); });
    std::free(kept);
    return trapped.heap;
  };
  EXPECT_GT(heap([] { return std::malloc(8); }), 0);
  EXPECT_GT(heap([] { return std::calloc(2, 8); }), 0);
  EXPECT_GT(heap([] { return std::realloc(nullptr, 8); }), 0);
  EXPECT_GT(heap([] { return std::aligned_alloc(64, 64); }), 0);
  EXPECT_GT(heap([] {
              void* p = nullptr;
              return posix_memalign(&p, 64, 64) == 0 ? p : nullptr;
            }),
            0);
  EXPECT_GT(heap([] { return ::operator new(8); }), 0);
  EXPECT_GT(heap([] { return ::operator new(64, std::align_val_t(64)); }), 0);
  kept = std::malloc(8);
  EXPECT_GT(testing::trapped_by([&] { std::free(kept); }).heap, 0);

  std::mutex mutex;
  std::shared_mutex shared;
  std::condition_variable condition;
  std::once_flag once;
  pthread_spinlock_t spin;
  sem_t semaphore;
  pthread_spin_init(&spin, 0);
  sem_init(&semaphore, 0, 1);
  const auto locks = [](auto use) { return testing::trapped_by(use).locks; };
  EXPECT_GT(locks([&] { std::lock_guard lock(mutex); }), 0);
  EXPECT_GT(locks([&] {
              if (mutex.try_lock()) mutex.unlock();
            }),
            0);
  EXPECT_GT(locks([&] { std::unique_lock lock(shared); }), 0);
  EXPECT_GT(locks([&] { std::shared_lock lock(shared); }), 0);
  EXPECT_GT(locks([&] { condition.notify_one(); }), 0);
  EXPECT_GT(locks([&] { condition.notify_all(); }), 0);
  EXPECT_GT(locks([&] { std::call_once(once, [] {}); }), 0);
  EXPECT_GT(locks([&] { pthread_spin_lock(&spin), pthread_spin_unlock(&spin); }), 0);
  EXPECT_GT(locks([&] { sem_wait(&semaphore), sem_post(&semaphore); }), 0);
  EXPECT_GT(locks([&] { static const std::string text(std::to_string(spin)); }), 0)
      << "the guard of a local static";
}

}  // namespace
}  // namespace ist
