#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <ist/solid.h>
#include <ist/types.h>

#include "support/float_traps.h"

namespace {

using Eigen::Vector3d;
using ist::Solid;

std::unique_ptr<Solid> bored_box() {  // a box with a ball cut out of one corner, a torus added
  return ist::make_union(ist::make_difference(ist::make_box({0, 0, 0}, {1, 0.7, 0.4}),
                                              ist::make_ball({1, 0.7, 0.4}, 0.5)),
                         ist::make_torus({-1, 0, 0.2}, 0.5, 0.2));
}

std::vector<std::unique_ptr<Solid>> all_kinds() {
  std::vector<std::unique_ptr<Solid>> solids;
  solids.push_back(ist::make_ball({0.1, 0.2, 0.3}, 0.8));
  solids.push_back(ist::make_box({0.1, -0.2, 0}, {0.5, 1, 0.25}));
  solids.push_back(ist::make_torus({0, 0.3, 0}, 0.8, 0.3));
  solids.push_back(bored_box());
  solids.push_back(
      ist::make_intersection(ist::make_ball({0, 0, 0}, 1), ist::make_ball({1, 0, 0}, 1)));
  return solids;
}

TEST(AnalyticSolid, DistancesInClosedForm) {
  const auto ball = ist::make_ball({1, 2, 3}, 2);
  EXPECT_DOUBLE_EQ(ball->signed_distance({1, 2, 3}), -2);
  EXPECT_DOUBLE_EQ(ball->signed_distance({4, 6, 3}), 3);
  const auto box = ist::make_box({0, 0, 0}, {1, 2, 3});
  EXPECT_DOUBLE_EQ(box->signed_distance({0, 0, 0}), -1);
  EXPECT_DOUBLE_EQ(box->signed_distance({0.9, 1.5, -2}), -0.1);
  EXPECT_DOUBLE_EQ(box->signed_distance({4, 6, 0}), 5);
  const auto torus = ist::make_torus({0, 0, 1}, 2, 0.5);
  EXPECT_DOUBLE_EQ(torus->signed_distance({0, 2, 1}), -0.5);
  EXPECT_DOUBLE_EQ(torus->signed_distance({0, 0, 1}), 1.5);
}

TEST(AnalyticSolid, DistancesAreLipschitzAndNeverBeyondTheSurface) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> coordinate(-2, 2);
  const auto point = [&] {
    return Vector3d(coordinate(random), coordinate(random), coordinate(random));
  };
  for (const auto& solid : all_kinds()) {
    for (int i = 0; i < 20'000; ++i) {
      const Vector3d p = point();
      const Vector3d q = (i & 1) != 0 ? point() : Vector3d(p + 0.01 * point());
      const double at_p = solid->signed_distance(p), at_q = solid->signed_distance(q);
      ASSERT_LE(std::abs(at_p - at_q), (p - q).norm() + 1e-15);
      // Opposite signs: the surface lies between, so no distance may reach past the other point.
      if ((at_p > 0) != (at_q > 0)) {
        ASSERT_LE(std::abs(at_p), (p - q).norm());
      }
      if (at_p < 0) {
        ASSERT_TRUE(solid->bounds().contains(p));
      }
    }
  }
}

TEST(AnalyticSolid, VolumesInClosedForm) {
  EXPECT_DOUBLE_EQ(ist::make_ball({5, 5, 5}, 2)->volume(), 32 * std::numbers::pi / 3);
  EXPECT_DOUBLE_EQ(ist::make_box({5, 5, 5}, {1, 2, 3})->volume(), 48);
  EXPECT_DOUBLE_EQ(ist::make_torus({5, 5, 5}, 2, 1)->volume(),
                   4 * std::numbers::pi * std::numbers::pi);
}

/// Integrated volumes against closed forms: within the stated error, and that small.
TEST(AnalyticSolid, IntegratedVolumesKeepTheirStatedError) {
  const auto ball = [](double x, double r) { return ist::make_ball({x, 0.01, -0.02}, r); };
  const double lens = std::numbers::pi * 5 / 12;  // of two unit balls at distance 1
  struct Case {
    std::unique_ptr<Solid> solid;
    double volume;
  };
  std::vector<Case> cases;
  cases.push_back({ist::make_intersection(ball(0, 1), ball(1, 1)), lens});
  cases.push_back({ist::make_union(ball(0, 1), ball(1, 1)), 8 * std::numbers::pi / 3 - lens});
  cases.push_back({ist::make_difference(ball(0, 1), ball(1, 1)), 4 * std::numbers::pi / 3 - lens});
  cases.push_back({ist::make_union(ball(0, 1), ball(10, 1)), 8 * std::numbers::pi / 3});
  cases.push_back({ist::make_difference(ist::make_box({0, 0, 0}, {1, 1, 1}),
                                        ist::make_box({0.3, 0.1, 0.2}, {0.5, 0.4, 0.3})),
                   8 - 0.48});
  cases.push_back({ist::make_difference(ist::make_box({0, 0, 0}, {1, 1, 1}),
                                        ist::make_torus({0, 0, 0}, 0.6, 0.3)),
                   8 - 2 * std::numbers::pi * std::numbers::pi * 0.6 * 0.09});
  cases.push_back({ist::make_intersection(ist::make_box({1e6, 0, 0}, {1e-3, 1e-3, 1e-3}),
                                          ist::make_ball({1e6 + 1e-3, 0, 0}, 1e-3)),
                   2 * std::numbers::pi / 3 * 1e-9});
  for (const Case& c : cases) {
    EXPECT_LE(std::abs(c.solid->volume() - c.volume), c.solid->volume_error());
    EXPECT_LT(c.solid->volume_error(), 0.001 * c.volume);
  }
}

TEST(AnalyticSolid, RefusesWhatIsNoSolid) {
  const ist::testing::NoFloatTraps with_nan;
  const double nan = std::nan("");
  EXPECT_THROW(ist::make_ball({0, 0, 0}, 0), ist::Error);
  EXPECT_THROW(ist::make_ball({0, nan, 0}, 1), ist::Error);
  EXPECT_THROW(ist::make_ball({0, 0, 0}, INFINITY), ist::Error);
  EXPECT_THROW(ist::make_box({0, 0, 0}, {1, -1, 1}), ist::Error);
  EXPECT_THROW(ist::make_torus({0, 0, 0}, 1, 2), ist::Error);
  EXPECT_THROW(ist::make_torus({0, 0, 0}, 1, nan), ist::Error);
  EXPECT_THROW(ist::make_union(ist::make_ball({0, 0, 0}, 1), nullptr), ist::Error);
  EXPECT_THROW(ist::make_intersection(ist::make_ball({0, 0, 0}, 1), ist::make_ball({3, 0, 0}, 1)),
               ist::Error);
}

}  // namespace
