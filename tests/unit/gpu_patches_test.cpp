#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "query/kernel/lens.h"
#include "support/detailed_pairs.h"
#include "support/host_batch.h"
#include "support/host_patches.h"
#include "support/random_pairs.h"
#include "support/reference_sum.h"

// The GPU's batch of contact patches, its source run by teams of the host: of one lane, and of 32
// that go on in an order that nobody can count on.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

std::vector<ContactPatch> patches_of_cpu(const PlacedAsset& a, const PlacedAsset& b,
                                         Measure measure, std::size_t most, Workspace& workspace) {
  std::vector<ContactPatch> patches(most);
  ContactSettings settings;
  settings.measure = measure;
  settings.spheres_only = true;
  patches.resize(contact_patches(a, b, settings, workspace, patches).count);
  return patches;
}

bool same_regions(std::span<const ContactPatch> x, std::span<const ContactPatch> y) {
  return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                    [](const auto& p, const auto& q) { return p.id == q.id; });
}

/// The difference of patches from the CPU's, which are float sums.
struct PatchDifference {
  double volume = 0;    ///< relative
  double force = 0;     ///< of area, or of volume^(2/3) if more
  double torque = 0;    ///< of that times B's size
  double centroid = 0;  ///< of both sizes
  double axis = 0;      ///< of the wrench's: torque and place, likewise

  void add(const ContactPatch& x, const ContactPatch& y, const BatchPair& pair) {
    const double size = 2 * pair.scale_b;
    volume = std::max(volume, std::abs(x.volume - y.volume) / y.volume);
    const double reach = y.area + std::cbrt(y.volume * y.volume);
    force = std::max(force, (x.force - y.force).norm() / reach);
    torque = std::max(torque, (x.torque - y.torque).norm() / (reach * size));
    centroid = std::max(centroid, (x.centroid - y.centroid).norm() / (size + 2 * pair.scale_a));
    // The remaining torque of a force at the point is the torsion about the normal.
    const Eigen::Vector3d left =
        x.torque - (x.point - Eigen::Vector3d(pair.pose_b.t)).cross(x.force) - x.torsion * x.normal;
    const Eigen::Vector3d arm = x.point - x.centroid;
    const double extent = size + arm.norm() + 1e-6 * x.point.norm();  // world coordinates round
    axis = std::max(axis, x.area > 0 ? left.norm() / (reach * extent) : std::abs(x.torsion));
    axis = std::max(axis, std::abs(arm.dot(x.normal)) / extent);
  }
};

/// Patches of pairs of these assets against the CPU's.
struct AgainstCpu {
  PatchDifference difference;
  std::size_t in_touch = 0, several = 0;
  std::size_t other = 0;  ///< of other regions

  void ask(const std::vector<GpuSolid>& solids, const std::vector<BatchPair>& pairs,
           Measure measure, std::uint32_t most, Workspace& workspace) {
    const std::vector<PatchedPair> answers = HostPatches(solids).run(pairs, measure, most);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const BatchPair& pair = pairs[i];
      const std::vector<ContactPatch> cpu =
          patches_of_cpu({std::get<AssetView>(solids[pair.a]), pair.pose_a, pair.scale_a},
                         {std::get<AssetView>(solids[pair.b]), pair.pose_b, pair.scale_b}, measure,
                         most, workspace);
      const std::vector<ContactPatch>& gpu = answers[i].patches;
      ASSERT_EQ(gpu.empty(), cpu.empty()) << i;
      in_touch += !cpu.empty();
      several += cpu.size() > 1;
      if (!same_regions(gpu, cpu)) {
        ++other;
        continue;
      }
      for (std::size_t k = 0; k < gpu.size(); ++k) difference.add(gpu[k], cpu[k], pair);
    }
  }

  /// The CPU's patches are sums in float, some of few lenses that graze.
  void expect_near() const {
    std::printf(
        "%zu in touch, %zu of several patches, %zu of other regions; differences: volume %.2g, "
        "force %.2g, torque %.2g, place %.2g\n",
        in_touch, several, other, difference.volume, difference.force, difference.torque,
        difference.centroid);
    EXPECT_LE(other, in_touch / 100);
    EXPECT_LE(difference.volume, 1e-4);
    EXPECT_LE(difference.force, 1e-4);
    EXPECT_LE(difference.torque, 1e-4);
    EXPECT_LE(difference.centroid, 1e-5);
    EXPECT_LE(difference.axis, 1e-9);
  }
};

TEST(GpuPatches, AreThoseOfTheCpu) {
  Workspace workspace;
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    AgainstCpu all;
    for (const std::uint32_t most : {1u, 4u, 11u, kMostGpuPatches}) {
      all.ask(batch_solids(), RandomPairs(41).pairs(300), measure, most, workspace);
      all.ask(detailed_solids(), detailed_pairs(60, 46), measure, most, workspace);
    }
    EXPECT_GT(all.several, 300u);
    all.expect_near();
  }
}

/// Sums over the spheres of each patch's region, all pairs in double, by the tree alone.
class RegionSums {
 public:
  struct Sum {
    double volume = 0, pushed = 0;
    Vector3d force = Vector3d::Zero();  ///< on B, world
    Vector3d moment = Vector3d::Zero();
  };

  RegionSums(const HostSolids& solids, const BatchPair& pair, Measure measure) {
    const auto tree_of = [&](std::uint32_t asset) -> const gpu::TreeRef& {
      return solids.refs()[asset].tree[static_cast<int>(measure)];
    };
    const gpu::TreeRef &a = tree_of(pair.a), &b = tree_of(pair.b);
    PairPlace place;
    EXPECT_TRUE(place.place(solids.refs()[pair.a].frame, pair.pose_a, pair.scale_a,
                            solids.refs()[pair.b].frame, pair.pose_b, pair.scale_b));
    const bool of_b =
        divides_b(a.leaf_blocks, a.root[3], b.leaf_blocks, b.root[3] * place.a_from_b.scale);
    cuts_ = solids.refs()[of_b ? pair.b : pair.a].cuts[static_cast<int>(measure)];
    sums_.resize(cuts_.bins);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> to_world(place.rotation_a);
    for (std::uint32_t i = 0; i < kWidth * a.leaf_blocks; ++i) {
      const NodeBall x = a.ball(kSphereLevel, i);
      for (std::uint32_t j = 0; x.r > 0 && j < kWidth * b.leaf_blocks; ++j) {
        const NodeBall y = b.ball(kSphereLevel, j);
        if (!(y.r > 0)) continue;
        double moved[3];
        place.a_from_b.apply(y.centre, moved);
        const Vector3d from = Eigen::Map<const Vector3d>(x.centre);
        const Vector3d between = Eigen::Map<const Vector3d>(moved) - from;
        const Lens<double> l = lens(x.r, y.r * place.a_from_b.scale, between.norm());
        if (!(l.volume() > 0)) continue;
        const double unit = place.unit_a;
        Sum& sum = sums_[cuts_.rank[(of_b ? j : i) >> cuts_.shift]];
        const double volume = unit * unit * unit * l.volume();
        const Vector3d force = -unit * unit * l.derivative() * (to_world * between.normalized());
        sum.volume += volume;
        sum.pushed += force.norm();
        sum.force += force;
        sum.moment +=
            volume * (unit * (to_world * (from + l.cap_b / (l.cap_a + l.cap_b) * between)) +
                      vector(place.origin_a));
      }
    }
  }

  Sum of(std::uint64_t id) const {
    const gpu::CutNode* node = cuts_.node;
    while (node->id != id) ++node;
    Sum out;
    for (std::uint32_t rank = node->begin; rank < node->end; ++rank) {
      out.volume += sums_[rank].volume;
      out.pushed += sums_[rank].pushed;
      out.force += sums_[rank].force;
      out.moment += sums_[rank].moment;
    }
    return out;
  }

 private:
  gpu::CutsRef cuts_ = {};
  std::vector<Sum> sums_;
};

/// Volumes that are too small for a patch of their own go to a patch of another region: pairs with
/// such volumes are left out.
TEST(GpuPatches, AreTheRegionsSumsInDouble) {
  const std::vector<BatchPair> pairs = RandomPairs(47).pairs(150);
  const HostSolids solids(batch_solids());
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const std::vector<PatchedPair> answers = HostPatches(batch_solids()).run(pairs, measure, 6);
    std::size_t compared = 0;
    double worst = 0, worst_force = 0, worst_place = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const std::vector<ContactPatch>& patches = answers[i].patches;
      if (patches.empty()) continue;
      const RegionSums sums(solids, pairs[i], measure);
      double in_regions = 0;
      for (const ContactPatch& patch : patches) in_regions += sums.of(patch.id).volume;
      if (in_regions < (1 - 1e-6) * answers[i].whole.volume) continue;
      for (const ContactPatch& patch : patches) {
        const RegionSums::Sum sum = sums.of(patch.id);
        const double reach = sum.pushed + std::cbrt(sum.volume * sum.volume);
        worst = std::max(worst, std::abs(patch.volume / sum.volume - 1));
        worst_force = std::max(worst_force, (patch.force - sum.force).norm() / reach);
        worst_place = std::max(worst_place, (patch.centroid - sum.moment / sum.volume).norm() /
                                                (2 * pairs[i].scale_b));
        compared += patches.size() > 1;
      }
    }
    std::printf("%s: %zu of several; worst volume %.2g, force %.2g, place %.2g\n",
                measure == Measure::inner ? "inner" : "matched", compared, worst, worst_force,
                worst_place);
    EXPECT_GT(compared, 100u);
    EXPECT_LE(worst, 1e-6);
    EXPECT_LE(worst_force, 1e-6);
    EXPECT_LE(worst_place, 1e-6);
  }
}

/// Every promise about one pair's patches.
void expect_shares(const PatchedPair& of, std::size_t most) {
  const Penetration& whole = of.whole;
  EXPECT_LE(of.patches.size(), most);
  EXPECT_EQ(of.patches.empty(), most == 0 || whole.volume == 0);
  if (of.patches.empty()) return;
  double volume = 0, pushed = 0, turned = 0;
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero(), moment = Vector3d::Zero();
  for (std::size_t k = 0; k < of.patches.size(); ++k) {
    const ContactPatch& patch = of.patches[k];
    if (k > 0) {
      EXPECT_GT(patch.id, of.patches[k - 1].id);
    }
    EXPECT_GT(patch.volume, 0);
    volume += patch.volume;
    force += patch.force;
    torque += patch.torque;
    moment += patch.volume * (patch.centroid - whole.centroid);
    pushed += patch.force.norm();
    turned += patch.torque.norm();
    if (patch.area > 0) {
      EXPECT_NEAR(patch.area, patch.force.norm(), 1e-15 * patch.area);
      EXPECT_LE((patch.normal * patch.area - patch.force).norm(), 1e-14 * patch.area);
      EXPECT_LE(patch.depth * patch.area, patch.volume * (1 + 1e-14));
    } else {
      EXPECT_EQ(patch.normal, Vector3d::Zero());
      EXPECT_EQ(patch.depth, 0);
    }
  }
  EXPECT_NEAR(volume, whole.volume, 1e-14 * whole.volume);
  EXPECT_LE((force - whole.force).norm(), 1e-14 * pushed);
  EXPECT_LE((torque - whole.torque).norm(), 1e-14 * turned);
  EXPECT_LE(moment.norm(), 1e-13 * whole.volume);
}

TEST(GpuPatches, SumToTheWholeWhichIsThePenetration) {
  const std::vector<BatchPair> pairs = RandomPairs(42).pairs(150);
  for (const Measure measure : {Measure::matched, Measure::inner}) {
    const std::vector<Penetration> wholes = HostBatch(batch_solids()).run(pairs, measure);
    for (const std::uint32_t most : {0u, 1u, 3u, kMostGpuPatches}) {
      const std::vector<PatchedPair> answers =
          HostPatches(batch_solids()).run(pairs, measure, most);
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        SCOPED_TRACE(i);
        expect_shares(answers[i], most);
        const Penetration &whole = answers[i].whole, &sum = wholes[i];
        EXPECT_NEAR(whole.volume, sum.volume, 1e-6 * sum.volume);
        EXPECT_LE((whole.centroid - sum.centroid).norm(), 1e-6 * 2 * pairs[i].scale_b);
        EXPECT_EQ(whole.status, sum.status);
        EXPECT_EQ(whole.node_visits, sum.node_visits);
        EXPECT_EQ(whole.sphere_pairs, sum.sphere_pairs);
      }
    }
  }
}

TEST(GpuPatches, LanesOfAWarpNeedNoLuck) {
  const std::vector<BatchPair> pairs = RandomPairs(43).pairs(60);
  HostPatches batch(batch_solids());
  const std::vector<PatchedPair> by_one = batch.run(pairs, Measure::matched, 8);
  const std::vector<PatchedPair> expected = batch.run(pairs, Measure::matched, 8, 1);
  expect_same_bits(batch.run(pairs, Measure::matched, 8, 2), expected);
  PatchDifference difference;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ASSERT_TRUE(same_regions(by_one[i].patches, expected[i].patches)) << i;
    for (std::size_t k = 0; k < by_one[i].patches.size(); ++k)
      difference.add(by_one[i].patches[k], expected[i].patches[k], pairs[i]);
  }
  // The same lenses in another order, in double.
  EXPECT_LE(difference.volume, 1e-13);
  EXPECT_LE(difference.force, 1e-13);
  EXPECT_LE(difference.torque, 1e-13);
  EXPECT_LE(difference.centroid, 1e-13);
}

/// An asset of these spheres, inner and matched; clustered, or in the order given.
Asset made_of(const std::vector<Sphere>& spheres, bool clustered) {
  AssetArrays arrays;
  arrays.inner_spheres = arrays.matched_spheres = spheres;
  std::vector<std::uint32_t> order;
  for (const Sphere& s : spheres) {
    arrays.cover_radii.push_back(2 * s.r);
    order.push_back(static_cast<std::uint32_t>(order.size()));
  }
  if (clustered) {
    arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
    arrays.matched_tree = build_tree(arrays.matched_spheres, {});
  } else {
    arrays.inner_tree = tree_from_order(arrays.inner_spheres, arrays.cover_radii, order);
    arrays.matched_tree = tree_from_order(arrays.matched_spheres, {}, order);
  }
  arrays.header.volume = arrays.matched_tree.volume_sum;
  return Asset(asset_bytes(arrays), "made up");
}

/// Clumps at two balls of the divided tree: spheres in each, which nothing pushes, and at its rim.
TEST(GpuPatches, SpheresInsideABallFallToItsPatch) {
  std::vector<Sphere> balls, clumps;
  const auto at = [](std::uint32_t k) { return 0.25f * static_cast<float>(k) - 0.75f; };
  for (std::uint32_t i = 0; i < 7 * 7 * 7; ++i)
    balls.push_back({at(i / 49), at(i / 7 % 7), at(i % 7), 0.05f});
  RandomPairs random(48);
  const auto near = [&](double x) { return static_cast<float>(x + random.uniform(-0.01, 0.01)); };
  for (const double corner : {0.0, 0.5})
    for (const double x : {corner, corner + 0.05})
      for (int k = 0; k < 16; ++k) clumps.push_back({near(x), near(corner), near(0), 0.002f});
  const Asset a = made_of(balls, true), b = made_of(clumps, true);
  const std::vector<BatchPair> pairs = {{0, 1, {}, {}, 1, 1}, {1, 0, {}, {}, 1, 1}};
  for (const PatchedPair& answer :
       HostPatches({a.view(), b.view()}).run(pairs, Measure::inner, 4)) {
    ASSERT_EQ(answer.patches.size(), 2u);
    for (const ContactPatch& patch : answer.patches)
      EXPECT_NEAR(patch.volume, answer.whole.volume / 2, 0.1 * answer.whole.volume);
  }
  Workspace workspace;
  AgainstCpu all;
  all.ask({a.view(), b.view()}, pairs, Measure::inner, 4, workspace);
  EXPECT_EQ(all.several, 2u);
  EXPECT_EQ(all.other, 0u);
  all.expect_near();
}

/// Copies on top of each other, single spheres, trees whose bins are no leaf blocks.
TEST(GpuPatches, UnusualContactsAreThoseOfTheCpu) {
  std::vector<Sphere> grid;  // in its own order: clustering it would take a while
  const auto at = [](std::uint32_t k) { return 0.04f * static_cast<float>(k) - 0.8f; };
  for (std::uint32_t i = 0; i < 42 * 40 * 40; ++i)
    grid.push_back({at(i / 1600), at(i / 40 % 40), at(i % 40), 0.019f});
  const Asset lattice = made_of(grid, false);
  const Asset one = make_random_asset({1, 1, {}, 0, 0}, 50);
  const Asset few = make_random_asset({100, 0.5, {}, 0, 0}, 51);
  const std::vector<GpuSolid> solids = {lattice.view(), one.view(), few.view()};
  RandomPairs random(44);
  std::vector<BatchPair> pairs;
  for (int k = 0; k < 24; ++k) {
    BatchPair pair = {static_cast<std::uint32_t>(k % 3),
                      static_cast<std::uint32_t>(k / 3 % 3),
                      random.pose(0.2),
                      random.pose(1),
                      1,
                      std::exp(random.uniform(-1, 1))};
    if (pair.a == 0 && pair.b == 0) pair.scale_b = 0.2;
    pairs.push_back(pair);
  }
  const WorldSphere ball = world_spheres({one.view(), {}, 1}, Measure::matched)[0];
  for (const double scale : {1e-9, 1e-7, 1e-3, 1e3, 1e6})
    for (const double far : {0.0, 1e3}) {
      BatchPair pair = {1, 2, {}, {}, 1, scale};
      for (int k = 0; k < 3; ++k) {
        pair.pose_b.t[k] = ball.centre[k] + far;
        pair.pose_a.t[k] = far;
      }
      pair.pose_b.t[0] += ball.r;
      pairs.push_back(pair);
    }
  pairs.push_back({2, 2, {}, {}, 1, 1});
  for (const PatchedPair& answer : HostPatches(solids).run(pairs, Measure::matched, 12))
    expect_shares(answer, 12);
  Workspace workspace;
  AgainstCpu all;
  all.ask(solids, pairs, Measure::matched, 12, workspace);
  EXPECT_GT(all.in_touch, 15u);
  all.expect_near();
}

TEST(GpuPatches, InvalidPosesSpoilOnlyThemselves) {
  std::vector<BatchPair> pairs = RandomPairs(45).pairs(40);
  const std::vector<PatchedPair> sound =
      HostPatches(batch_solids()).run(pairs, Measure::matched, 4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  pairs[3].pose_b.t[1] = nan;
  pairs[7].pose_a.q[0] = std::numeric_limits<double>::infinity();
  pairs[11].scale_b = 0;
  pairs[19].b = 99;
  std::vector<PatchedPair> rest = HostPatches(batch_solids()).run(pairs, Measure::matched, 4);
  std::vector<PatchedPair> expected = sound;
  for (const std::size_t i : {3u, 7u, 11u, 19u}) {
    EXPECT_EQ(rest[i].whole.status, QueryStatus::invalid_input) << i;
    EXPECT_TRUE(std::isnan(rest[i].whole.volume)) << i;
    EXPECT_TRUE(rest[i].patches.empty()) << i;
    rest[i] = expected[i] = {};
  }
  expect_same_bits(rest, expected);
  EXPECT_TRUE(HostPatches(batch_solids()).run({}, Measure::inner, 4).empty());
}

}  // namespace
}  // namespace ist::testing
