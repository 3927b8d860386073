#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "packing/linear_program.h"

namespace ist::packing {
namespace {

struct Ball {
  Float3 centre;
  float radius;
};

float clearance(const std::vector<Ball>& balls, Float3 x) {
  float least = 1e30f;
  for (const Ball& b : balls) least = std::min(least, norm(x - b.centre) - b.radius);
  return least;
}

/// Balls about the origin, some of which may hold it.
std::vector<Ball> random_balls(std::mt19937& random, int count, float scale) {
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Ball> balls;
  for (int i = 0; i < count; ++i) {
    const Float3 direction{unit(random), unit(random), unit(random)};
    const float distance = scale * (0.2f + std::fabs(unit(random)));
    const float radius = std::max(0.0f, 2 * scale * unit(random));
    balls.push_back({((distance + radius) / norm(direction)) * direction, radius});
  }
  return balls;
}

SampleMemory seen_from_origin(const std::vector<Ball>& balls) {
  SampleMemory memory;
  int count = 0;
  for (const Ball& b : balls) {
    const auto tag = static_cast<std::uint32_t>(count);
    const FeatureOffset offset = ball_offset(b.centre, b.radius, tag, {});
    put(memory, count++, constraint_of(offset, std::sqrt(offset.range2)));
  }
  return memory;
}

TEST(LinearProgram, BoundIsNeverBelowASampledClearance) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int round = 0; round < 2000; ++round) {
    const float scale = round % 3 == 0 ? 1.0f : (round % 3 == 1 ? 1e-2f : 1e-4f);
    const auto balls = random_balls(random, 1 + round % 40, scale);
    const float a = scale * 0.5f * (1.1f + unit(random));
    const SampleMemory constraints = seen_from_origin(balls);
    const ClearanceOptimum best =
        maximise_clearance(SerialTeam{}, constraints, static_cast<int>(balls.size()), a, 3 * a * a);
    for (int i = 0; i < 300; ++i) {
      const Float3 y = a * Float3{unit(random), unit(random), unit(random)};
      ASSERT_LE(clearance(balls, y), best.value + 4e-6f * scale) << "round " << round;
    }
  }
}

TEST(LinearProgram, LinearModelIsSolvedToOptimality) {
  // Against the best of many random points and of the reported point itself.
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int round = 0; round < 2000; ++round) {
    const auto balls = random_balls(random, 1 + round % 30, 1);
    const float a = 0.3f;
    const SampleMemory constraints = seen_from_origin(balls);
    const auto model = [&](Float3 y) {
      float least = 1e30f;
      for (int i = 0; i < static_cast<int>(balls.size()); ++i)
        least = std::min(least, constraints.distance[i] + dot(get(constraints, i).gradient, y));
      return least;
    };
    const ClearanceOptimum best =
        maximise_clearance(SerialTeam{}, constraints, static_cast<int>(balls.size()), a, 0);
    EXPECT_LE(norm1(best.y), 3 * a);
    EXPECT_NEAR(model(best.y), best.value, 2e-5f) << "round " << round;
    for (int i = 0; i < 100; ++i)
      ASSERT_LE(model(a * Float3{unit(random), unit(random), unit(random)}), best.value + 1e-5f);
  }
}

TEST(LinearProgram, FourFacesOfATetrahedronMeetAtItsIncentre) {
  SampleMemory faces;
  int count = 0;
  const float s = 1 / std::sqrt(3.0f);
  for (const Float3 n : {Float3{s, s, s}, Float3{s, -s, -s}, Float3{-s, s, -s}, Float3{-s, -s, s}})
    put(faces, count++, {n, 0.5f + dot(n, Float3{0.1f, 0.2f, -0.1f}), 0, 0});
  const ClearanceOptimum best = maximise_clearance(SerialTeam{}, faces, 4, 1, 0);
  EXPECT_NEAR(best.value, 0.5f, 1e-6f);
  EXPECT_NEAR(norm(best.y - Float3{-0.1f, -0.2f, 0.1f}), 0, 1e-6f);
}

}  // namespace
}  // namespace ist::packing
