#include "bake/cluster/ball_lanes.h"

#include <ist/asset_layout.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/cluster/bounding_ball.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "bake/cluster/ball_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

Ball bounding_ball(std::span<const Ball> balls) {
  const auto never = [](double) { return false; };
  if (balls.size() <= kWidth) return smallest_ball(lanes_of(balls), never);
  return smallest_ball(balls, never);
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(bounding_ball);

Ball bounding_ball(std::span<const Ball> balls) {
  return HWY_DYNAMIC_DISPATCH(bounding_ball)(balls);
}

}  // namespace ist
#endif
