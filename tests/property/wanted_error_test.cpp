#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/solid.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>

#include "query/lod/wanted_error.h"
#include "support/surface_queries.h"

// Answers of a wanted error: levels of detail and the exact measure, blended.

namespace ist {
namespace {

using namespace testing;

constexpr double kErrors[] = {0.002, 0.005, 0.02, 0.1};

/// With levels of 4,000, 1,000 and 250 spheres.
const Asset& ring() {
  static const Asset asset = baked(torus_mesh(0.35, 0.14, 60, 30), "ring", 4000);
  return asset;
}
const Asset& blob() {
  TriangleMesh mesh = icosphere_mesh(4);
  for (Vector3d& x : mesh.vertices)
    x = (0.3 * (1 + 0.2 * std::sin(5 * x.x()) * std::cos(4 * x.y()))) *
        x.cwiseProduct(Vector3d(1.3, 1, 0.8));
  static const Asset asset = baked(std::move(mesh), "blob", 3000);
  return asset;
}
const Asset& bare_ring() {
  static const Asset asset = baked(torus_mesh(0.35, 0.14, 60, 30), "ring", 4000, false);
  return asset;
}
const Asset& bare_blob_surface() {
  static const Asset asset = bake_mesh_only(closed(icosphere_mesh(3), "ball"), 1);
  return asset;
}

class WantedErrors : public ::testing::Test {
 protected:
  Penetration ask(const PlacedAsset& a, const PlacedAsset& b, double error) {
    return penetration(a, b, {.relative_error = error}, workspace_);
  }
  Penetration exact(const PlacedAsset& a, const PlacedAsset& b) {
    return penetration(a, b, {.measure = Measure::exact}, workspace_);
  }
  PlacedAsset ring_at_rest() { return {ring().view(), random_pose(random_, 0), 1}; }
  /// At some depth, one after another.
  PlacedAsset blob_at(int i, double scale = 1) {
    return {blob().view(), random_pose(random_, 0.05 + 0.04 * (i % 20)), scale};
  }
  static WantedError wanted(const PlacedAsset& a, const PlacedAsset& b, double error,
                            bool has_exact = true) {
    const RelativePose pose = *relative_pose(a, b);
    const LevelChain chain(a.asset.header(), b.asset.header(), pose.a_from_b.scale);
    return {a, b, pose, {.relative_error = error}, chain, has_exact};
  }

  Workspace workspace_;
  std::mt19937_64 random_{7};
};

bool same(const Penetration& x, const Penetration& y) {
  return x.volume == y.volume && x.volume_min == y.volume_min && x.volume_max == y.volume_max &&
         x.force == y.force && x.torque == y.torque && x.status == y.status;
}

TEST_F(WantedErrors, SharesSumToOneAndHaveTheirSlope) {
  int blended = 0;
  for (const double scale : {1.0, 0.1})
    for (const double error : kErrors) {
      const WantedError levels = wanted(ring_at_rest(), blob_at(0, scale), error);
      for (double overlap = 1e-9; overlap < 1; overlap *= 1.07) {
        const auto at = [&](double x) { return levels.shares(x); };
        const WantedError::Shares here = at(overlap);
        double sum = here.rest.weight, slope = here.rest.slope;
        const double step = 1e-5 * overlap;
        for (std::size_t i = 0; i < here.levels.size(); ++i) {
          sum += here.levels[i].weight;
          slope += here.levels[i].slope;
          blended += here.levels[i].weight > 0.05 && here.levels[i].weight < 0.95 ? 1 : 0;
          EXPECT_NEAR(
              here.levels[i].slope * overlap,
              (at(overlap + step).levels[i].weight - at(overlap - step).levels[i].weight) / 2e-5,
              1e-3);
        }
        EXPECT_NEAR(sum, 1, 1e-15);
        EXPECT_NEAR(slope * overlap, 0, 1e-12);
      }
    }
  EXPECT_GT(blended, 50);
}

// A smaller error takes finer levels and more of the exact measure at every overlap.
TEST_F(WantedErrors, LessErrorIsNeverCheaper) {
  for (const bool has_exact : {true, false})
    for (const double scale : {1.0, 0.3, 0.1}) {
      const PlacedAsset a = ring_at_rest(), b = blob_at(0, scale);
      for (double overlap = 1e-9; overlap < 1; overlap *= 1.1) {
        std::array<double, LevelChain::kMost> most = {};
        most.fill(-1);
        for (const double error : kErrors) {
          const WantedError::Shares shares = wanted(a, b, error, has_exact).shares(overlap);
          double coarser = 0;  // what this level and all coarser ones give
          for (std::size_t i = shares.levels.size(); i-- > 0;) {
            coarser += shares.levels[i].weight;
            EXPECT_GE(coarser, most[i] - 1e-12) << overlap << ' ' << error << ' ' << i;
            most[i] = coarser;
          }
        }
      }
    }
}

TEST_F(WantedErrors, GradientsAreThoseOfTheVolume) {
  int mixed = 0;
  for (int i = 0; i < 60; ++i) {
    const double scale = i % 3 == 2 ? 0.12 : 1;
    const PlacedAsset a = ring_at_rest(), b = blob_at(i, scale);
    const double error = kErrors[i % 4];
    const Penetration here = ask(a, b, error);
    if (!(here.volume > 0)) continue;
    mixed += here.volume != exact(a, b).volume ? 1 : 0;
    const double step = 2e-4 * scale, force = here.force.norm();
    const Vector3d along = Vector3d::Random().normalized();
    const auto volume = [&](const Vector3d& shift, const Vector3d& turn) {
      PlacedAsset moved = b;
      moved.pose = Sweep{b.pose, shift, turn}.at(1);
      return ask(a, moved, error).volume;
    };
    const Vector3d none = Vector3d::Zero();
    const double pushed = (volume(step * along, none) - volume(-step * along, none)) / (2 * step);
    EXPECT_NEAR(pushed, -here.force.dot(along), 5e-3 * force) << i << ' ' << error;
    const double turned = (volume(none, 1e-3 * along) - volume(none, -1e-3 * along)) / 2e-3;
    EXPECT_NEAR(turned, -here.torque.dot(along), 5e-3 * force * scale) << i << ' ' << error;
  }
  EXPECT_GT(mixed, 15);
}

// An eighth of the step, a small part of the largest change: a jump would not shrink.
TEST_F(WantedErrors, NothingJumpsAlongAPath) {
  const PlacedAsset a{ring().view(), {}, 1};
  for (const double scale : {1.0, 0.12})
    for (const double error : kErrors) {
      PlacedAsset b{blob().view(), random_pose(random_, 0), scale};
      const Vector3d from(0.35 + 0.14 + 0.45 * scale, 0.02, 0.01), to(0.3, -0.05, 0.03);
      const auto largest_changes = [&](int steps) {
        double volume = 0, force = 0, torque = 0;
        Penetration before;
        for (int i = 0; i <= steps; ++i) {
          const Vector3d x = from + (to - from) * i / steps;
          for (int k = 0; k < 3; ++k) b.pose.t[k] = x[k];
          const Penetration now = ask(a, b, error);
          // Rounding may exceed the accepted error of a volume of 1e-14, where an overlap begins.
          EXPECT_EQ(now.status, now.volume < 1e-12 && now.status != QueryStatus::ok
                                    ? QueryStatus::error_exceeded
                                    : QueryStatus::ok);
          if (i > 0) {
            volume = std::max(volume, std::abs(now.volume - before.volume));
            force = std::max(force, (now.force - before.force).norm());
            torque = std::max(torque, (now.torque - before.torque).norm());
          }
          before = now;
        }
        return std::array{volume, force, torque};
      };
      const auto coarse = largest_changes(1000), fine = largest_changes(8000);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LE(fine[k], 0.3 * coarse[k]) << scale << ' ' << error << ' ' << k;
    }
}

TEST_F(WantedErrors, NearlyAllPosesErrByLess) {
  for (const double error : kErrors) {
    std::vector<double> over;
    for (int i = 0; i < 240; ++i) {
      const PlacedAsset a = ring_at_rest(), b = blob_at(i, i % 2 == 0 ? 1 : 0.2);
      const double truth = exact(a, b).volume;
      const Penetration answer = ask(a, b, error);
      EXPECT_EQ(answer.status, QueryStatus::ok);
      if (truth > 0) over.push_back(std::abs(answer.volume / truth - 1) / error);
    }
    std::sort(over.begin(), over.end());
    ASSERT_GT(over.size(), 100u);
    EXPECT_LE(over[over.size() / 2], 1 / 3.) << error;
    EXPECT_LE(over[over.size() * 19 / 20], 1) << error;
  }
}

// Two solids in reverse order, up to the difference of the sums.
TEST_F(WantedErrors, FewTrianglesAndSurfacesAloneAreExact) {
  for (int i = 0; i < 20; ++i) {
    const PlacedAsset a{cube().view(), random_pose(random_, 0), 1};
    const PlacedAsset b{slab().view(), random_pose(random_, 0.1 * i), 1};
    EXPECT_TRUE(same(ask(a, b, 0.05), exact(a, b)));
    const PlacedAsset ball{bare_blob_surface().view(), random_pose(random_, 0.1 * i), 0.3};
    EXPECT_TRUE(same(ask(ball, a, 0.05), exact(ball, a)));
    ContactPatch patches[4];
    const ContactPatches found =
        contact_patches(ball, a, {.relative_error = 0.05}, workspace_, patches);
    EXPECT_TRUE(same(found.penetration, exact(ball, a)));
  }
}

TEST_F(WantedErrors, OtherMeasuresDoNotHeedIt) {
  for (int i = 0; i < 10; ++i) {
    const PlacedAsset a = ring_at_rest(), b = blob_at(i);
    for (const Measure measure : {Measure::exact, Measure::inner}) {
      PenetrationSettings settings{.measure = measure};
      const Penetration without = penetration(a, b, settings, workspace_);
      settings.relative_error = 0.1;
      EXPECT_TRUE(same(penetration(a, b, settings, workspace_), without));
    }
    EXPECT_TRUE(same(ask(a, b, 0), penetration(a, b, {}, workspace_)));
  }
}

// Without a mesh and under a budget: the best there is, and the status.
TEST_F(WantedErrors, AMissIsSaid) {
  int missed = 0, met = 0;
  for (int i = 0; i < 60; ++i) {
    const PlacedAsset a{bare_ring().view(), random_pose(random_, 0), 1}, b = blob_at(i);
    for (const double error : {1e-6, 0.02}) {
      const Penetration answer = ask(a, b, error), all = penetration(a, b, {}, workspace_);
      if (answer.status == QueryStatus::error_exceeded) {
        ++missed;
        EXPECT_GT(answer.volume, 0);
        if (error < 0.01) {
          EXPECT_NEAR(answer.volume, all.volume, 1e-5 * all.volume);
        }
      } else {
        EXPECT_EQ(answer.status, QueryStatus::ok);
        EXPECT_TRUE(error > 0.01 || answer.volume == 0);
        const double truth = exact({ring().view(), a.pose, 1}, b).volume;
        if (truth > 0) {
          EXPECT_NEAR(answer.volume, truth, 2 * error * truth);
        }
        ++met;
      }
    }
    const PlacedAsset full{ring().view(), a.pose, 1};
    const Penetration budgeted =
        penetration(full, b, {.pair_budget = 1, .relative_error = 1e-6}, workspace_);
    EXPECT_EQ(budgeted.status == QueryStatus::error_exceeded, budgeted.volume > 0) << i;
    EXPECT_EQ(ask(a, a, 0.05).status, QueryStatus::error_exceeded);
    const double solid = exact(full, full).volume;
    EXPECT_NEAR(ask(full, full, 0.05).volume, solid, 1e-12 * solid);
    EXPECT_EQ(ask(full, full, 0.05).status, QueryStatus::ok);
  }
  EXPECT_GT(missed, 40);
  EXPECT_GT(met, 15);
}

// The bounds of a mesh that was made from a signed distance contain its error: the status reports
// bounds that are wider than the wanted error.
TEST_F(WantedErrors, PolygonisedMeshesSayWhereTheyExceedIt) {
  const auto ring = make_torus(Vector3d::Zero(), 0.35, 0.14);
  const Asset packed = bake(*ring, {.max_spheres = 100}, {}, {.cells = 64});
  ASSERT_EQ(packed.view().mesh_state(), MeshState::polygonised);
  ContactPatch patches[6];
  for (const Asset* asset : {&packed}) {
    int asked = 0;
    for (int i = 0; i < 40; ++i) {
      const PlacedAsset a{asset->view(), random_pose(random_, 0), 1}, b = blob_at(i, 0.8);
      const Penetration truth = exact(a, b);
      if (!(truth.volume > 0)) continue;
      const double half_width = (truth.volume_max - truth.volume_min) / 2;
      for (const double times : {0.5, 2.0}) {
        const double error = times * half_width / truth.volume;
        const Penetration answer = ask(a, b, error);
        if (answer.volume != truth.volume) continue;  // by spheres, which errors were measured of
        ++asked;
        const QueryStatus status = times < 1 ? QueryStatus::error_exceeded : QueryStatus::ok;
        EXPECT_EQ(answer.status, status) << i;
        const PenetrationSettings settings{.relative_error = error};
        EXPECT_EQ(contact_patches(a, b, settings, workspace_, patches).penetration.status, status);
      }
    }
    EXPECT_GT(asked, 15) << asset->view().sphere_count();
  }
}

TEST_F(WantedErrors, PredictionsOfTheBakeDecide) {
  const auto predicting = [](const Asset& asset, double times) {
    std::vector<std::byte> bytes(asset.bytes().begin(), asset.bytes().end());
    AssetHeader header = asset.view().header();
    header.predicted_poses = 100;
    const double errors[] = {0, 1e-4, 1e-3, 5e-3, 3e-2};
    for (std::uint32_t k = 0; k < kOverlapClasses; ++k)
      header.predicted_error[k] = times * errors[k];
    std::memcpy(bytes.data(), &header, sizeof header);
    seal(bytes);
    return Asset(bytes, "predicting");
  };
  const PlacedAsset at{blob().view(), random_pose(random_, 0), 1};
  double before = 0;
  for (const double times : {0.1, 1.0, 10.0, 1000.0}) {
    const Asset asset = predicting(ring(), times);
    const WantedError levels = wanted({asset.view(), {}, 1}, at, 0.01, false);
    double from = 1e-12;  // overlap from which on a level answers alone
    while (levels.shares(from).rest.weight > 0 && from < 1e3) from *= 1.01;
    EXPECT_GT(from, before) << times;
    before = from;
  }
  // A level answers alone where the next coarser one's median error, a third of the predicted one,
  // is small enough to confirm it: by the middles of the classes, between which 1/error is linear.
  const Asset asset = predicting(ring(), 1);
  const PlacedAsset a{asset.view(), {}, 1};
  const double error = 3 * 5e-3;
  const WantedError levels = wanted(a, a, error, false);
  double from = 1e-12;
  while (levels.shares(from).levels[0].weight < 1 - 1e-9 && from < 1e3) from *= 1.001;
  const AssetHeader& header = asset.view().header();
  const TreeHeader &own = matched_tree(header, 0), &coarser = matched_tree(header, 1);
  const double confirmed = 3 * error * (coarser.mean_radius / own.mean_radius - 1);
  const double low = std::sqrt(1e-4 * 1e-3), high = std::sqrt(1e-3 * 1e-2);
  const double part = (1 / confirmed - 1 / (3 * 3e-2)) / (1 / error - 1 / (3 * 3e-2));
  const double spheres = (low + (high - low) * part) * own.volume_sum / solid_volume(header, own);
  EXPECT_GT(part, 0);
  EXPECT_LT(part, 1);
  EXPECT_NEAR(from / (spheres * solid_volume(header, coarser)), 1, 0.02);
}

TEST_F(WantedErrors, PatchesSumToTheBlend) {
  ContactPatch patches[6];
  int blends = 0, exact_ones = 0;
  for (int i = 0; i < 320; ++i) {
    const PlacedAsset a = ring_at_rest(), b = blob_at(i, i % 3 == 2 ? 0.12 : 1);
    const PenetrationSettings settings{.relative_error = i % 4 == 3 ? 1e-5 : kErrors[i % 4]};
    const Penetration whole = penetration(a, b, settings, workspace_);
    const ContactPatches found = contact_patches(a, b, settings, workspace_, patches);
    EXPECT_TRUE(same(found.penetration, whole)) << i;
    EXPECT_EQ(found.count > 0, whole.volume > 0);
    double volume = 0, pull = 0, turn = 0;
    Vector3d force = Vector3d::Zero(), torque = force;
    for (const ContactPatch& patch : std::span(patches).first(found.count)) {
      volume += patch.volume;
      force += patch.force;
      torque += patch.torque;
      pull += patch.force.norm();
      turn += patch.torque.norm();
      EXPECT_LE(patch.depth, 2);
      EXPECT_NEAR(patch.area, patch.force.norm(), 1e-6);
    }
    EXPECT_NEAR(volume, whole.volume, 1e-12 * whole.volume);
    EXPECT_LE((force - whole.force).norm(), 1e-12 * (pull + 1e-300));
    EXPECT_LE((torque - whole.torque).norm(), 1e-12 * (turn + 2 * pull + 1e-300));
    const bool is_exact = whole.volume == exact(a, b).volume;
    exact_ones += is_exact && whole.volume > 0 ? 1 : 0;
    blends +=
        !is_exact && whole.volume != penetration(a, b, {.spheres_only = true}, workspace_).volume
            ? 1
            : 0;
  }
  EXPECT_GT(blends, 40);
  EXPECT_GT(exact_ones, 20);
}

/// The same solid at other spheres: copies that no content hash identifies.
const Asset& other_ring() {
  static const Asset asset = baked(torus_mesh(0.35, 0.14, 60, 30), "ring", 1000);
  return asset;
}
/// Round enough to be worth spheres, with two flat ends.
const Asset& puck(bool with_mesh = true) {
  const auto of = [](bool kept) {
    TriangleMesh mesh = icosphere_mesh(4);
    for (Vector3d& x : mesh.vertices) {
      x *= 0.4;
      x.z() = std::clamp(x.z(), -0.2, 0.2);
    }
    return baked(std::move(mesh), "puck", 4000, kept);
  };
  static const Asset full = of(true), bare = of(false);
  return with_mesh ? full : bare;
}

// Flush faces, coaxial rings, copies in place, and all of them moved a little.
TEST_F(WantedErrors, FlushAndCoincidentSolidsKeepTheWord) {
  struct Mate {
    PlacedAsset a, b, bare_a;
    Vector3d along;
  };
  const Pose up = pose_of(Quaterniond::Identity(), {0.05, 0, 0.4});
  const Pose turned =
      pose_of(Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ())), {0, 0, 0});
  const std::vector<Mate> mates = {
      {{puck().view(), {}, 1}, {puck().view(), up, 1}, {puck(false).view(), {}, 1}, {0, 0, -1}},
      {{puck().view(), {}, 1}, {puck().view(), {}, 1}, {puck(false).view(), {}, 1}, {1, 0, 0}},
      {{ring().view(), {}, 1}, {ring().view(), {}, 1}, {bare_ring().view(), {}, 1}, {1, 0, 0}},
      {{ring().view(), {}, 1}, {ring().view(), turned, 1}, {bare_ring().view(), {}, 1}, {0, 0, 1}},
      {{ring().view(), {}, 1},
       {other_ring().view(), {}, 1},
       {bare_ring().view(), {}, 1},
       {0, 1, 0}},
  };
  int met = 0, exceeded = 0, off = 0;
  for (std::size_t k = 0; k < mates.size(); ++k)
    for (const double aside : {0.0, 1e-9, 1e-6, 1e-3, 0.01, 0.02, 0.04, 0.08})
      for (const double error : kErrors) {
        PlacedAsset a = mates[k].a, b = mates[k].b, bare = mates[k].bare_a;
        const double scale = k % 2 == 0 ? 1.0 : 0.37;
        a.scale = bare.scale = b.scale = scale;
        for (int i = 0; i < 3; ++i) b.pose.t[i] = scale * (b.pose.t[i] + aside * mates[k].along[i]);
        const double truth = exact(a, b).volume;
        const double solid = scale * scale * scale * std::min(a.asset.volume(), b.asset.volume());
        for (const PlacedAsset& one : {a, bare}) {
          const Penetration answer = ask(one, b, error);
          EXPECT_LE(answer.volume_max, solid * (1 + 1e-12));
          EXPECT_GE(answer.volume_max, answer.volume);
          (answer.status == QueryStatus::ok ? met : exceeded) += 1;
          if (answer.status != QueryStatus::ok) continue;
          // Nearer than any sphere's radius; from there on errors are those of other poses.
          const double most = error * truth + 1e-12 * solid;
          const double wrong = std::abs(answer.volume - truth);
          EXPECT_LE(wrong, aside <= 1e-3 ? most : 2 * most) << k << ' ' << aside << ' ' << error;
          off += wrong > most ? 1 : 0;
        }
      }
  EXPECT_GT(met, 100);
  EXPECT_GT(exceeded, 30);
  EXPECT_LE(off, met / 20);
}

TEST_F(WantedErrors, OtherLimitsHoldOnTop) {
  int stopped = 0;
  for (int i = 0; i < 600; ++i) {
    PlacedAsset a = ring_at_rest(), b = blob_at(i, i % 3 == 2 ? 0.12 : 1);
    if (i % 2 == 1) a.asset = torus().view(), b.asset = coarse_torus().view();  // of one level
    PenetrationSettings settings{.pair_budget = i % 5 == 0 ? 300u : 0,
                                 .relative_error = kErrors[i % 4]};
    const Penetration finished = penetration(a, b, settings, workspace_);
    settings.max_visits = 1u << (i % 11);
    const Penetration answer = penetration(a, b, settings, workspace_);
    EXPECT_LE(answer.volume_min, finished.volume * (1 + 1e-12)) << i;
    EXPECT_GE(answer.volume_max, finished.volume * (1 - 1e-12)) << i;
    EXPECT_LE(answer.volume_min, answer.volume);
    EXPECT_GE(answer.volume_max, answer.volume);
    EXPECT_TRUE(answer.force.allFinite());
    if (answer.status == QueryStatus::ok) {
      EXPECT_TRUE(same(answer, finished)) << i;
    }
    stopped += answer.status == QueryStatus::budget_exhausted ? 1 : 0;
  }
  EXPECT_GT(stopped, 100);
}

}  // namespace
}  // namespace ist
