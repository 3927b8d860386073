#include <gtest/gtest.h>
#include <ist/query.h>

#include <numbers>
#include <span>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"
#include "query/kernel/lens.h"
#include "query/kernel/node_kernel.h"
#include "query/lod/level_chain.h"
#include "support/random_assets.h"
#include "support/reference_sum.h"

// Answers under a pair budget: levels of detail, blended.

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::make_random_asset;
using testing::random_pose;
using testing::reference_sum;
using testing::ReferenceSum;

/// A turn by a small rotation vector about the origin of the pose, and a shift.
Pose moved(const Pose& pose, const Vector3d& shift, const Vector3d& turn) {
  const Eigen::Quaterniond q(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
  const double angle = turn.norm();
  const Eigen::Quaterniond r(angle > 0 ? Eigen::AngleAxisd(angle, turn / angle)
                                       : Eigen::AngleAxisd::Identity());
  const Eigen::Quaterniond both = r * q;
  Pose result = {{both.w(), both.x(), both.y(), both.z()}, {}};
  for (int k = 0; k < 3; ++k) result.t[k] = pose.t[k] + shift[k];
  return result;
}

class QueryDetails : public ::testing::Test {
 protected:
  const Asset a_ = make_random_asset({1600, 0.3, {0.1, 0, 0}, 1, 3}, 1);
  const Asset b_ = make_random_asset({700, 0.3, {0, 0.2, 0}, 0, 2}, 2);
  Workspace workspace_;
  std::mt19937_64 random_{5};

  PlacedAsset placed_a() { return {a_.view(), random_pose(random_, 0.2), 1.0}; }
  PlacedAsset placed_b(double distance, double scale = 1.6) {
    return {b_.view(), random_pose(random_, distance), scale};
  }
  Penetration ask(const PlacedAsset& a, const PlacedAsset& b, std::uint32_t budget) {
    return penetration(a, b, {.pair_budget = budget}, workspace_);
  }

  static LevelChain chain_of(const PlacedAsset& a, const PlacedAsset& b) {
    return {a.asset.header(), b.asset.header(),
            std::ldexp(b.scale / a.scale, b.asset.header().exponent - a.asset.header().exponent)};
  }
  static double unit3(const PlacedAsset& a) {
    return std::pow(std::ldexp(a.scale, a.asset.header().exponent), 3);
  }

  /// The coarsest trees of both.
  static std::array<SphereTree, 2> coarsest(const PlacedAsset& a, const PlacedAsset& b) {
    const LevelPair pair = chain_of(a, b).coarsest();
    return {SphereTree(a.asset.header(), matched_tree(a.asset.header(), pair.a)),
            SphereTree(b.asset.header(), matched_tree(b.asset.header(), pair.b))};
  }

  /// The coarse estimate of quick_look(), summed in double.
  static QuickLook look(const PlacedAsset& a, const PlacedAsset& b) {
    const auto [tree_a, tree_b] = coarsest(a, b);
    const Similarity map = relative_pose(a, b)->a_from_b;
    const auto fill = [](const NodeBall& ball, double volume) {
      return volume / (4 * std::numbers::pi / 3 * std::pow(ball.r, 3));
    };
    QuickLook sum;
    for (std::uint32_t j = 0; j < tree_b.count(0); ++j) {
      const NodeBall of_b = tree_b.ball(0, j);
      double centre[3];
      map.apply(of_b.centre, centre);
      for (std::uint32_t k = 0; k < tree_a.count(0); ++k) {
        const NodeBall of_a = tree_a.ball(0, k);
        const Vector3d between = Vector3d(centre) - Vector3d(of_a.centre);
        const Lens<double> both = lens(of_a.r, of_b.r * map.scale, between.norm());
        const double filled =
            fill(of_a, tree_a.sums(0, k).volume) * fill(of_b, tree_b.sums(0, j).volume);
        const Vector3d push = filled * both.derivative() * between.normalized();
        sum.volume += filled * both.volume();
        sum.slope.by_translation = sum.slope.by_translation + plain(push);
        sum.slope.by_rotation =
            sum.slope.by_rotation + cross(vec3(centre) - vec3(map.t), plain(push));
      }
    }
    return sum;
  }

  /// The blended sum over all pairs of spheres in double.
  static double reference(const PlacedAsset& a, const PlacedAsset& b, std::uint32_t budget) {
    const LevelChain chain = chain_of(a, b);
    const auto sum = [&](const LevelPair& pair) {
      return reference_sum(a, b, Measure::matched, pair.a, pair.b).volume;
    };
    const auto weights = chain.weights(sum(chain.coarsest()) / unit3(a), budget);
    const double sure = chain.quick_weight(look(a, b).volume, budget).weight;
    double volume = 0;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      const double weight = (i == 0 ? sure : 0) + (1 - sure) * weights[i].weight;
      if (weight > 0) volume += weight * sum(chain[i]);
    }
    return volume;
  }

  /// Volume, bounds and gradients against the reference and its differences.
  void expect_reference(const PlacedAsset& a, const PlacedAsset& b, std::uint32_t budget) {
    const double h = 1e-5;
    const Penetration answer = ask(a, b, budget);
    const double sum = reference(a, b, budget);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    EXPECT_NEAR(answer.volume, sum, 1e-5 * sum);
    EXPECT_LE(answer.volume_min, sum * (1 + 1e-12));
    EXPECT_GE(answer.volume_max, sum * (1 - 1e-12));
    Vector3d force, torque;
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = h * Vector3d::Unit(k);
      const auto at = [&](const Vector3d& shift, const Vector3d& turn) {
        return reference(a, {b.asset, moved(b.pose, shift, turn), b.scale}, budget);
      };
      force[k] = (at(step, {0, 0, 0}) - at(-step, {0, 0, 0})) / (2 * h);
      torque[k] = (at({0, 0, 0}, step) - at({0, 0, 0}, -step)) / (2 * h);
    }
    const double scale = reference_sum(a, b, Measure::matched).force_scale;
    EXPECT_LE((answer.force + force).norm(), 1e-4 * scale);
    EXPECT_LE((answer.torque + torque).norm(), 1e-4 * 3 * scale);
  }
};

TEST_F(QueryDetails, AnAmpleBudgetTakesTheFinestLevel) {
  for (int i = 0; i < 30; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.12 * i);
    const Penetration finest = ask(a, b, 0), ample = ask(a, b, 1u << 30);
    EXPECT_EQ(ample.volume, finest.volume);
    EXPECT_EQ(ample.force, finest.force);
    EXPECT_EQ(ample.torque, finest.torque);
    EXPECT_EQ(ample.volume_max, finest.volume_max);
    EXPECT_LT((ample.centroid - finest.centroid).norm(), 1e-12);
  }
}

TEST_F(QueryDetails, ATinyBudgetTakesTheCoarsestLevel) {
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.05 * i);
    const ReferenceSum coarsest = reference_sum(a, b, Measure::matched, 3, 2);
    const Penetration answer = ask(a, b, 1);
    EXPECT_NEAR(answer.volume, coarsest.volume, 1e-5 * coarsest.volume);
    EXPECT_EQ(answer.sphere_pairs, coarsest.lenses);
  }
}

TEST_F(QueryDetails, WeightsSumToOneAndFallWithTheCoarseEstimate) {
  const LevelChain chain = chain_of(placed_a(), placed_b(0));
  EXPECT_EQ(chain[0].a, 0u);
  EXPECT_EQ(chain[0].b, 0u);
  EXPECT_EQ(chain.coarsest().a, 3u);
  EXPECT_EQ(chain.coarsest().b, 2u);
  EXPECT_EQ(chain.weights(0, 100)[0].weight, 1);
  double before = 1;
  for (double coarse = 1e-9; coarse < 10; coarse *= 1.01) {
    const auto weights = chain.weights(coarse, 300);
    const auto further = chain.weights(coarse * (1 + 1e-6), 300);
    double sum = 0, slope = 0;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      sum += weights[i].weight;
      slope += weights[i].slope;
      EXPECT_GE(weights[i].weight, 0);
      const double difference = (further[i].weight - weights[i].weight) / (coarse * 1e-6);
      EXPECT_NEAR(weights[i].slope * coarse, difference * coarse, 1e-4);
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(slope * coarse, 0, 1e-9);
    EXPECT_LE(weights[0].weight, before);
    before = weights[0].weight;
  }
  EXPECT_EQ(before, 0);
}

/// From `least` on, the first budget under which two levels share an answer; 0 if there is none.
std::uint32_t sharing_budget(const LevelChain& chain, double coarse, std::uint32_t least) {
  for (std::uint32_t budget = least; budget < 10'000'000; budget += 1 + budget / 16)
    for (const LevelWeight& w : chain.weights(coarse, budget))
      if (w.weight > 0.2 && w.weight < 0.8) return budget;
  return 0;
}

TEST_F(QueryDetails, AnswerTheBlendedSumAndItsGradient) {
  int blended = 0;
  for (int i = 0; i < 24; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.13 * i);
    const LevelChain chain = chain_of(a, b);
    const double coarse =
        reference_sum(a, b, Measure::matched, chain.coarsest().a, chain.coarsest().b).volume;
    const std::uint32_t budget = sharing_budget(chain, coarse / unit3(a), 10u << (2 * (i % 6)));
    if (budget == 0) continue;
    ++blended;
    SCOPED_TRACE(i);
    expect_reference(a, b, budget);
  }
  EXPECT_GE(blended, 12) << "the poses blend nothing";
}

// A pose where the quick look gives the finest level half the weight, and the coarse estimate none.
TEST_F(QueryDetails, AnswerWhatAQuickLookBlendsAndItsGradient) {
  int blended = 0;
  for (int i = 0; i < 150 && blended < 12; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.02 * i);
    const LevelChain chain = chain_of(a, b);
    const double coarse =
        reference_sum(a, b, Measure::matched, chain.coarsest().a, chain.coarsest().b).volume;
    const double volume = look(a, b).volume;
    for (std::uint32_t budget = 10; budget < 10'000'000; budget += 1 + budget / 16) {
      const double sure = chain.quick_weight(volume, budget).weight;
      if (sure < 0.2 || sure > 0.8) continue;
      if (chain.weights(coarse / unit3(a), budget)[0].weight > 0.9) continue;
      ++blended;
      SCOPED_TRACE(i);
      expect_reference(a, b, budget);
      break;
    }
  }
  EXPECT_GE(blended, 12) << "the poses blend nothing";
}

TEST_F(QueryDetails, AQuickLookIsEvenlyFilledBallsAndHasTheirSlope) {
  for (int i = 0; i < 40; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.1 * i, i % 2 == 0 ? 1.6 : 0.05);
    const auto [tree_a, tree_b] = coarsest(a, b);
    const Similarity map = relative_pose(a, b)->a_from_b;
    const QuickLook sum = look(a, b), seen = quick_look(tree_a, tree_b, map, true);
    const double force = norm(sum.slope.by_translation);
    EXPECT_EQ(seen.volume, quick_look(tree_a, tree_b, map, false).volume);
    EXPECT_NEAR(seen.volume, sum.volume, 1e-5 * sum.volume);
    EXPECT_LE(norm(seen.slope.by_translation - sum.slope.by_translation), 1e-4 * force) << i;
    EXPECT_LE(norm(seen.slope.by_rotation - sum.slope.by_rotation), 1e-4 * force) << i;
  }
}

// Half the step, half the largest change: a jump would not shrink.
TEST_F(QueryDetails, NothingJumpsAlongAPath) {
  const PlacedAsset a{a_.view(), {}, 1.0};
  PlacedAsset b{b_.view(), random_pose(random_, 0), 1.6};
  const Vector3d direction = Vector3d(1, 0.3, -0.2).normalized();
  const auto largest_changes = [&](int steps, std::uint32_t budget) {
    double volume = 0, force = 0, torque = 0;
    Penetration before;
    for (int i = 0; i <= steps; ++i) {
      const double distance = 0.8 + 3.0 * i / steps;
      for (int k = 0; k < 3; ++k) b.pose.t[k] = distance * direction[k];
      const Penetration now = ask(a, b, budget);
      if (i > 0) {
        volume = std::max(volume, std::abs(now.volume - before.volume));
        force = std::max(force, (now.force - before.force).norm());
        torque = std::max(torque, (now.torque - before.torque).norm());
      }
      before = now;
    }
    return std::array{volume, force, torque};
  };
  for (const std::uint32_t budget : {100u, 400u, 2000u}) {
    const auto coarse = largest_changes(1000, budget), fine = largest_changes(4000, budget);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_LE(fine[k], 0.4 * coarse[k]) << budget << " " << k;
  }
}

// An overlap that the coarsest level misses is not lost.
TEST(QueryDetailsAlone, WithoutACoarseEstimateTheFinestAnswers) {
  // The finest reaches out to x = 1, the coarser level stops far short of it.
  AssetArrays arrays;
  for (int i = 0; i < 8; ++i) {
    const Sphere s = {static_cast<float>(i) / 4 - 0.9f, 0, 0, 0.15f};
    arrays.inner_spheres.push_back(s);
    arrays.matched_spheres.push_back(s);
    arrays.cover_radii.push_back(0.3f);
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.matched_spheres, {});
  arrays.details.resize(1);
  arrays.details[0].matched_spheres = {{-0.5f, 0, 0, 0.3f}, {-0.4f, 0, 0, 0.3f}};
  arrays.details[0].matched_tree = build_tree(arrays.details[0].matched_spheres, {});
  arrays.header.volume = arrays.matched_tree.volume_sum;
  const Asset asset(asset_bytes(arrays), "two levels");
  Workspace workspace;
  const PlacedAsset a{asset.view(), {}, 1}, b{asset.view(), {{0, 0, 0, 1}, {1.9, 0, 0}}, 1};
  const Penetration finest = penetration(a, b, {}, workspace);
  ASSERT_GT(finest.volume, 0);
  EXPECT_EQ(penetration(a, b, {.pair_budget = 1}, workspace).volume, finest.volume);
}

TEST_F(QueryDetails, TheOtherWayRoundIsTheSame) {
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.15 * i, i % 2 == 0 ? 1.6 : 0.3);
    const Penetration ab = ask(a, b, 500), ba = ask(b, a, 500);
    EXPECT_NEAR(ab.volume, ba.volume, 1e-5 * ab.volume);
    EXPECT_LE((ab.force + ba.force).norm(), 1e-3 * ab.force.norm() + 1e-9);
  }
}

TEST_F(QueryDetails, PatchesSumToTheBlend) {
  ContactPatch patches[6];
  int blends = 0;
  for (int i = 0; i < 200; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.05 * (i % 40), i % 2 == 0 ? 1.6 : 0.3);
    const PenetrationSettings settings{.pair_budget = 100u << (i % 6)};
    const Penetration whole = penetration(a, b, settings, workspace_);
    const ContactPatches found = contact_patches(a, b, settings, workspace_, patches);
    EXPECT_EQ(found.penetration.volume, whole.volume);
    EXPECT_EQ(found.penetration.volume_max, whole.volume_max);
    EXPECT_EQ(found.penetration.force, whole.force);
    EXPECT_EQ(found.penetration.torque, whole.torque);
    EXPECT_EQ(found.count > 0, whole.volume > 0);
    double volume = 0, pull = 0, turn = 0;
    Vector3d force = Vector3d::Zero(), torque = force;
    for (const ContactPatch& patch : std::span(patches).first(found.count)) {
      volume += patch.volume;
      force += patch.force;
      torque += patch.torque;
      pull += patch.force.norm();
      turn += patch.torque.norm();
    }
    EXPECT_NEAR(volume, whole.volume, 1e-12 * whole.volume);
    EXPECT_LE((force - whole.force).norm(), 1e-12 * (pull + 1e-300));
    EXPECT_LE((torque - whole.torque).norm(), 1e-12 * (turn + 2 * pull + 1e-300));
    blends += whole.volume != penetration(a, b, {}, workspace_).volume ? 1 : 0;
  }
  EXPECT_GT(blends, 50);
}

TEST_F(QueryDetails, OtherLimitsHoldOnTop) {
  int stopped = 0;
  for (int i = 0; i < 600; ++i) {
    const PlacedAsset a = placed_a(), b = placed_b(0.05 * (i % 60));
    PenetrationSettings settings;
    settings.pair_budget = 3000;
    const Penetration finished = penetration(a, b, settings, workspace_);
    settings.max_visits = 1u << (i % 11);
    const Penetration answer = penetration(a, b, settings, workspace_);
    EXPECT_LE(answer.node_visits, settings.max_visits);
    EXPECT_LE(answer.volume_min, finished.volume);
    EXPECT_GE(answer.volume_max, finished.volume);
    EXPECT_LE(answer.volume_min, answer.volume);
    EXPECT_GE(answer.volume_max, answer.volume);
    EXPECT_TRUE(answer.force.allFinite());
    if (answer.status == QueryStatus::ok) {
      EXPECT_EQ(answer.volume, finished.volume);
    }
    stopped += answer.status == QueryStatus::budget_exhausted ? 1 : 0;
  }
  EXPECT_GT(stopped, 200);
}

}  // namespace
}  // namespace ist
