#include "bake/cluster/ball_blocks.h"

#include <algorithm>
#include <cmath>

#include "base/rounding.h"

namespace ist {
namespace {

/// An origin for coordinates in [low, high] such that x − origin is exact in float for every float
/// x between them: within a factor of two by Sterbenz' lemma; otherwise zero, when the coordinates
/// are no larger than twice their spread, so that zero is as near as any.
double exact_origin(float low, float high) {
  const bool same_sign = (low > 0 && high > 0) || (low < 0 && high < 0);
  const float smaller = std::fmin(std::fabs(low), std::fabs(high));
  const float larger = std::fmax(std::fabs(low), std::fabs(high));
  if (!same_sign || larger > 2 * smaller) return 0;
  return static_cast<double>(low + (high - low) / 2);
}

}  // namespace

void fill_blocks(std::span<const Sphere> balls, std::vector<BallBlock>& blocks,
                 std::vector<Origin>& origins) {
  const std::size_t count = (balls.size() + kWidth - 1) / kWidth;
  blocks.resize(count);
  origins.resize(count);
  for (std::size_t b = 0; b < count; ++b) {
    const auto used =
        balls.subspan(b * kWidth, std::min<std::size_t>(kWidth, balls.size() - b * kWidth));
    Sphere low = used.front();
    Sphere high = used.front();
    for (const Sphere& s : used) {
      low = {std::fmin(low.x, s.x), std::fmin(low.y, s.y), std::fmin(low.z, s.z), 0};
      high = {std::fmax(high.x, s.x), std::fmax(high.y, s.y), std::fmax(high.z, s.z), 0};
    }
    const Origin origin = {exact_origin(low.x, high.x), exact_origin(low.y, high.y),
                           exact_origin(low.z, high.z)};
    BallBlock& block = blocks[b];
    block = {};
    std::fill(std::begin(block.r), std::end(block.r), kEmptyRadius);
    for (std::size_t l = 0; l < used.size(); ++l) {
      block.x[l] = static_cast<float>(used[l].x - origin.x);
      block.y[l] = static_cast<float>(used[l].y - origin.y);
      block.z[l] = static_cast<float>(used[l].z - origin.z);
      block.r[l] = used[l].r;
    }
    origins[b] = origin;
  }
}

Sphere ball_around(std::span<const Ball> balls) {
  const Ball ball = bounding_ball(balls);
  Sphere out = {static_cast<float>(ball.x), static_cast<float>(ball.y), static_cast<float>(ball.z),
                0};
  double radius = 0;
  for (const Ball& b : balls) radius = std::fmax(radius, reach(out.x, out.y, out.z, b));
  out.r = padded_up(radius);
  return out;
}

}  // namespace ist
