#include <gtest/gtest.h>
#include <ist/deadline.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "support/baked.h"
#include "support/ring_in_knot.h"
#include "support/sanitizers.h"

// The pair budget that keeps a loop's queries within a deadline. Times come from a model, so that
// no machine decides: what a query costs by its sphere pairs, noise, and stalls of the thread.

namespace ist {
namespace {

class Times {
 public:
  explicit Times(std::uint64_t seed) : random_(seed) {}

  /// [µs]
  double of(const Penetration& answer) {
    double us = (6 + 0.02 * answer.sphere_pairs) * (0.85 + 0.3 * uniform());
    if (uniform() < 0.005) us += 50 + 100 * uniform();
    return us;
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  std::mt19937_64 random_;
};

struct LoopRun {
  testing::RingRun ring;
  double p99 = 0;  ///< [µs] after a tenth of a second
  std::uint32_t budget = 0;
  bool too_slow = false;  ///< at the end
};

class Loop {
 public:
  Loop(std::size_t spheres, bool surface)
      : knot_(testing::baked(make_sample("torus_knot"), "knot", spheres, surface)),
        ring_(testing::baked(testing::ring_mesh(), "ring", spheres, surface)) {}

  LoopRun run(double stiffness, double deadline_us) {
    Deadline deadline(deadline_us);
    Times times(7);
    std::vector<double> taken;
    LoopRun result;
    result.ring = testing::run_ring(stiffness, 2000, 4, [&](const Pose& pose) {
      PenetrationSettings settings;
      deadline.limit(settings);
      result.budget = settings.pair_budget;
      const Penetration answer =
          penetration({knot_.view(), {}, 1}, {ring_.view(), pose, 1}, settings, workspace_);
      taken.push_back(times.of(answer));
      deadline.record(answer, taken.back());
      return answer;
    });
    taken.erase(taken.begin(), taken.begin() + 200);
    const auto rank = taken.begin() + static_cast<std::ptrdiff_t>(taken.size() * 99 / 100);
    std::nth_element(taken.begin(), rank, taken.end());
    result.p99 = *rank;
    result.too_slow = deadline.too_slow();
    return result;
  }

 private:
  const Asset knot_, ring_;
  Workspace workspace_;
};

TEST(DeadlineLoop, ARingOnAKnotKeepsItsEnergyAndItsTime) {
  if (testing::kSanitized) GTEST_SKIP() << "takes minutes";
  const struct {
    std::size_t spheres;
    bool surface;
    double stiffness;
    std::vector<double> deadlines;
  } loops[] = {{4000, true, 1e4, {160, 20}}, {8000, false, 1e5, {20}}};
  for (const auto& [spheres, surface, stiffness, deadlines] : loops) {
    Loop loop(spheres, surface);
    for (const double deadline : deadlines) {
      SCOPED_TRACE(::testing::Message() << spheres << " spheres, " << deadline << " us");
      const LoopRun run = loop.run(stiffness, deadline);
      EXPECT_GT(run.ring.touching, 1000);
      EXPECT_GT(run.ring.apart, 100);
      EXPECT_LT(run.ring.grown, 0.01);
      EXPECT_LT(run.ring.fell, 0.01);
      EXPECT_LT(run.p99, 1.2 * deadline);
      EXPECT_FALSE(run.too_slow);
    }
  }
}

TEST(DeadlineLoop, SaysWhatNoBudgetKeeps) {
  if (testing::kSanitized) GTEST_SKIP() << "takes minutes";
  const LoopRun run = Loop(4000, false).run(1e5, 7);
  EXPECT_TRUE(run.too_slow);
  EXPECT_LT(run.ring.grown, 0.05);
}

Penetration answer_of(std::uint32_t pairs) {
  Penetration answer;
  answer.volume = pairs > 0 ? 1 : 0;
  answer.sphere_pairs = pairs;
  return answer;
}

std::uint32_t budget_of(const Deadline& deadline) {
  PenetrationSettings settings;
  deadline.limit(settings);
  return settings.pair_budget;
}

TEST(Deadline, NoneLimitsNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double us : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    Deadline deadline(us);
    deadline.record(answer_of(1000), 1e6);
    PenetrationSettings settings;
    deadline.limit(settings);
    EXPECT_EQ(settings.pair_budget, 0u);
    EXPECT_FALSE(settings.spheres_only);
    EXPECT_FALSE(deadline.too_slow());
  }
}

TEST(Deadline, ABudgetGlidesInContactAndJumpsApart) {
  Deadline deadline(100);
  std::uint32_t before = budget_of(deadline);
  for (int i = 0; i < 500; ++i) {
    deadline.record(answer_of(before), 0.01 * before);  // 100 pairs/µs
    const std::uint32_t budget = budget_of(deadline);
    EXPECT_NEAR(budget, before, 0.001 * before + 1);
    before = budget;
  }
  deadline.record(answer_of(0), 1);
  EXPECT_GT(budget_of(deadline), 2 * before);
  EXPECT_LE(budget_of(deadline), 8000u);
  const Deadline copy = deadline;
  EXPECT_EQ(budget_of(copy), budget_of(deadline));
}

TEST(Deadline, StallsAndBadTimesChangeLittle) {
  Deadline deadline(100), stalled(100);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 3000; ++i) {
    for (Deadline* const each : {&deadline, &stalled}) {
      const std::uint32_t pairs = budget_of(*each);
      each->record(answer_of(pairs), 0.01 * pairs * (1 + 0.1 * (i % 7)));
      each->record(answer_of(0), 1);
    }
    if (i % 100 == 0) stalled.record(answer_of(budget_of(stalled)), 1e5);
    for (const double us : {nan, 0.0, -5.0}) stalled.record(answer_of(1000), us);
  }
  EXPECT_NEAR(budget_of(stalled), budget_of(deadline), 0.3 * budget_of(deadline));
}

}  // namespace
}  // namespace ist
