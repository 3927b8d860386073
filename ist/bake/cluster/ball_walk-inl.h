// The iteration to the smallest ball around others: included once per target.

#if defined(IST_BAKE_BALL_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_BAKE_BALL_WALK_INL_H_
#undef IST_BAKE_BALL_WALK_INL_H_
#else
#define IST_BAKE_BALL_WALK_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "bake/cluster/ball_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using BallTag = hn::CappedTag<double, 8>;
using BallVector = hn::Vec<BallTag>;

/// One bit a lane.
HWY_INLINE std::uint32_t bits_of(hn::Mask<BallTag> mask) {
  const BallTag d;
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] & ((1u << hn::Lanes(d)) - 1);
}

/// Centre distances of balls, in the order of reach()'s sums.
HWY_INLINE BallVector distances(BallVector dx, BallVector dy, BallVector dz) {
  return hn::Sqrt((dx * dx + dy * dy) + dz * dz);
}

/// The reach of the balls from lane i on from the centre of another.
HWY_INLINE BallVector reaches_from(const Ball& centre, const BallLanes& balls, std::size_t i) {
  const BallTag d;
  return distances(hn::Load(d, balls.x.data() + i) - hn::Set(d, centre.x),
                   hn::Load(d, balls.y.data() + i) - hn::Set(d, centre.y),
                   hn::Load(d, balls.z.data() + i) - hn::Set(d, centre.z)) +
         hn::Load(d, balls.r.data() + i);
}

/// The index of the ball that reaches farthest from a centre; among equals the first.
struct Farthest {
  std::size_t place = 0;
  bool found = false;
};

/// Finds the lane that reaches farthest beyond `worst`, which becomes its reach.
HWY_INLINE Farthest farthest_from(const Ball& centre, const BallLanes& balls, double& worst) {
  const BallTag d;
  constexpr std::size_t kLanes = kWidth;
  alignas(64) double reaches[kLanes];
  BallVector most = hn::Set(d, worst);
  for (std::size_t i = 0; i < kLanes; i += hn::Lanes(d)) {
    const BallVector far = reaches_from(centre, balls, i);
    hn::Store(far, d, reaches + i);
    most = hn::Max(most, far);
  }
  const double farthest = hn::GetLane(hn::MaxOfLanes(d, most));
  if (!(farthest > worst)) return {};
  worst = farthest;
  std::size_t place = 0;
  while (reaches[place] != farthest) ++place;
  return {place, true};
}

/// The same for many balls, at least as many as a vector has lanes.
HWY_INLINE Farthest farthest_from(const Ball& centre, std::span<const Ball> balls, double& worst) {
  const BallTag d;
  const std::size_t lanes = hn::Lanes(d);
  static_assert(sizeof(Ball) == 4 * sizeof(double));
  Farthest result;
  for (std::size_t next = 0; next < balls.size(); next += lanes) {
    const std::size_t i = next + lanes <= balls.size() ? next : balls.size() - lanes;
    BallVector x, y, z, r;
    hn::LoadInterleaved4(d, &balls[i].x, x, y, z, r);
    const BallVector far =
        distances(x - hn::Set(d, centre.x), y - hn::Set(d, centre.y), z - hn::Set(d, centre.z)) + r;
    if (hn::AllFalse(d, far > hn::Set(d, worst))) continue;
    worst = hn::GetLane(hn::MaxOfLanes(d, far));
    const std::uint32_t equal = bits_of(far == hn::Set(d, worst));
    result = {i + hwy::Num0BitsBelowLS1Bit_Nonzero32(equal), true};
  }
  return result;
}

HWY_INLINE Ball ball_at(const BallLanes& balls, std::size_t place) { return balls.ball(place); }
HWY_INLINE Ball ball_at(std::span<const Ball> balls, std::size_t place) { return balls[place]; }
HWY_INLINE std::size_t count_of(const BallLanes& balls) { return balls.count; }
HWY_INLINE std::size_t count_of(std::span<const Ball> balls) { return balls.size(); }

/// The smallest ball that contains the given ones. It grows with every ball that joins the support,
/// so the loop ends; the limit only handles ties within rounding. The first ball with
/// enough(radius) is returned immediately.
template <class Balls, class Enough>
Ball smallest_ball(const Balls& balls, const Enough& enough) {
  Support support;
  support.count = 1;
  support.balls[0] = ball_at(balls, 0);
  for (std::size_t i = 1; i < count_of(balls); ++i)
    if (const Ball ball = ball_at(balls, i); ball.r > support.balls[0].r) support.balls[0] = ball;
  Ball current = support.balls[0];
  constexpr int kMostSteps = 100;
  for (int step = 0; step < kMostSteps; ++step) {
    double worst = current.r * (1 + kBallSlack);
    const Farthest farthest = farthest_from(current, balls, worst);
    if (!farthest.found) return current;
    Ball next = current;
    if (!grow(support, ball_at(balls, farthest.place), next) || next.r <= current.r) {
      current.r = worst;  // degenerate to rounding: contain the ball from the present centre
      return current;
    }
    current = next;
    if (enough(current.r)) return current;
  }
  for (std::size_t i = 0; i < count_of(balls); ++i) {
    const double r = reach(current.x, current.y, current.z, ball_at(balls, i));
    current.r = r > current.r ? r : current.r;
  }
  return current;
}

HWY_INLINE BallLanes lanes_of(std::span<const Ball> balls) {
  BallLanes lanes;
  for (std::size_t i = 0; i < balls.size(); ++i) lanes.put(i, balls[i]);
  lanes.close(balls.size());
  return lanes;
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
