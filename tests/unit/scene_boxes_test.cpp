#include <gtest/gtest.h>

#include <hwy/highway.h>

#include <cstring>
#include <limits>
#include <random>

#include "query/base/solid_box.h"
#include "scene/body_box.h"

// Boxes of bodies by vectors: the bits of one body's, on every instruction set.

namespace ist {
namespace {

TEST(SceneBoxes, OfEightAreThoseOfEach) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  std::size_t placed = 0, refused = 0, put = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (int round = 0; round < 2000; ++round) {
      BodyBlock block;
      for (std::size_t k = 0; k < BodyBlock::kCount; ++k) {
        const double size = std::exp2(uniform(random) * (below(9) == 0 ? 140 : 10));
        for (int c = 0; c < 3; ++c) {
          block.middle[c][k] = size * uniform(random);
          block.half[c][k] = size * std::abs(uniform(random));
          block.t[c][k] = below(3) == 0 ? 0 : 1e3 * size * uniform(random);
        }
        block.wider[k] = below(2) == 0 ? 0 : 0.125 * size;
        for (int c = 0; c < 4; ++c) {
          block.q[c][k] = below(4) == 0 ? 0 : uniform(random);
          if (round % 3 == 0) block.q[c][k] = c == round % 4 ? 1 : 0;
        }
        const double odd[] = {std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(), 1e-160, 1e308};
        if (below(20) == 0) block.q[below(4)][k] = odd[below(3)];
        if (below(20) == 0) block.t[below(3)][k] = odd[below(4)];
      }
      BlockBoxes boxes;
      place_boxes(block, 0xff, boxes);
      for (std::size_t k = 0; k < BodyBlock::kCount; ++k) {
        const auto of = [&](const double(&from)[3][BodyBlock::kCount]) {
          return Vec3{from[0][k], from[1][k], from[2][k]};
        };
        const double q[4] = {block.q[0][k], block.q[1][k], block.q[2][k], block.q[3][k]};
        const double t[3] = {block.t[0][k], block.t[1][k], block.t[2][k]};
        const Rotation rotation = Rotation::of(q);
        SolidBox solid;
        solid.middle = of(block.middle);
        solid.half = of(block.half);
        const WorldBox box = solid.placed(rotation, t, block.wider[k]);
        const bool fits = usable(rotation, t, 1) && box.fits();
        ASSERT_EQ(boxes.placed >> k & 1, fits ? 1u : 0u) << round << " " << k;
        ++(fits ? placed : refused);
        if (!fits) continue;
        float low[3], high[3];
        box.write(low, high);
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(std::memcmp(&boxes.low[c][k], &low[c], sizeof(float)), 0) << round << " " << k;
          ASSERT_EQ(std::memcmp(&boxes.high[c][k], &high[c], sizeof(float)), 0);
        }
      }
      // The same poses as they come, and where their boxes go.
      Pose poses[BodyBlock::kCount];
      BodyBlock other = block;
      std::uint32_t lane_of[BodyBlock::kCount];
      for (std::uint32_t k = 0; k < BodyBlock::kCount; ++k) {
        poses[k] = block.pose(k);
        other.set_pose(k, {});
        lane_of[k] = (11 * k + static_cast<std::uint32_t>(round)) % 24;
      }
      BoxNode nodes[3];
      ASSERT_EQ(put_poses(poses, other, lane_of, nodes), boxes.placed == 0xff);
      ASSERT_EQ(std::memcmp(&other, &block, sizeof block), 0) << round;
      if (boxes.placed != 0xff) continue;
      ++put;
      for (std::uint32_t k = 0; k < BodyBlock::kCount; ++k)
        ASSERT_EQ(nodes[lane_of[k] / 8].box(lane_of[k] % 8), boxes.box(k)) << round << " " << k;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GT(placed, 10'000u);
  EXPECT_GT(refused, 1'000u);
  EXPECT_GT(put, 100u);
}

}  // namespace
}  // namespace ist
