#include <gtest/gtest.h>
#include <cmath>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "packing/banded/linear_program.h"
#include "support/fiber_team.h"

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

/// Balls about the origin, some of which may contain it.
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
    put(SerialTeam{}, &memory, count++, constraint_of(offset, std::sqrt(offset.range2)));
  }
  return memory;
}

TEST(LinearProgram, BoundIsNeverBelowASampledClearance) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int round = 0; round < 2000; ++round) {
    const float scale = round % 3 == 0 ? 1.0f : (round % 3 == 1 ? 1e-2f : 1e-4f);
    const auto balls = random_balls(random, 1 + round % kSampleCapacity, scale);
    const float a = scale * 0.5f * (1.1f + unit(random));
    const SampleMemory constraints = seen_from_origin(balls);
    const ClearanceOptimum best = maximise_clearance(SerialTeam{}, &constraints,
                                                     static_cast<int>(balls.size()), a, 3 * a * a);
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
    const auto balls = random_balls(random, 1 + round % kSampleCapacity, 1);
    const float a = 0.3f;
    const SampleMemory constraints = seen_from_origin(balls);
    const auto model = [&](Float3 y) {
      float least = 1e30f;
      for (int i = 0; i < static_cast<int>(balls.size()); ++i)
        least = std::min(
            least, constraints.distance[i] + dot(get(SerialTeam{}, &constraints, i).gradient, y));
      return least;
    };
    const ClearanceOptimum best =
        maximise_clearance(SerialTeam{}, &constraints, static_cast<int>(balls.size()), a, 0);
    EXPECT_LE(std::abs(best.y.x) + std::abs(best.y.y) + std::abs(best.y.z), 3 * a);
    EXPECT_NEAR(model(best.y), best.value, 2e-5f) << "round " << round;
    for (int i = 0; i < 100; ++i)
      ASSERT_LE(model(a * Float3{unit(random), unit(random), unit(random)}), best.value + 1e-5f);
  }
}

// Bit by bit, whatever the order of the constraints, where many of them are equally violated: balls
// on a lattice, seen from one of its points.
TEST(LinearProgram, AnyOrderAndTeamGivesTheSameBits) {
  std::mt19937 random(3);
  const auto lattice = [&] { return static_cast<float>(static_cast<int>(random() % 5) - 2); };
  ist::testing::Fibers<32> fibers(4);
  for (int round = 0; round < 300; ++round) {
    std::vector<Constraint> rows;
    for (int i = 0; i < 2 + round % (kSampleCapacity - 1); ++i) {
      Float3 centre{lattice(), lattice(), lattice()};
      if (norm(centre) == 0) centre.x = 2;
      const FeatureOffset offset = ball_offset(centre, 0.5f, static_cast<std::uint32_t>(i), {});
      rows.push_back(constraint_of(offset, std::sqrt(offset.range2)));
    }
    const float a = 0.25f * static_cast<float>(1 + random() % 8);
    const auto solve = [&](const auto& team, const SampleMemory& memory) {
      return maximise_clearance(team, &memory, static_cast<int>(rows.size()), a,
                                round % 2 == 0 ? 0 : 3 * a * a);
    };
    const auto memory_of = [&] {
      SampleMemory memory;
      for (int i = 0; i < static_cast<int>(rows.size()); ++i)
        put(SerialTeam{}, &memory, i, rows[static_cast<std::size_t>(i)]);
      return memory;
    };
    const ClearanceOptimum expected = solve(SerialTeam{}, memory_of());
    std::shuffle(rows.begin(), rows.end(), random);
    const SampleMemory shuffled = memory_of();
    const ClearanceOptimum again = solve(SerialTeam{}, shuffled);
    ASSERT_EQ(std::memcmp(&again, &expected, sizeof again), 0) << "round " << round;
    ClearanceOptimum by_lanes[32];
    fibers.run([&](int lane) {
      by_lanes[lane] = solve(ist::testing::FiberTeam<32>(fibers, lane), shuffled);
    });
    for (const ClearanceOptimum& got : by_lanes)
      ASSERT_EQ(std::memcmp(&got, &expected, sizeof got), 0) << "round " << round;
  }
}

TEST(LinearProgram, FourFacesOfATetrahedronMeetAtItsIncentre) {
  SampleMemory faces;
  int count = 0;
  const float s = 1 / std::sqrt(3.0f);
  for (const Float3 n : {Float3{s, s, s}, Float3{s, -s, -s}, Float3{-s, s, -s}, Float3{-s, -s, s}})
    put(SerialTeam{}, &faces, count++, {n, 0.5f + dot(n, Float3{0.1f, 0.2f, -0.1f}), 0, 0});
  const ClearanceOptimum best = maximise_clearance(SerialTeam{}, &faces, 4, 1, 0);
  EXPECT_NEAR(best.value, 0.5f, 1e-6f);
  EXPECT_NEAR(norm(best.y - Float3{-0.1f, -0.2f, 0.1f}), 0, 1e-6f);
}

}  // namespace
}  // namespace ist::packing
